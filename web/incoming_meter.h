// How much a WebSocket client sends: it is asked for nothing, so a little is allowed and the rest is a flood.
// I/O thread only.
#pragma once

#include <algorithm>
#include <cstddef>

namespace flowscope::web {

/// A rate policy of Beast's basic_stream, with what is needed to see two ways to keep a server busy for ever:
/// sending fast, and beginning a message that never ends (empty fragments reach nobody's message handler).
class IncomingMeter {
 public:
  /// A control frame (ping, pong, close) of that much payload was among what came.
  void saw_control(std::size_t payload) { open_bytes_ -= std::min(open_bytes_, payload + masked_head); }
  void saw_message() { open_bytes_ = 0; }
  /// Once a second. True when the client has to go.
  bool tick();

  // What Beast asks of a rate policy.
  std::size_t available_read_bytes() const { return left_; }
  std::size_t available_write_bytes() const { return static_cast<std::size_t>(-1); }
  void transfer_read_bytes(std::size_t size);
  void transfer_write_bytes(std::size_t) const {}
  void on_timer() const {}

 private:
  static constexpr std::size_t masked_head = 6;  ///< of a client's frame below 126 bytes
  static constexpr std::size_t most_at_once = 64 * 1024, per_second = 8 * 1024;
  static constexpr int longest_message_s = 5;
  std::size_t left_ = most_at_once;
  std::size_t open_bytes_ = 0;  ///< of a message that has not ended
  int open_s_ = 0;
};

}  // namespace flowscope::web
