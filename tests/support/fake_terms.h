// Success terms that live: two buttons, pressed slowly one after the other.
#pragma once

#include <algorithm>
#include <cstdio>
#include <vector>

#include "recorder/success_term.h"

namespace flowscope::testing {

/// The first passes its threshold of 1 mm at 2 s, the second at 12 s.
inline std::vector<SuccessTerm> fake_terms(double time_s) {
  std::vector<SuccessTerm> terms;
  const char* names[] = {"pressed red", "pressed blue"};
  for (int i = 0; i < 2; ++i) {
    const double begin_s = 10.0 * i, travel_m = std::clamp(0.0005 * (time_s - begin_s), 0.0, 0.002);
    char value[32];
    std::snprintf(value, sizeof value, "%.1f mm", 1000 * travel_m);
    SuccessTerm term{names[i], travel_m > 0.001, value, "in_order/" + std::to_string(i),
                     TermMeasure{travel_m, 0.001, "m", true}};
    if (term.met) term.first_met_s = begin_s + 2;
    terms.push_back(term);
  }
  return terms;
}

}  // namespace flowscope::testing
