#include "web/file_sender.h"

#include <algorithm>
#include <boost/asio/write.hpp>
#include <chrono>
#include <fstream>
#include <memory>
#include <vector>

namespace flowscope::web {

namespace {

using boost::system::error_code;
constexpr std::uint64_t block_bytes = 256 * 1024;

class FileSender : public std::enable_shared_from_this<FileSender> {
 public:
  FileSender(boost::beast::tcp_stream& stream, const FileSlice& slice, std::function<void(error_code)> done)
      : stream_(stream), file_(slice.path, std::ios::binary), left_(slice.length), done_(std::move(done)) {
    file_.seekg(static_cast<std::streamoff>(slice.offset));
  }

  void send() {
    if (left_ == 0) return done_({});
    block_.resize(std::min(left_, block_bytes));
    file_.read(block_.data(), static_cast<std::streamsize>(block_.size()));
    if (file_.gcount() != static_cast<std::streamsize>(block_.size()))
      return done_(make_error_code(boost::system::errc::io_error));  // the promised length cannot be kept
    left_ -= block_.size();
    stream_.expires_after(std::chrono::seconds(10));
    boost::asio::async_write(stream_, boost::asio::buffer(block_),
                             [self = shared_from_this()](error_code failure, std::size_t) {
                               if (failure) return self->done_(failure);
                               self->send();
                             });
  }

 private:
  boost::beast::tcp_stream& stream_;  // kept alive by done_
  std::ifstream file_;
  std::uint64_t left_;
  std::function<void(error_code)> done_;
  std::vector<char> block_;
};

}  // namespace

void send_file_slice(boost::beast::tcp_stream& stream, const FileSlice& slice,
                     std::function<void(error_code)> done) {
  std::make_shared<FileSender>(stream, slice, std::move(done))->send();
}

}  // namespace flowscope::web
