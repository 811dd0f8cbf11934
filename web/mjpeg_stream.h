// One viewer of the live picture: multipart/x-mixed-replace on a socket taken over from HTTP. I/O thread
// only.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "web/context.h"
#include "web/frame_hub.h"

namespace flowscope::web {

/// Holds one waiting picture, the newest: a slow viewer misses pictures and delays nobody. A picture that did
/// not get through within ten seconds ends the stream. When nothing new comes the last picture is repeated
/// soon, once, and then every second.
class MjpegStream : public FrameViewer, public std::enable_shared_from_this<MjpegStream> {
 public:
  MjpegStream(boost::asio::ip::tcp::socket socket, std::shared_ptr<Context> context, PlaceHold place,
              std::string view);
  ~MjpegStream() override;
  void start();
  void offer(const FramePtr& frame) override;
  void close() override;

 private:
  using Clock = std::chrono::steady_clock;
  void send(std::string head, FramePtr frame);
  void write_next();
  void watch_peer();
  void tick();

  boost::asio::ip::tcp::socket socket_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<Context> context_;
  PlaceHold place_;
  std::string view_;
  FramePtr waiting_, last_;
  std::string head_;  ///< of the part being written
  FramePtr sending_;
  bool writing_ = false, closed_ = false, repeated_ = false;  ///< repeated_: last_ went out twice
  Clock::time_point write_started_{}, write_done_{};
  std::array<char, 256> ignored_{};
};

}  // namespace flowscope::web
