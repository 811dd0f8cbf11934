// Reads a JSON object key by key; every complaint names the key, and keys that nobody asked for are refused.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "web/wire.h"

namespace flowscope::web::wire {

/// A view of one JSON object (it must outlive the view). All readers throw ApiError 400 with the key's path.
class Fields {
 public:
  explicit Fields(const Json& json, std::string path = {});

  bool has(const std::string& key);  ///< present and not null
  const Json& at(const std::string& key);
  const Json* find(const std::string& key);  ///< null when absent; marks the key as known

  double number(const std::string& key);  ///< finite
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high);
  std::uint64_t seed(const std::string& key);  ///< 0 … 2^64 - 1
  bool boolean(const std::string& key);
  std::string text(const std::string& key, std::size_t longest = 256);
  std::string one_of(const std::string& key, const std::vector<std::string>& allowed);
  std::vector<double> numbers(const std::string& key, std::size_t count);
  std::vector<std::string> texts(const std::string& key);
  Eigen::Vector3d vector3(const std::string& key);
  Eigen::Quaterniond quaternion(const std::string& key);  ///< w,x,y,z; of length 1 within 1e-3, kept as given
  Fields object(const std::string& key);

  /// Refuses keys that no reader asked for.
  void finish() const;
  std::string place(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;

 private:
  const Json* json_;
  std::string path_;
  std::set<std::string> known_;
};

}  // namespace flowscope::web::wire
