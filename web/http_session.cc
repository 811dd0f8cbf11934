#include "web/http_session.h"

#include <boost/asio/post.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>

#include "web/event_socket.h"
#include "web/file_sender.h"
#include "web/mjpeg_stream.h"

namespace flowscope::web {

namespace net = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds read_deadline{10}, idle_deadline{60}, write_deadline{10}, linger{2};
constexpr std::size_t most_discarded = 1 << 20;
constexpr std::uint32_t header_limit = 8 * 1024;
constexpr std::uint64_t body_limit = 256 * 1024;

constexpr const char* page_policy =
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view_of(boost::beast::string_view text) { return {text.data(), text.size()}; }

std::string_view header(const http::request<http::string_body>& request, http::field name) {
  return view_of(request[name]);
}
std::string_view header(const http::request<http::string_body>& request, const char* name) {
  return view_of(request[name]);
}

/// Headers that a request must not carry twice: two proxies could read two different requests out of it.
void check_framing(const http::request<http::string_body>& request) {
  for (const auto name : {http::field::host, http::field::content_length, http::field::transfer_encoding,
                          http::field::authorization, http::field::origin, http::field::content_type})
    if (request.count(name) > 1)
      throw ApiError(400, "bad_request", "a header appears twice", std::string(view_of(to_string(name))));
  if (request.count(http::field::content_length) && request.count(http::field::transfer_encoding))
    throw ApiError(400, "bad_request", "both Content-Length and Transfer-Encoding", "Transfer-Encoding");
  if (!request.count(http::field::host)) throw ApiError(400, "bad_request", "Host is missing", "Host");
}

Credentials credentials(const http::request<http::string_body>& request,
                        const std::optional<std::string>& token) {
  Credentials c;
  c.method = view_of(request.method_string());
  c.host = header(request, http::field::host);
  c.origin = header(request, http::field::origin);
  c.has_origin = request.count(http::field::origin) > 0;
  c.fetch_site = header(request, "Sec-Fetch-Site");
  c.fetch_mode = header(request, "Sec-Fetch-Mode");
  c.authorization = header(request, http::field::authorization);
  c.cookie = header(request, http::field::cookie);
  c.content_type = header(request, http::field::content_type);
  c.has_query_token = token.has_value();
  if (token) c.query_token = *token;
  c.has_body = !request.body().empty();
  return c;
}

/// The token leaves the address bar. Browsers hold a strict cookie back while they follow a redirect that a
/// foreign page began, so that visitor gets a page of our own that goes on.
Response welcome(const Gate& gate, const Query& query, bool from_elsewhere) {
  const std::string target = "/" + query.without("token");
  Response response;
  response.headers.emplace_back("Set-Cookie", gate.cookie());
  response.headers.emplace_back("Cache-Control", "no-store");
  response.content_type = "text/html; charset=utf-8";
  if (from_elsewhere) {
    std::string quoted;
    for (const char c : target) quoted += c == '&' ? std::string("&amp;") : std::string(1, c);
    response.body = "<!doctype html><meta http-equiv=\"refresh\" content=\"0; url=" + quoted +
                    "\"><title>flowscope</title>";
  } else {
    response.status = 303;
    response.headers.emplace_back("Location", target);
  }
  return response;
}

}  // namespace

HttpSession::HttpSession(net::ip::tcp::socket socket, std::shared_ptr<Context> context)
    : stream_(std::move(socket)), context_(std::move(context)) {
  ++context_->counters.connections;
}

HttpSession::~HttpSession() { --context_->counters.connections; }

void HttpSession::start() {
  error_code ignored;
  stream_.socket().set_option(net::ip::tcp::no_delay(true), ignored);
  stream_.expires_after(read_deadline);
  read();
}

void HttpSession::read() {
  parser_.emplace();
  parser_->header_limit(header_limit);
  parser_->body_limit(body_limit);
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code failure, std::size_t) {
    if (failure) return self->refuse_unreadable(failure);
    self->stream_.expires_never();
    self->request_ = self->parser_->release();
    self->handle();
  });
}

