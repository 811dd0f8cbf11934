#include "web/http.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "render/new_file.h"

namespace flowscope::web {

namespace {

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hex_value(text[i + 1]), low = hex_value(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    } else if (c == '+' && plus_is_space) {
      c = ' ';
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return std::nullopt;
    out += c;
  }
  return out;
}

std::string percent_encode(std::string_view text) {
  static constexpr char digits[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) || c == '-' || c == '_' || c == '.' || c == '~') {
      out += c;
    } else {
      out += '%';
      out += digits[byte >> 4];
      out += digits[byte & 15];
    }
  }
  return out;
}

Query::Query(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('&'), text.size());
    const std::string_view item = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (item.empty()) continue;
    const std::size_t equals = std::min(item.find('='), item.size());
    const auto name = percent_decode(item.substr(0, equals), true);
    const auto value = percent_decode(item.substr(std::min(equals + 1, item.size())), true);
    if (!name || !value) throw ApiError(400, "bad_query", "the query holds a broken % escape", "query");
    values_.emplace_back(*name, *value);
  }
}

std::optional<std::string> Query::get(std::string_view name) const {
  for (const auto& [key, value] : values_)
    if (key == name) return value;
  return std::nullopt;
}

int Query::integer(std::string_view name, int fallback, int low, int high) const {
  const auto text = get(name);
  if (!text) return fallback;
  int value = 0;
  const char* end = text->data() + text->size();
  const auto [stop, failure] = std::from_chars(text->data(), end, value);
  if (failure != std::errc{} || stop != end || value < low || value > high)
    throw ApiError(400, "bad_parameter",
                   "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high),
                   std::string(name));
  return value;
}

std::string Query::without(std::string_view name) const {
  std::string out;
  for (const auto& [key, value] : values_)
    if (key != name) out += (out.empty() ? "?" : "&") + percent_encode(key) + "=" + percent_encode(value);
  return out;
}

wire::Json body_json(const Request& request) {
  return wire::parse_body(request.body.empty() ? "{}" : request.body);
}

Response json_response(const wire::Json& json, int status) {
  Response response;
  response.status = status;
  response.body = wire::dump(json);
  return response;
}

Response no_content() {
  Response response;
  response.status = 204;
  response.content_type.clear();
  return response;
}

Response error_response(const ApiError& error, const std::string& call) {
  const std::string& where = error.where.empty() ? call : error.where;
  return json_response(wire::error_json(error.code, error.what(), where), error.status);
}

Response failure_response(const std::exception& error, const std::string& where) {
  if (is_full_disk(error)) return error_response(ApiError(507, "disk_full", error.what(), where));
  return error_response(ApiError(500, "internal", error.what(), where));
}

Response picture_response(const std::vector<std::uint8_t>& bytes, const std::string& content_type) {
  Response response;
  response.content_type = content_type;
  response.body.assign(bytes.begin(), bytes.end());
  return response;
}

namespace {

/// first-last, first- or -suffix, as RFC 9110 has them; a form that is not one of these is ignored (empty).
std::optional<std::pair<std::uint64_t, std::uint64_t>> parse_range(std::string_view text,
                                                                   std::uint64_t size) {
  constexpr std::string_view unit = "bytes=";
  if (!text.starts_with(unit) || text.find(',') != text.npos) return std::nullopt;
  text.remove_prefix(unit.size());
  const std::size_t dash = text.find('-');
  if (dash == text.npos) return std::nullopt;
  const auto number = [](std::string_view digits) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [stop, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (digits.empty() || failure != std::errc{} || stop != digits.data() + digits.size())
      return std::nullopt;
    return value;
  };
  const auto first = number(text.substr(0, dash)), last = number(text.substr(dash + 1));
  if (!first && !last) return std::nullopt;
  if (!first) return std::pair{size > *last ? size - *last : 0, size};
  return std::pair{*first, last ? std::min(*last, UINT64_MAX - 1) + 1 : size};
}

}  // namespace

Response file_response(const std::filesystem::path& path, const std::string& range) {
  std::error_code failure;
  const std::uint64_t size = std::filesystem::file_size(path, failure);
  if (failure) throw ApiError(404, "not_found", "there is no such file", path.filename().string());
  Response response;
  response.content_type = mime_type(path);
  response.headers.emplace_back("Accept-Ranges", "bytes");
  response.headers.emplace_back("Content-Disposition",
                                "inline; filename=\"" + path.filename().string() + "\"");
  const auto wanted = parse_range(range, size);
  if (!wanted) {
    response.file = FileSlice{path, 0, size};
    return response;
  }
  const std::uint64_t first = wanted->first, end = std::min(wanted->second, size);
  if (first >= end) {
    Response refused = error_response(ApiError(416, "bad_range", "the range lies outside the file", "Range"));
    refused.headers.emplace_back("Content-Range", "bytes */" + std::to_string(size));
    return refused;
  }
  response.status = 206;
  response.headers.emplace_back("Content-Range", "bytes " + std::to_string(first) + "-" +
                                                     std::to_string(end - 1) + "/" + std::to_string(size));
  response.file = FileSlice{path, first, end - first};
  return response;
}

std::string mime_type(const std::filesystem::path& path) {
  static const std::map<std::string, std::string> types{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".ico", "image/x-icon"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".webmanifest", "application/manifest+json"},
      {".txt", "text/plain; charset=utf-8"},
      {".woff2", "font/woff2"},
      {".mp4", "video/mp4"},
      {".gltf", "model/gltf+json"},
      {".glb", "model/gltf-binary"},
      {".zip", "application/zip"},
      {".pdf", "application/pdf"},
  };
  const auto found = types.find(path.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

}  // namespace flowscope::web
