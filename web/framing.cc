#include "web/framing.h"

#include <algorithm>
#include <array>
#include <string>

#include "web/backend.h"

namespace flowscope::web {

namespace {

constexpr std::string_view end_of_line = "\r\n";
constexpr std::array<std::string_view, 8> once{"host",          "content-length", "transfer-encoding",
                                               "authorization", "origin",         "content-type",
                                               "expect",        "upgrade"};
constexpr std::size_t most_digits = 18;  ///< of a length that 64 bits can hold

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

[[noreturn]] void refuse(const std::string& message, std::string_view name) {
  throw ApiError(400, "bad_request", message, std::string(name.substr(0, 64)));
}

void check_length(std::string_view value, std::string_view name) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (value.empty() || value.size() > most_digits || !std::all_of(value.begin(), value.end(), is_digit))
    refuse("Content-Length must be one plain number", name);
}

}  // namespace

void check_framing(std::string_view head) {
  std::array<int, once.size()> times{};
  const auto count = [&](std::string_view name) {
    return times[static_cast<std::size_t>(std::find(once.begin(), once.end(), name) - once.begin())];
  };
  const std::size_t first = std::min(head.find(end_of_line), head.size());
  const bool old = !head.substr(0, first).ends_with("HTTP/1.1");
  head.remove_prefix(std::min(first + end_of_line.size(), head.size()));
  std::string_view name;
  while (!head.empty() && !head.starts_with(end_of_line)) {
    const std::size_t end = std::min(head.find(end_of_line), head.size());
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(end + end_of_line.size(), head.size()));
    if (is_blank(line.front())) refuse("a header goes on in a second line", name);
    const std::size_t colon = std::min(line.find(':'), line.size());
    name = line.substr(0, colon);
    const std::string_view value = trimmed(line.substr(std::min(colon + 1, line.size())));
    const std::string known = lower(name);
    const auto* place = std::find(once.begin(), once.end(), known);
    if (place != once.end() && ++times[static_cast<std::size_t>(place - once.begin())] > 1)
      refuse("a header appears twice", name);
    if (known == "content-length") check_length(value, name);
    if (known == "transfer-encoding" && (old || value != "chunked"))
      refuse("Transfer-Encoding must be exactly chunked, with HTTP/1.1", name);
  }
  if (count("content-length") && count("transfer-encoding"))
    refuse("both Content-Length and Transfer-Encoding", "Transfer-Encoding");
  if (!count("host")) refuse("Host is missing", "Host");
}

}  // namespace flowscope::web
