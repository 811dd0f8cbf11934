// Accepts connections. I/O thread only, after construction.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>

#include "web/context.h"

namespace flowscope::web {

class Listener {
 public:
  /// Binds. Throws std::system_error naming host and port.
  Listener(boost::asio::io_context& io, std::shared_ptr<Context> context);
  void accept();
  void close();
  std::uint16_t port() const { return port_; }

 private:
  void welcome(boost::asio::ip::tcp::socket socket);
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;  ///< while no descriptor is free
  std::shared_ptr<Context> context_;
  std::uint16_t port_ = 0;
};

}  // namespace flowscope::web
