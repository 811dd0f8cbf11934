// Success terms as JSON: in the state, and as series in what record prints.
#pragma once

#include "recorder/term_series.h"
#include "web/wire.h"

namespace flowscope::web::wire {

/// `measured` and `threshold` are null for a term without a number; the term is met while measured is
/// `wanted`
/// ("above" or "at most") the threshold, in in_order since its turn came.
Json to_json(const SuccessTerm& term);
/// Values are rounded to four significant digits.
Json to_json(const TermSeries& series);

}  // namespace flowscope::web::wire
