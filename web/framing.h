// Where a request ends. Stricter than the parser: a proxy in front that reads a loose form otherwise would
// see two requests where we see one.
#pragma once

#include <string_view>

namespace flowscope::web {

/// `head` is the request line and the headers as they arrived, with the empty line. Throws ApiError 400
/// naming the header for: a header that goes on in a second line; one that says twice who asks or how much
/// follows; a Content-Length that is not plain digits; a Transfer-Encoding that is not exactly `chunked`, or
/// comes with HTTP/1.0 or with a Content-Length; a missing Host. After that nobody knows where the next
/// request begins: the connection has to be closed.
void check_framing(std::string_view head);

}  // namespace flowscope::web
