#include "web/request_reader.h"

#include <algorithm>
#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <memory>

namespace flowscope::web {

namespace net = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds head_deadline{10}, body_deadline{10};
constexpr std::uint32_t head_limit = 8 * 1024;
constexpr std::uint64_t body_limit = 256 * 1024;
constexpr std::size_t most_extension_bytes = 1024, block_bytes = 4096;
constexpr std::string_view go_on = "HTTP/1.1 100 Continue\r\n\r\n";

}  // namespace

void RequestReader::read_head(std::chrono::seconds patience, Done done) {
  parser_.emplace();
  parser_->header_limit(head_limit);
  parser_->body_limit(body_limit);
  head_.clear();
  begun_ = buffer_.size() > 0;
  if (begun_) {  // a client need not wait for an answer before it asks again
    stream_.expires_after(head_deadline);
    return parse_head(std::move(done));
  }
  stream_.expires_after(patience);
  await_head(std::move(done));
}

void RequestReader::await_head(Done done) {
  stream_.async_read_some(buffer_.prepare(block_bytes),
                          [this, done = std::move(done)](error_code failure, std::size_t size) mutable {
                            if (failure) return done(failure);
                            buffer_.commit(size);
                            if (!begun_) stream_.expires_after(head_deadline);
                            begun_ = true;
                            parse_head(std::move(done));
                          });
}

void RequestReader::parse_head(Done done) {
  const auto bytes = buffer_.data();
  error_code failure;
  const std::size_t used = parser_->put(bytes, failure);
  head_.append(static_cast<const char*>(bytes.data()), used);
  buffer_.consume(used);
  if (failure == http::error::need_more) failure = {};
  if (failure) return done(failure);
  if (!parser_->is_header_done()) return await_head(std::move(done));
  stream_.expires_never();
  done({});
}

void RequestReader::read_body(Done done) {
  stream_.expires_after(body_deadline);
  const bool waits = message().version() >= 11 && message().count(http::field::expect) > 0;
  if (!waits || buffer_.size() > 0) return receive_body(std::move(done));
  net::async_write(stream_, net::buffer(go_on.data(), go_on.size()),
                   [this, done = std::move(done)](error_code failure, std::size_t) mutable {
                     if (failure) return done(failure);
                     receive_body(std::move(done));
                   });
}

void RequestReader::receive_body(Done done) {
  auto left = std::make_shared<std::size_t>(most_extension_bytes);
  chunk_head_ = [left](std::uint64_t, boost::beast::string_view extension, error_code& failure) {
    if (extension.size() > *left) failure = http::error::bad_chunk_extension;
    *left -= std::min(*left, extension.size());
  };
  parser_->on_chunk_header(chunk_head_);
  http::async_read(stream_, buffer_, *parser_,
                   [this, done = std::move(done)](error_code failure, std::size_t) {
                     if (!failure) stream_.expires_never();
                     done(failure);
                   });
}

}  // namespace flowscope::web
