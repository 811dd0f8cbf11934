// One HTTP connection: read, check, route, answer, again. I/O thread only.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "web/context.h"
#include "web/request_reader.h"

namespace flowscope::web {

/// Requests of one connection are answered one after the other. The head alone decides who may ask and for
/// what: of a refused request no body is read. Streams and WebSockets take the socket over.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(boost::asio::ip::tcp::socket socket, std::shared_ptr<Context> context);
  ~HttpSession();
  /// The place is given back when the connection ends, whoever has taken it over by then.
  void start(PlaceHold place);
  void leave();      ///< closes at once, for somebody else's sake
  void turn_away();  ///< instead of start(), when there is no place: says so and closes

 private:
  void read(std::chrono::seconds patience);
  void refuse_unreadable(boost::system::error_code failure);
  /// Runs a step; what it throws becomes the answer.
  void guarded(const std::function<void()>& step);
  void refuse(Response response);
  /// Reads the head: refuses the request, or sets what to do once all of it is here. Throws ApiError.
  void admit();
  void choose(Match match, Request request, const Credentials& who);
  void receive();
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
  PlaceHold place_;
  RequestReader reader_{stream_};
  std::function<void()> act_;  ///< what admit() decided
  std::string call_;           ///< "GET /path", for messages
  std::vector<char> discarded_;
  bool keep_alive_ = false, known_ = false;
  bool framed_ = false;  ///< where the request ends is beyond doubt
  bool unread_ = false;  ///< the peer may still be sending what was refused
};

}  // namespace flowscope::web
