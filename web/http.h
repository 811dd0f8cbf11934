// Requests and answers as plain values: what a handler sees. No sockets, no Beast.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "web/backend.h"
#include "web/wire.h"

namespace flowscope::web {

/// Decodes %XX. Empty when an escape is broken or hides a control character.
std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space = false);
std::string percent_encode(std::string_view text);

/// The part after '?', decoded, in order.
class Query {
 public:
  Query() = default;
  /// Throws ApiError 400 for a broken escape.
  explicit Query(std::string_view text);
  /// The first value of `name`.
  std::optional<std::string> get(std::string_view name) const;
  /// A whole number in [low, high], or `fallback` when absent. Throws ApiError 400 naming the parameter.
  int integer(std::string_view name, int fallback, int low, int high) const;
  std::string without(std::string_view name) const;  ///< encoded again, "" or "?a=b"

 private:
  std::vector<std::pair<std::string, std::string>> values_;
};

struct Request {
  std::string method, path;  ///< path is decoded
  Query query;
  std::map<std::string, std::string> params;  ///< what {name} in the route's pattern stood for
  std::string body;
  std::string range;  ///< the Range header, may be empty

  const std::string& param(const std::string& name) const { return params.at(name); }
};

/// A piece of a file that follows the answer's head.
struct FileSlice {
  std::filesystem::path path;
  std::uint64_t offset = 0, length = 0;
};

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::optional<FileSlice> file;  ///< instead of body
};

/// The body as bounded JSON; an empty body is an empty object.
wire::Json body_json(const Request& request);

Response json_response(const wire::Json& json, int status = 200);
Response no_content();
/// `call` stands for the place where the error names none.
Response error_response(const ApiError& error, const std::string& call = {});
/// 507 when a file did not fit on the disk, else 500; `call` names the route.
Response failure_response(const std::exception& error, const std::string& call);
Response picture_response(const std::vector<std::uint8_t>& bytes, const std::string& content_type);

/// `bytes=first-last` of a file; the whole file without a range. 416 when the range lies outside.
Response file_response(const std::filesystem::path& path, const std::string& range);

/// By the name's ending; application/octet-stream when unknown.
std::string mime_type(const std::filesystem::path& path);

}  // namespace flowscope::web
