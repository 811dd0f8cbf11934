#include "web/fields.h"

#include <cmath>

namespace flowscope::web::wire {

Fields::Fields(const Json& json, std::string path) : json_(&json), path_(std::move(path)) {
  if (!json.is_object())
    throw ApiError(400, "bad_value", "must be an object", path_.empty() ? "body" : path_);
}

void Fields::fail(const std::string& key, const std::string& message) const {
  throw ApiError(400, "bad_value", place(key) + " " + message, place(key));
}

const Json* Fields::find(const std::string& key) {
  known_.insert(key);
  const auto found = json_->find(key);
  return found == json_->end() ? nullptr : &*found;
}

bool Fields::has(const std::string& key) {
  const Json* value = find(key);
  return value && !value->is_null();
}

const Json& Fields::at(const std::string& key) {
  const Json* value = find(key);
  if (!value) fail(key, "is missing");
  return *value;
}

double Fields::number(const std::string& key) {
  const Json& value = at(key);
  if (!value.is_number() || !std::isfinite(value.get<double>())) fail(key, "must be a number");
  return value.get<double>();
}

std::int64_t Fields::integer(const std::string& key, std::int64_t low, std::int64_t high) {
  const double value = number(key);  // exact up to 2^53, and every limit lies below that
  if (value != std::floor(value) || value < static_cast<double>(low) || value > static_cast<double>(high))
    fail(key, "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  return static_cast<std::int64_t>(value);
}

std::uint64_t Fields::seed(const std::string& key) {
  const Json& value = at(key);
  if (value.is_number_unsigned()) return value.get<std::uint64_t>();
  return static_cast<std::uint64_t>(integer(key, 0, std::int64_t{1} << 53));
}

bool Fields::boolean(const std::string& key) {
  const Json& value = at(key);
  if (!value.is_boolean()) fail(key, "must be true or false");
  return value.get<bool>();
}

std::string Fields::text(const std::string& key, std::size_t longest) {
  const Json& value = at(key);
  if (!value.is_string()) fail(key, "must be a text");
  std::string text = value.get<std::string>();
  if (text.size() > longest) fail(key, "is longer than " + std::to_string(longest) + " bytes");
  return text;
}

std::string Fields::one_of(const std::string& key, const std::vector<std::string>& allowed) {
  std::string value = text(key);
  std::string names;
  for (const std::string& name : allowed) {
    if (name == value) return value;
    names += (names.empty() ? "" : ", ") + name;
  }
  fail(key, "must be one of " + names);
}

std::vector<double> Fields::numbers(const std::string& key, std::size_t count) {
  const Json& value = at(key);
  if (!value.is_array() || value.size() != count)
    fail(key, "must hold " + std::to_string(count) + " numbers");
  std::vector<double> numbers;
  for (const Json& item : value) {
    if (!item.is_number() || !std::isfinite(item.get<double>())) fail(key, "must hold finite numbers");
    numbers.push_back(item.get<double>());
  }
  return numbers;
}

std::vector<std::string> Fields::texts(const std::string& key) {
  const Json& value = at(key);
  if (!value.is_array()) fail(key, "must be a list of texts");
  std::vector<std::string> texts;
  for (const Json& item : value) {
    if (!item.is_string()) fail(key, "must be a list of texts");
    texts.push_back(item.get<std::string>());
  }
  return texts;
}

Eigen::Vector3d Fields::vector3(const std::string& key) {
  const auto v = numbers(key, 3);
  return {v[0], v[1], v[2]};
}

Eigen::Quaterniond Fields::quaternion(const std::string& key) {
  const auto v = numbers(key, 4);
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  if (std::abs(q.norm() - 1) > 1e-3) fail(key, "must be a unit quaternion w,x,y,z");
  return q;
}

Fields Fields::object(const std::string& key) { return Fields(at(key), place(key)); }

void Fields::finish() const {
  for (const auto& item : json_->items()) {
    if (known_.contains(item.key())) continue;
    std::string names;
    for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
    throw ApiError(400, "unknown_key",
                   "unknown key " + item.key().substr(0, 64) +
                       (names.empty() ? "; this takes none" : "; known are " + names),
                   place(item.key().substr(0, 64)));
  }
}

}  // namespace flowscope::web::wire