void HttpSession::refuse_unreadable(error_code failure) {
  const bool is_http_error = failure.category() == http::make_error_code(http::error::bad_value).category();
  if (!is_http_error || failure == http::error::end_of_stream || failure == http::error::partial_message)
    return close();
  request_ = {};
  keep_alive_ = false;
  unread_ = true;
  ApiError error(400, "bad_request", "not HTTP that can be read: " + failure.message());
  if (failure == http::error::body_limit)
    error = ApiError(413, "too_large", "the body is above 256 KiB", "body");
  if (failure == http::error::header_limit)
    error = ApiError(431, "header_too_large", "the header is above 8 KiB");
  answer(error_response(error));
}

void HttpSession::handle() {
  ++context_->counters.requests;
  keep_alive_ = request_.keep_alive();
  try {
    dispatch();
  } catch (const ApiError& error) {
    answer(error_response(error));
  } catch (const std::exception& error) {
    answer(error_response(ApiError(500, "internal", error.what())));
  }
}

void HttpSession::dispatch() {
  check_framing(request_);
  const std::string_view target = view_of(request_.target());
  const std::size_t mark = std::min(target.find('?'), target.size());
  const auto path = percent_decode(target.substr(0, mark));
  if (!path || !path->starts_with('/'))
    throw ApiError(400, "bad_request", "the address cannot be read", "path");
  Request request;
  request.method = view_of(request_.method_string());
  request.path = *path;
  request.query = Query(target.substr(std::min(mark + 1, target.size())));
  request.range = header(request_, http::field::range);

  const auto token = request.query.get("token");
  const Credentials who = credentials(request_, token);
  const bool is_root = request.path == "/";
  context_->gate.check_origin(who, is_root && !request.query.get("action"));
  if (is_root && (request.query.get("action") == "stream" || request.query.get("action") == "snapshot"))
    request.path = "/" + *request.query.get("action");

  Match match = context_->router.find(request.method, request.path);
  if (!match.route || !match.route->open) context_->gate.check_token(who);
  if (!match.route) {
    if (!match.allow.empty()) {
      Response refused =
          error_response(ApiError(405, "wrong_method", "this address knows " + match.allow, "method"));
      refused.headers.emplace_back("Allow", match.allow);
      return answer(std::move(refused));
    }
    const bool reads = request.method == "GET" || request.method == "HEAD";
    auto file = reads ? context_->page.get(request.path) : std::nullopt;
    if (!file) throw ApiError(404, "not_found", "there is nothing at this address", "path");
    return answer(std::move(*file));
  }
  const Route& route = *match.route;
  if (!route.request.empty()) context_->gate.check_body_type(who);
  request.params = std::move(match.params);
  switch (route.lane) {
    case Lane::page:
      if (token && context_->gate.asks_for_token())
        return answer(
            welcome(context_->gate, request.query,
                    !who.fetch_site.empty() && who.fetch_site != "none" && who.fetch_site != "same-origin"));
      return answer(context_->page.get("/").value());
    case Lane::stream:
      return open_stream(request.query.get("view").value_or("main"));
    case Lane::events:
      return open_events();
    default:
      request.body = std::move(request_.body());
      return run(route, std::move(request));
  }
}

void HttpSession::run(const Route& route, Request request) {
  WorkerPool& pool = route.lane == Lane::slow ? context_->slow : context_->quick;
  const bool posted = pool.post([self = shared_from_this(), &route, request = std::move(request)] {
    Response response;
    try {
      response = route.handle(request);
    } catch (const ApiError& error) {
      response = error_response(error);
    } catch (const std::exception& error) {
      response = failure_response(error, route.method + " " + route.pattern);
    } catch (...) {
      response =
          error_response(ApiError(500, "internal", "an unknown failure", route.method + " " + route.pattern));
    }
    net::post(self->stream_.get_executor(), [self, &route, response = std::move(response)]() mutable {
      if (response.status == 500)
        self->context_->events.publish(
            to_message(LogEvent{"error", route.method + " " + route.pattern + " failed: " + response.body}));
      self->answer(std::move(response));
    });
  });
  if (!posted) throw ApiError(503, "busy", "too many calls wait already; try again");
}

