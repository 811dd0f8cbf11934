// Every success term of a run with its value at every recorded frame.
#pragma once

#include <vector>

#include "recorder/success_term.h"

namespace flowscope {

struct TermSeries {
  std::string name, path;      ///< as in SuccessTerm
  TermMeasure at_end;          ///< unit, threshold and side hold throughout
  std::vector<double> values;  ///< one per frame, the first at the run's start
  std::optional<double> first_met_s;
  bool met_at_end = false;
};

/// Appends a frame's terms. The first call makes the rows; a term that has no number counts as 1 while met,
/// else 0.
void append_terms(const std::vector<SuccessTerm>& terms, std::vector<TermSeries>& series);

}  // namespace flowscope
