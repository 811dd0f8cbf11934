#include "web/wire_terms.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace flowscope::web::wire {
namespace {

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return number(std::strtod(text, nullptr));
}

Json optional_number(const std::optional<double>& value) { return value ? number(*value) : Json(); }

const char* wanted(const TermMeasure& measure) { return measure.above ? "above" : "at most"; }

}  // namespace

Json to_json(const SuccessTerm& term) {
  const TermMeasure measure = term.measure.value_or(TermMeasure{});
  return {{"name", term.name},
          {"met", term.met},
          {"value", term.value},
          {"path", term.path},
          {"measured", term.measure ? number(measure.value) : Json()},
          {"threshold", term.measure ? number(measure.threshold) : Json()},
          {"unit", measure.unit},
          {"wanted", wanted(measure)},
          {"first_met_s", optional_number(term.first_met_s)}};
}

Json to_json(const TermSeries& series) {
  Json values = Json::array();
  for (const double value : series.values) values.push_back(rounded(value));
  return {{"name", series.name},
          {"path", series.path},
          {"unit", series.at_end.unit},
          {"threshold", number(series.at_end.threshold)},
          {"wanted", wanted(series.at_end)},
          {"first_met_s", optional_number(series.first_met_s)},
          {"met_at_end", series.met_at_end},
          {"values", std::move(values)}};
}

}  // namespace flowscope::web::wire