void HttpSession::open_stream(const std::string& view) {
  if (context_->counters.streams >= context_->options.max_streams)
    throw ApiError(503, "too_many_streams", "all streams are taken; close one");
  const bool posted = context_->quick.post([self = shared_from_this(), view] {
    std::optional<Response> refused;
    try {
      self->context_->backend.view(view);  // throws for a view that is not there
    } catch (const ApiError& error) {
      refused = error_response(error);
    } catch (const std::exception& error) {
      refused = error_response(ApiError(500, "internal", error.what()));
    }
    net::post(self->stream_.get_executor(), [self, view, refused = std::move(refused)]() mutable {
      if (refused) return self->answer(std::move(*refused));
      if (self->request_.method() == http::verb::head) {
        Response head;
        head.content_type = "multipart/x-mixed-replace; boundary=frame";
        return self->answer(std::move(head));
      }
      std::make_shared<MjpegStream>(self->stream_.release_socket(), self->context_, view)->start();
    });
  });
  if (!posted) throw ApiError(503, "busy", "too many calls wait already; try again");
}

void HttpSession::open_events() {
  if (!boost::beast::websocket::is_upgrade(request_)) {
    Response refused =
        error_response(ApiError(426, "upgrade_required", "this address speaks WebSocket", "Upgrade"));
    refused.headers.emplace_back("Upgrade", "websocket");
    return answer(std::move(refused));
  }
  std::make_shared<EventSocket>(std::move(stream_), context_)->start(request_);
}

void HttpSession::answer(Response response) {
  if (response.status >= 500) ++context_->counters.server_errors;
  if (response.status >= 400 && response.status < 500) ++context_->counters.client_errors;
  const bool head_only = request_.method() == http::verb::head;
  auto message =
      std::make_shared<http::response<http::string_body>>(static_cast<http::status>(response.status), 11);
  message->set(http::field::server, "flowscope");
  message->set("X-Content-Type-Options", "nosniff");
  message->set("Referrer-Policy", "no-referrer");
  message->set("Cross-Origin-Resource-Policy", "same-origin");
  message->set("Content-Security-Policy", page_policy);
  if (!response.content_type.empty()) message->set(http::field::content_type, response.content_type);
  bool cached = false;
  for (const auto& [name, value] : response.headers) {
    message->insert(name, value);
    cached = cached || name == "Cache-Control";
  }
  if (!cached) message->set(http::field::cache_control, "no-store");
  message->keep_alive(keep_alive_);
  const std::uint64_t length = response.file ? response.file->length : response.body.size();
  if (response.status != 204) message->content_length(length);
  if (!head_only && !response.file) message->body() = std::move(response.body);

  stream_.expires_after(write_deadline);
  const auto sent = [self = shared_from_this(), message, slice = response.file, head_only](error_code failure,
                                                                                           std::size_t) {
    if (failure || !slice || head_only || slice->length == 0) return self->finish(failure);
    self->send_file(*slice);
  };
  if (head_only || response.file) {
    auto serializer = std::make_shared<http::response_serializer<http::string_body>>(*message);
    http::async_write_header(stream_, *serializer, [sent, serializer](error_code failure, std::size_t size) {
      sent(failure, size);
    });
  } else {
    http::async_write(stream_, *message, sent);
  }
}

void HttpSession::send_file(const FileSlice& slice) {
  send_file_slice(stream_, slice, [self = shared_from_this()](error_code failure) { self->finish(failure); });
}

void HttpSession::finish(error_code failure) {
  if (failure || !keep_alive_) return close();
  stream_.expires_after(idle_deadline);
  read();
}

void HttpSession::close() {
  error_code ignored;
  stream_.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
  if (!unread_) return;
  stream_.expires_after(linger);
  discard(most_discarded);
}

void HttpSession::discard(std::size_t left) {
  buffer_.clear();
  stream_.async_read_some(buffer_.prepare(std::min<std::size_t>(left, 64 * 1024)),
                          [self = shared_from_this(), left](error_code failure, std::size_t size) {
                            if (!failure && size < left) self->discard(left - size);
                          });
}

}  // namespace flowscope::web
