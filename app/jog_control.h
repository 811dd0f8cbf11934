// The way from the keys in a browser to the arm on the sim thread.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

#include "recorder/teleop.h"

namespace flowscope {

/// The newest jog command, for as long as it is renewed, and what became of it. Any thread.
class JogControl {
 public:
  using Clock = std::chrono::steady_clock;
  /// A command that is not renewed within this ends by itself: the key's release may be lost with its client.
  static constexpr std::chrono::milliseconds dead_man{300};

  void command(const JogCommand& command, Clock::time_point now = Clock::now());
  void release() { command({}); }
  /// What the arm shall do now; nothing moves once the dead man's time is over.
  JogCommand wanted(Clock::time_point now = Clock::now()) const;

  void report(JogState state, std::string message);
  struct Report {
    JogState state = JogState::still;
    std::string message;
  };
  Report report() const;

 private:
  mutable std::mutex mutex_;
  JogCommand command_;
  Clock::time_point until_{};
  Report report_;
};

}  // namespace flowscope
