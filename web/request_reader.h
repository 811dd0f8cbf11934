// Reads one request after the other from a connection: first the head, then, when somebody wants it, the
// body. I/O thread only.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace flowscope::web {

/// `done` callbacks keep alive what owns the reader and the stream. The stream's deadline is the reader's
/// while it reads.
class RequestReader {
 public:
  using Done = std::function<void(boost::system::error_code)>;
  using Message = boost::beast::http::request<boost::beast::http::string_body>;

  explicit RequestReader(boost::beast::tcp_stream& stream) : stream_(stream) {}

  /// Waits `patience` for the first byte and ten seconds more for the whole head, at most 8 KiB.
  void read_head(std::chrono::seconds patience, Done done);
  /// The rest: at most 256 KiB within ten seconds; chunk extensions may take 1 KiB in all. Tells a client
  /// that waits for leave (Expect: 100-continue) to go on.
  void read_body(Done done);

  bool has_body() const { return parser_ && parser_->is_header_done() && !parser_->is_done(); }
  const Message& message() const { return parser_->get(); }
  std::string& body() { return parser_->get().body(); }
  std::string_view head() const { return head_; }  ///< as it arrived

 private:
  void await_head(Done done);
  void parse_head(Done done);
  void receive_body(Done done);

  boost::beast::tcp_stream& stream_;
  boost::beast::flat_buffer buffer_{16 * 1024};
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  std::function<void(std::uint64_t, boost::beast::string_view, boost::system::error_code&)> chunk_head_;
  std::string head_;
  bool begun_ = false;  ///< the first byte of this request is here
};

}  // namespace flowscope::web
