// One HTTP connection: read, check, route, answer, again. I/O thread only.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <memory>
#include <optional>

#include "web/context.h"

namespace flowscope::web {

/// Requests of one connection are answered one after the other. Streams and WebSockets take the socket over.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(boost::asio::ip::tcp::socket socket, std::shared_ptr<Context> context);
  ~HttpSession();
  void start();

 private:
  using Incoming = boost::beast::http::request<boost::beast::http::string_body>;

  void read();
  void refuse_unreadable(boost::system::error_code failure);
  void handle();
  /// What the request asks for, or the reason to refuse it. Throws ApiError.
  void dispatch();
  void run(const Route& route, Request request);
  void open_stream(const std::string& view);
  void open_events();
  void answer(Response response);
  void send_file(const FileSlice& slice);
  void finish(boost::system::error_code failure);
  void close();
  /// Reads on after a refusal: closing with unread bytes would reset the connection before the answer is
  /// read.
  void discard(std::size_t left);

  boost::beast::tcp_stream stream_;
  std::shared_ptr<Context> context_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  Incoming request_;
  bool keep_alive_ = false;
  bool unread_ = false;  ///< the peer may still be sending what was refused
};

}  // namespace flowscope::web
