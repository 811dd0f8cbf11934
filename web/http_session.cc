#include "web/http_session.h"

#include <boost/asio/post.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "web/address.h"
#include "web/event_socket.h"
#include "web/file_sender.h"
#include "web/framing.h"
#include "web/mjpeg_stream.h"

namespace flowscope::web {

namespace net = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds first_words{5}, stranger_idle{15}, known_idle{60}, write_deadline{10},
    linger{2};
constexpr std::size_t most_discarded = 1 << 20;

constexpr const char* page_policy =
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view_of(boost::beast::string_view text) { return {text.data(), text.size()}; }

std::string_view header(const RequestReader::Message& request, http::field name) {
  return view_of(request[name]);
}
std::string_view header(const RequestReader::Message& request, const char* name) {
  return view_of(request[name]);
}

Credentials credentials(const RequestReader::Message& request, const std::optional<std::string>& token,
                        bool has_body) {
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
  c.has_body = has_body;
  return c;
}

/// A redirect that holds wherever a proxy shows the page: relative to the address as the browser knows it.
Response redirect(const std::string& target) {
  Response response;
  response.status = 303;
  response.content_type = "text/html; charset=utf-8";
  response.headers.emplace_back("Location", target);
  response.headers.emplace_back("Cache-Control", "no-store");
  return response;
}

/// The token leaves the address bar. Browsers hold a strict cookie back while they follow a redirect that a
/// foreign page began, so that visitor gets a page of our own that goes on.
Response welcome(const Gate& gate, const Query& query, bool from_elsewhere) {
  std::string target = "./";
  target += query.without("token");
  Response response = redirect(target);
  if (from_elsewhere) {
    std::string quoted;
    for (const char c : target) quoted += c == '&' ? std::string("&amp;") : std::string(1, c);
    response = {};
    response.content_type = "text/html; charset=utf-8";
    response.headers.emplace_back("Cache-Control", "no-store");
    response.body = "<!doctype html><meta http-equiv=\"refresh\" content=\"0; url=" + quoted +
                    "\"><title>flowscope</title>";
  }
  response.headers.emplace_back("Set-Cookie", gate.cookie());
  return response;
}

bool comes_from_elsewhere(const Credentials& who) {
  return !who.fetch_site.empty() && who.fetch_site != "none" && who.fetch_site != "same-origin";
}

}  // namespace

HttpSession::HttpSession(net::ip::tcp::socket socket, std::shared_ptr<Context> context)
    : stream_(std::move(socket)), context_(std::move(context)) {
  ++context_->counters.connections;
}

HttpSession::~HttpSession() { --context_->counters.connections; }

void HttpSession::start(PlaceHold place) {
  place_ = std::move(place);
  error_code ignored;
  stream_.socket().set_option(net::ip::tcp::no_delay(true), ignored);
  read(first_words);
}

void HttpSession::leave() { stream_.close(); }

void HttpSession::turn_away() {
  constexpr std::string_view body =
      R"({"error":{"code":"too_many_connections","message":"all connections are taken","where":"connection"}})";
  const std::string text =
      "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nRetry-After: 1\r\nConnection: "
      "close\r\n"
      "Content-Length: " +
      std::to_string(body.size()) + "\r\n\r\n" + std::string(body);
  error_code ignored;
  stream_.socket().non_blocking(true, ignored);
  stream_.socket().write_some(net::buffer(text), ignored);
}

void HttpSession::read(std::chrono::seconds patience) {
  act_ = nullptr;
  place_->waits();
  reader_.read_head(patience, [self = shared_from_this()](error_code failure) {
    if (failure) return self->refuse_unreadable(failure);
    self->place_->works();
    self->guarded([&self] { self->admit(); });
  });
}

void HttpSession::refuse_unreadable(error_code failure) {
  const bool is_http_error = failure.category() == http::make_error_code(http::error::bad_value).category();
  if (!is_http_error || failure == http::error::end_of_stream || failure == http::error::partial_message)
    return close();
  place_->works();
  framed_ = false;
  ApiError error(400, "bad_request", "not HTTP that can be read: " + failure.message(), "request");
  if (failure == http::error::body_limit)
    error = ApiError(413, "too_large", "the body is above 256 KiB", "body");
  if (failure == http::error::header_limit)
    error = ApiError(431, "header_too_large", "the header is above 8 KiB", "request");
  refuse(error_response(error));
}

