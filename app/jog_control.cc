#include "app/jog_control.h"

namespace flowscope {

void JogControl::command(const JogCommand& command, Clock::time_point now) {
  std::lock_guard lock(mutex_);
  command_ = command;
  until_ = now + dead_man;
}

JogCommand JogControl::wanted(Clock::time_point now) const {
  std::lock_guard lock(mutex_);
  return now < until_ ? command_ : JogCommand{};
}

void JogControl::report(JogState state, std::string message) {
  std::lock_guard lock(mutex_);
  report_ = {state, std::move(message)};
}

JogControl::Report JogControl::report() const {
  std::lock_guard lock(mutex_);
  return report_;
}

}  // namespace flowscope
