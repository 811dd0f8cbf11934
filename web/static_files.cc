#include "web/static_files.h"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace flowscope::web {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t largest_file = 16u << 20;

/// Letters, digits, - _ . per name, no name that starts with a dot: nothing can climb out, nothing hidden is
/// served.
bool is_plain(const std::string& path) {
  if (!path.starts_with('/') || path.size() > 256) return false;
  char before = 0;
  for (const char c : path) {
    const bool fits =
        std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.' || c == '/';
    if (!fits || (before == '/' && (c == '.' || c == '/'))) return false;
    before = c;
  }
  return true;
}

Response note() {
  Response response;
  response.content_type = "text/html; charset=utf-8";
  response.body =
      "<!doctype html><title>flowscope</title><p>flowscope runs, but its page is not built: build it in "
      "web/ui, "
      "or use the <a href=\"stream\">stream</a> and the <a href=\"api/v1/openapi.json\">API</a>.";
  return response;
}

}  // namespace

StaticFiles::StaticFiles(const fs::path& folder) {
  std::error_code failure;
  if (!folder.empty()) folder_ = fs::canonical(folder, failure);
}

std::optional<Response> StaticFiles::get(const std::string& path) {
  const bool index = path == "/";
  if (!index && (!is_plain(path) || folder_.empty())) return std::nullopt;
  std::error_code failure;
  const fs::path file = fs::canonical(folder_ / (index ? "index.html" : path.substr(1)), failure);
  const bool inside =
      !failure &&
      std::mismatch(folder_.begin(), folder_.end(), file.begin(), file.end()).first == folder_.end();
  if (folder_.empty() || !inside || !fs::is_regular_file(file, failure) ||
      fs::file_size(file, failure) > largest_file)
    return index ? std::optional(note()) : std::nullopt;
  Entry& entry = files_[file];
  const auto changed = fs::last_write_time(file, failure);
  if (entry.body.empty() || entry.changed != changed) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    entry = {changed, text.str()};
  }
  Response response;
  response.content_type = mime_type(file);
  response.body = entry.body;
  // The bundler puts a content hash into the names under assets/: those never change.
  const bool hashed = path.starts_with("/assets/");
  response.headers.emplace_back("Cache-Control",
                                hashed ? "private, max-age=31536000, immutable" : "no-cache");
  return response;
}

}  // namespace flowscope::web
