#include <nlohmann/json.hpp>
#include <set>

#include "web/wire.h"

namespace flowscope::web::wire {

namespace {

constexpr std::size_t largest_body = 256 * 1024;
constexpr int deepest = 32;
constexpr std::size_t most_keys = 1000;

/// Refuses while parsing: copying or printing a deep document would recurse once per level.
class Bounds {
 public:
  bool operator()(int depth, Json::parse_event_t event, const Json& value) {
    if (event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start) {
      if (depth >= deepest)
        throw ApiError(400, "too_deep", "nested deeper than " + std::to_string(deepest) + " levels", "body");
      keys_.emplace_back();
    } else if (event == Json::parse_event_t::object_end || event == Json::parse_event_t::array_end) {
      keys_.pop_back();
    } else if (event == Json::parse_event_t::key) {
      const auto& name = value.get_ref<const std::string&>();
      if (++count_ > most_keys)
        throw ApiError(400, "too_many_keys", "more than " + std::to_string(most_keys) + " keys", "body");
      if (!keys_.back().insert(name).second)
        throw ApiError(400, "duplicate_key", "key " + name.substr(0, 64) + " appears twice",
                       name.substr(0, 64));
    }
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
  std::size_t count_ = 0;
};

/// "line 3, column 7" out of the parser's message; the byte offset says it for one-line bodies.
std::string line_and_column(const std::string& text, std::size_t byte) {
  std::size_t line = 1, column = 1;
  for (std::size_t i = 0; i + 1 < byte && i < text.size(); ++i) {
    column = text[i] == '\n' ? 1 : column + 1;
    line += text[i] == '\n';
  }
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

}  // namespace

Json parse_body(const std::string& text) {
  if (text.size() > largest_body) throw ApiError(413, "too_large", "more than 256 KiB of JSON", "body");
  Bounds bounds;
  const auto check = [&bounds](int depth, Json::parse_event_t event, Json& value) {
    return bounds(depth, event, value);
  };
  try {
    return Json::parse(text, check);
  } catch (const Json::parse_error& error) {
    throw ApiError(400, "bad_json", "not JSON: " + std::string(error.what()),
                   line_and_column(text, error.byte));
  } catch (const Json::exception& error) {
    throw ApiError(400, "bad_json", "not usable JSON: " + std::string(error.what()), "body");
  }
}

}  // namespace flowscope::web::wire