void HttpSession::guarded(const std::function<void()>& step) {
  try {
    step();
  } catch (const ApiError& error) {
    refuse(error_response(error, call_));
  } catch (const std::exception& error) {
    refuse(error_response(ApiError(500, "internal", error.what()), call_));
  }
}

void HttpSession::refuse(Response response) {
  if (!framed_ || reader_.has_body()) {
    keep_alive_ = false;
    unread_ = true;
  }
  answer(std::move(response));
}

void HttpSession::admit() {
  const RequestReader::Message& message = reader_.message();
  ++context_->counters.requests;
  framed_ = false;
  call_ = "request";
  check_framing(reader_.head());
  framed_ = true;
  keep_alive_ = message.keep_alive();
  const std::string_view target = view_of(message.target());
  call_ = std::string(view_of(message.method_string())) + " " +
          std::string(target.substr(0, std::min<std::size_t>(target.find('?'), 200)));
  const std::string_view expects = header(message, http::field::expect);
  if (!expects.empty() && !boost::beast::iequals(message[http::field::expect], "100-continue"))
    throw ApiError(417, "unknown_expectation", "only 100-continue can be expected", "Expect");

  Address address = read_address(target, context_->options.base_path);
  const auto token = address.query.get("token");
  const Credentials who = credentials(message, token, reader_.has_body());
  context_->gate.check_origin(who, address.page);
  if (address.path.empty()) {
    const std::string& base = context_->options.base_path;
    return refuse(redirect(base.substr(base.rfind('/') + 1) + "/" +
                           std::string(target.substr(std::min(target.find('?'), target.size())))));
  }
  Match match = context_->router.find(who.method, address.path);
  if (!match.route || !match.route->open) {
    context_->gate.check_token(who);
    place_->make_known();
    known_ = true;
  }
  if (address.path == "/" && !address.page)
    throw ApiError(400, "bad_parameter", "action is stream or snapshot", "action");
  Request request;
  request.method = who.method;
  request.path = std::move(address.path);
  request.query = std::move(address.query);
  request.range = header(message, http::field::range);
  choose(std::move(match), std::move(request), who);
  receive();
}

void HttpSession::choose(Match match, Request request, const Credentials& who) {
  if (!match.route) {
    const bool reads = request.method == "GET" || request.method == "HEAD";
    Response missing = error_response(ApiError(404, "not_found", "there is nothing at this address", "path"));
    if (!match.allow.empty()) {
      missing = error_response(ApiError(405, "wrong_method", "this address knows " + match.allow, "method"));
      missing.headers.emplace_back("Allow", match.allow);
    }
    act_ = [this, missing = std::move(missing), path = request.path, reads = reads && match.allow.empty()] {
      auto file = reads ? context_->page.get(path) : std::nullopt;
      answer(file ? std::move(*file) : missing);
    };
    return;
  }
  const Route& route = *match.route;
  if (!route.request.empty()) context_->gate.check_body_type(who);
  request.params = std::move(match.params);
  if (route.lane == Lane::page) {
    if (who.has_query_token && context_->gate.asks_for_token()) {
      act_ = [this, page = welcome(context_->gate, request.query, comes_from_elsewhere(who))] {
        answer(page);
      };
    } else {
      act_ = [this] { answer(context_->page.get("/").value()); };
    }
  } else if (route.lane == Lane::stream) {
    act_ = [this, view = request.query.get("view").value_or("main")] { open_stream(view); };
  } else if (route.lane == Lane::events) {
    if (who.has_body) throw ApiError(400, "bad_request", "a WebSocket begins without a body", "body");
    act_ = [this] { open_events(); };
  } else {
    act_ = [this, &route, request = std::move(request)] { run(route, request); };
  }
}

