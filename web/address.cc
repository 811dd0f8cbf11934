#include "web/address.h"

#include <algorithm>
#include <stdexcept>

namespace flowscope::web {

namespace {

bool has_action(std::string_view query) {
  constexpr std::string_view action = "action=";
  for (std::size_t at = query.find(action); at != query.npos; at = query.find(action, at + 1))
    if (at == 0 || query[at - 1] == '&' || query[at - 1] == '?') return true;
  return false;
}

}  // namespace

Address read_address(std::string_view target, const std::string& base) {
  const std::size_t mark = std::min(target.find('?'), target.size());
  const auto path = percent_decode(target.substr(0, mark));
  if (!path || !path->starts_with('/'))
    throw ApiError(400, "bad_request", "the address cannot be read", "path");
  Address address;
  address.path = *path;
  const bool below = address.path.starts_with(base) &&
                     (address.path.size() == base.size() || address.path[base.size()] == '/');
  if (below) address.path.erase(0, base.size());

  std::string query(target.substr(std::min(mark + 1, target.size())));
  const bool root = address.path == "/";
  if (root && has_action(query)) std::replace(query.begin(), query.end(), '?', '&');
  address.query = Query(query);
  if (!root) return address;
  const auto action = address.query.get("action");
  address.page = !action;
  if (!action) return address;
  const std::string wanted = action->substr(0, action->find('?'));  // it may have come as %3F
  if (wanted == "stream" || wanted == "snapshot") address.path = "/" + wanted;
  return address;
}

std::string checked_base_path(std::string text) {
  while (text.ends_with('/')) text.pop_back();
  char before = 0;
  for (const char c : text) {
    const bool fits = std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.' ||
                      c == '~' || c == '/';
    if (!fits || (before == '/' && (c == '/' || c == '.')))
      throw std::invalid_argument(
          "a base path is like /proxy/8080: letters, digits, - _ . ~ between slashes");
    before = c;
  }
  if (!text.empty() && !text.starts_with('/')) text.insert(text.begin(), '/');
  return text;
}

}  // namespace flowscope::web
