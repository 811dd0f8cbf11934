#include "recorder/term_series.h"

#include <stdexcept>

namespace flowscope {

void append_terms(const std::vector<SuccessTerm>& terms, std::vector<TermSeries>& series) {
  if (series.empty())
    for (const SuccessTerm& term : terms) series.push_back({term.name, term.path, {}, {}, {}, false});
  if (series.size() != terms.size()) throw std::logic_error("the terms of a run changed their number");
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const SuccessTerm& term = terms[i];
    TermSeries& row = series[i];
    row.at_end = term.measure.value_or(TermMeasure{term.met ? 1.0 : 0.0, 0, "", true});
    row.values.push_back(row.at_end.value);
    row.first_met_s = term.first_met_s;
    row.met_at_end = term.met;
  }
}

}  // namespace flowscope
