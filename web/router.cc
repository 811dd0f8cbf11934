#include "web/router.h"

#include <algorithm>

namespace flowscope::web {

namespace {

std::vector<std::string_view> segments(std::string_view path) {
  std::vector<std::string_view> parts;
  while (!path.empty()) {
    path.remove_prefix(1);  // the slash
    const std::size_t end = std::min(path.find('/'), path.size());
    parts.push_back(path.substr(0, end));
    path.remove_prefix(end);
  }
  return parts;
}

/// {file} may hold dots inside, every other name is an id; neither can leave its folder.
bool is_name(std::string_view text, bool file) {
  const auto fits = [file](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || (file && c == '.');
  };
  return !text.empty() && text.size() <= (file ? 128u : 64u) && text.front() != '.' &&
         std::all_of(text.begin(), text.end(), fits);
}

bool matches(const std::string& pattern, const std::vector<std::string_view>& path,
             std::map<std::string, std::string>& params) {
  const auto wanted = segments(pattern);
  if (wanted.size() != path.size()) return false;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (wanted[i].starts_with('{')) {
      const std::string name(wanted[i].substr(1, wanted[i].size() - 2));
      if (!is_name(path[i], name == "file")) return false;
      params[name] = path[i];
    } else if (wanted[i] != path[i]) {
      return false;
    }
  }
  return true;
}

}  // namespace

Match Router::find(std::string_view method, std::string_view path) const {
  Match match;
  if (!path.starts_with('/')) return match;
  const auto parts = segments(path);
  const std::string_view wanted = method == "HEAD" ? "GET" : method;
  for (const Route& route : routes_) {
    std::map<std::string, std::string> params;
    if (!matches(route.pattern, parts, params)) continue;
    if (route.method == wanted) return {&route, std::move(params), {}};
    match.allow += (match.allow.empty() ? "" : ", ") + route.method + (route.method == "GET" ? ", HEAD" : "");
  }
  return match;
}

}  // namespace flowscope::web
