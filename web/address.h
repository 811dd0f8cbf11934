// What a request line asks for.
#pragma once

#include <string>
#include <string_view>

#include "web/http.h"

namespace flowscope::web {

struct Address {
  std::string path;  ///< decoded, below the server's base path; empty: the base path without its slash
  Query query;
  bool page = false;  ///< the page itself: / without an action
};

/// Paths with and without `base` (empty, or "/x/y") are both ours: some proxies cut it off, some do not.
/// mjpg-streamer's /?action=stream becomes /stream, also as OpenCV's users type it, with a second question
/// mark: ?action=stream?dummy=x.mjpg; an action that is not known keeps the path /. Throws ApiError 400.
Address read_address(std::string_view target, const std::string& base);

/// `text` as a base path: "" or "/x/y" without a slash at its end. Throws std::invalid_argument for what is
/// no plain path.
std::string checked_base_path(std::string text);

}  // namespace flowscope::web