void HttpSession::receive() {
  if (!reader_.has_body()) return act_();
  reader_.read_body([self = shared_from_this()](error_code failure) {
    if (failure) return self->refuse_unreadable(failure);
    self->guarded(self->act_);
  });
}

void HttpSession::run(const Route& route, Request request) {
  const auto leaving = [] { return ApiError(503, "shutting_down", "flowscope is shutting down"); };
  if (context_->leaving) throw leaving();
  request.body = std::move(reader_.body());
  const bool posted =
      context_->pool(route.lane)
          .post([self = shared_from_this(), &route, leaving, call = call_, request = std::move(request)] {
            Response response;
            try {
              if (self->context_->leaving) throw leaving();
              response = route.handle(request);
            } catch (const ApiError& error) {
              response = error_response(error, call);
            } catch (const std::exception& error) {
              response = failure_response(error, call);
            } catch (...) {
              response = error_response(ApiError(500, "internal", "an unknown failure"), call);
            }
            net::post(self->stream_.get_executor(), [self, &route, response = std::move(response)]() mutable {
              if (response.status == 500)
                self->context_->events.publish(to_message(
                    LogEvent{"error", route.method + " " + route.pattern + " failed: " + response.body}));
              self->answer(std::move(response));
            });
          });
  if (!posted) throw ApiError(503, "busy", "too many calls wait already; try again");
}

void HttpSession::open_stream(const std::string& view) {
  if (context_->counters.streams >= context_->options.max_streams)
    throw ApiError(503, "too_many_streams",
                   "all " + std::to_string(context_->options.max_streams) +
                       " streams are taken; close one, or serve with more --max-streams");
  const bool posted = context_->quick.post([self = shared_from_this(), view] {
    std::optional<Response> refused;
    try {
      self->context_->backend.view(view);  // throws for a view that is not there
    } catch (const ApiError& error) {
      refused = error_response(error, "view");
    } catch (const std::exception& error) {
      refused = error_response(ApiError(500, "internal", error.what()), "view");
    }
    net::post(self->stream_.get_executor(), [self, view, refused = std::move(refused)]() mutable {
      if (refused) return self->answer(std::move(*refused));
      if (self->reader_.message().method() == http::verb::head) {
        Response head;
        head.content_type = "multipart/x-mixed-replace; boundary=frame";
        return self->answer(std::move(head));
      }
      std::make_shared<MjpegStream>(self->stream_.release_socket(), self->context_, std::move(self->place_),
                                    view)
          ->start();
    });
  });
  if (!posted) throw ApiError(503, "busy", "too many calls wait already; try again");
}

void HttpSession::open_events() {
  if (!boost::beast::websocket::is_upgrade(reader_.message())) {
    Response refused =
        error_response(ApiError(426, "upgrade_required", "this address speaks WebSocket", "Upgrade"));
    refused.headers.emplace_back("Upgrade", "websocket");
    return answer(std::move(refused));
  }
  if (context_->counters.sockets >= (context_->options.max_connections + 1) / 2)
    throw ApiError(503, "too_many_sockets", "half of all connections are WebSockets already; close one");
  std::make_shared<EventSocket>(stream_.release_socket(), context_, std::move(place_))
      ->start(reader_.message());
}

void HttpSession::answer(Response response) {
  if (response.status >= 500) ++context_->counters.server_errors;
  if (response.status >= 400 && response.status < 500) ++context_->counters.client_errors;
  const bool head_only = reader_.message().method() == http::verb::head;
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
  read(known_ ? known_idle : stranger_idle);
}

void HttpSession::close() {
  error_code ignored;
  stream_.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
  if (!unread_) return;
  if (place_) place_->waits();
  stream_.expires_after(linger);
  discard(most_discarded);
}

void HttpSession::discard(std::size_t left) {
  discarded_.resize(16 * 1024);
  stream_.async_read_some(net::buffer(discarded_),
                          [self = shared_from_this(), left](error_code failure, std::size_t size) {
                            if (!failure && size < left) self->discard(left - size);
                          });
}

}  // namespace flowscope::web
