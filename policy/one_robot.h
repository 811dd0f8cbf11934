// A policy reads joint angles, so it knows the joints of one robot.
#pragma once

#include <stdexcept>
#include <string>

namespace flowscope {

/// Throws std::invalid_argument that names both. An empty name is not known, and fits every other.
inline void require_same_robot(const std::string& learnt, const std::string& shown) {
  if (learnt.empty() || shown.empty() || learnt == shown) return;
  throw std::invalid_argument("the policy has learnt the robot " + learnt + ", and this is " + shown);
}

}  // namespace flowscope
