#include "recorder/motion/ik_recovery.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace flowscope {

JointVector random_posture(const JointLimits& limits, std::uint64_t seed, std::uint64_t index) {
  std::mt19937_64 random(seed * 1'000'003 + index);
  JointVector q{};
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i] = std::lerp(limits.lower[i], limits.upper[i], double(random() >> 11) * 0x1.0p-53);
  }
  return q;
}

IkRecovery recover_postures(const Kinematics& arm, int count, std::uint64_t seed) {
  constexpr double same = 1e-6;  // metres and rad
  IkRecovery sum;
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    const JointVector q = random_posture(arm.limits(), seed, 2 * index);
    const Pose wanted = arm.world_from_tool(q);
    const auto found = arm.solve_all(wanted, random_posture(arm.limits(), seed, 2 * index + 1));
    bool good = !found.empty();
    for (const JointVector& s : found) {
      const Pose reached = arm.world_from_tool(s);
      const double off_m = position_error_m(reached, wanted), off_rad = rotation_error_rad(reached, wanted);
      sum.largest_m = std::max(sum.largest_m, off_m);
      sum.largest_rad = std::max(sum.largest_rad, off_rad);
      good = good && off_m < same && off_rad < same && arm.limits().contain(s);
    }
    const auto branches = arm.solve(wanted, q[6]);
    sum.own += std::ranges::any_of(branches, [&](const auto& s) { return joint_distance(s, q) < same; });
    sum.recovered += good;
    ++sum.postures;
  }
  return sum;
}

}  // namespace flowscope
