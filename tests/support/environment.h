// A variable of the environment, as it was again when the test ends.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

namespace flowscope::testing {

class Variable {
 public:
  /// Unset without a value.
  explicit Variable(std::string name, const std::optional<std::string>& value = {}) : name_(std::move(name)) {
    if (const char* now = std::getenv(name_.c_str())) before_ = now;
    set(value);
  }
  ~Variable() { set(before_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;
  void set(const std::optional<std::string>& value) {
    if (value) {
      ::setenv(name_.c_str(), value->c_str(), 1);
    } else {
      ::unsetenv(name_.c_str());
    }
  }

 private:
  std::string name_;
  std::optional<std::string> before_;
};

}  // namespace flowscope::testing
