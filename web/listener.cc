#include "web/listener.h"

#include <system_error>

#include "web/http_session.h"

namespace flowscope::web {

namespace net = boost::asio;
using boost::system::error_code;
using tcp = net::ip::tcp;

namespace {

[[noreturn]] void fail(const ServerOptions& options, const error_code& cause) {
  throw std::system_error(cause.value(), std::system_category(),
                          "cannot listen on " + options.host + ":" + std::to_string(options.port));
}

tcp::endpoint endpoint(net::io_context& io, const ServerOptions& options) {
  error_code failure;
  const auto address = net::ip::make_address(options.host, failure);
  if (!failure) return {address, options.port};
  const auto found =
      tcp::resolver(io).resolve(options.host, std::to_string(options.port),
                                tcp::resolver::passive | tcp::resolver::numeric_service, failure);
  if (failure || found.empty())
    throw std::system_error(std::make_error_code(std::errc::address_not_available),
                            "cannot listen on " + options.host + ": no such host");
  return found.begin()->endpoint();
}

}  // namespace

Listener::Listener(net::io_context& io, std::shared_ptr<Context> context)
    : acceptor_(io), pause_(io), context_(std::move(context)) {
  const ServerOptions& options = context_->options;
  const tcp::endpoint where = endpoint(io, options);
  error_code failure;
  acceptor_.open(where.protocol(), failure);
  if (!failure) acceptor_.set_option(net::socket_base::reuse_address(true), failure);
  if (!failure) acceptor_.bind(where, failure);
  if (!failure) acceptor_.listen(net::socket_base::max_listen_connections, failure);
  if (failure) fail(options, failure);
  port_ = acceptor_.local_endpoint().port();
  context_->gate.serve_on(port_);
}

void Listener::accept() {
  acceptor_.async_accept([this](error_code failure, tcp::socket socket) {
    if (failure == net::error::operation_aborted || !acceptor_.is_open()) return;
    if (!failure) {
      welcome(std::move(socket));
      return accept();
    }
    // Mostly no free descriptor: trying again at once would only spin, unless somebody silent goes for it.
    if (context_->places.make_room()) return accept();
    pause_.expires_after(std::chrono::milliseconds(200));
    pause_.async_wait([this](error_code stopped) {
      if (!stopped) accept();
    });
  });
}

void Listener::welcome(tcp::socket socket) {
  const auto session = std::make_shared<HttpSession>(std::move(socket), context_);
  auto place = context_->places.take([guest = std::weak_ptr(session)] {
    if (const auto sent_away = guest.lock()) sent_away->leave();
  });
  if (place) return session->start(std::move(place));
  session->turn_away();
}

void Listener::close() {
  error_code ignored;
  acceptor_.close(ignored);
  pause_.cancel();
}

}  // namespace flowscope::web
