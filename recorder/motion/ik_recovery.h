// What the inverse kinematics recovers of postures whose tool pose it is given.
#pragma once

#include <cstdint>

#include "recorder/motion/kinematics.h"

namespace flowscope {

/// Uniform within the limits; the same for the same seed and index on every machine.
JointVector random_posture(const JointLimits& limits, std::uint64_t seed, std::uint64_t index);

struct IkRecovery {
  int postures = 0;
  int recovered = 0;  ///< solve_all from elsewhere found a posture, and all it found have the pose
  int own = 0;        ///< solve at the posture's own q7 has it among its branches, within 1e-6 rad
  double largest_m = 0, largest_rad = 0;  ///< pose error of any solution
};

/// `count` random postures: each one's tool pose is solved from another random posture, and at its own q7.
IkRecovery recover_postures(const Kinematics& arm, int count, std::uint64_t seed);

}  // namespace flowscope
