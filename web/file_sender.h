// A piece of a file onto a socket, block by block.
#pragma once

#include <boost/beast/core/tcp_stream.hpp>
#include <functional>

#include "web/http.h"

namespace flowscope::web {

/// Reads 256 KiB at a time and allows each block ten seconds. `done` is called once, also when the file ends
/// early.
void send_file_slice(boost::beast::tcp_stream& stream, const FileSlice& slice,
                     std::function<void(boost::system::error_code)> done);

}  // namespace flowscope::web
