#include "render/mujoco_guard.h"

#include <mujoco/mujoco.h>

#include <chrono>
#include <cstdio>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace flowscope {

namespace {

thread_local std::string last_warning;

[[noreturn]] void throw_error(const char* message) {
  throw std::runtime_error(std::string("MuJoCo: ") + message);
}

/// True when `text` differs from the last one printed, or a second has passed.
bool worth_printing(const std::string& text) {
  using Clock = std::chrono::steady_clock;
  static std::mutex mutex;
  static std::string printed;
  static Clock::time_point when;
  const std::lock_guard lock(mutex);
  const auto now = Clock::now();
  if (text == printed && now - when < std::chrono::seconds(1)) return false;
  printed = text;
  when = now;
  return true;
}

void keep_warning(const char* message) {
  last_warning = message;
  if (worth_printing(last_warning)) std::fprintf(stderr, "MuJoCo warning: %s\n", message);
}

}  // namespace

void install_mujoco_guard() {
  static const bool installed = [] {
    mju_user_error = throw_error;
    mju_user_warning = keep_warning;
    return true;
  }();
  static_cast<void>(installed);
}

std::string take_mujoco_warning() { return std::exchange(last_warning, {}); }

}  // namespace flowscope
