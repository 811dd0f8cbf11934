// The present moment for people and files.
#pragma once

#include <string>

namespace flowscope {

/// ISO 8601 in UTC, whole seconds: 2026-01-31T23:59:59Z. Any thread.
std::string utc_now();

}  // namespace flowscope
