#include <nlohmann/json.hpp>
#include <set>

#include "web/json_bounds.h"
#include "web/wire.h"

namespace flowscope::web::wire {

namespace {

constexpr std::size_t largest_body = 256 * 1024, longest_message = 200;

/// Of two values of one key the parser would keep one and say nothing.
class NoKeyTwice {
 public:
  bool operator()(Json::parse_event_t event, const Json& value) {
    if (event == Json::parse_event_t::object_start) {
      keys_.emplace_back();
    } else if (event == Json::parse_event_t::object_end) {
      keys_.pop_back();
    } else if (event == Json::parse_event_t::key) {
      const auto& name = value.get_ref<const std::string&>();
      if (!keys_.back().insert(name).second)
        throw ApiError(400, "duplicate_key", "key " + name.substr(0, 64) + " appears twice",
                       name.substr(0, 64));
    }
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
};

/// The parser repeats what it read last, however long that is.
std::string cut(const std::string& message) {
  return message.size() <= longest_message ? message : message.substr(0, longest_message) + " …";
}

}  // namespace

Json parse_body(const std::string& text) {
  if (text.size() > largest_body) throw ApiError(413, "too_large", "more than 256 KiB of JSON", "body");
  check_json_bounds(text);
  NoKeyTwice keys;
  const auto check = [&keys](int, Json::parse_event_t event, Json& value) { return keys(event, value); };
  try {
    return Json::parse(text, check);
  } catch (const Json::parse_error& error) {
    throw ApiError(400, "bad_json", "not JSON: " + cut(error.what()),
                   line_and_column(text, error.byte > 0 ? error.byte - 1 : 0));
  } catch (const Json::exception& error) {
    throw ApiError(400, "bad_json", "not usable JSON: " + cut(error.what()), "body");
  }
}

}  // namespace flowscope::web::wire
