// The Panda in closed form, from its base to its flange.
//
// Inverse: the seventh joint is the free parameter. With q7 given the wrist frame follows from the flange's
// pose, the shoulder, elbow and wrist centre form a triangle of known sides, and the rest is plane geometry:
// at most eight solutions. The idea of q7 as parameter is that of He & Liu, "Analytical Inverse Kinematics
// for Franka Emika Panda", ICCMA 2021, DOI 10.1109/ICCMA54375.2021.9646185.
#pragma once

#include <array>

#include "recorder/motion/kinematics.h"

namespace flowscope {

inline constexpr double panda_shoulder_m = 0.333;  ///< above the base: where the first two joints' axes meet

Pose panda_base_from_flange(const JointVector& q);

/// sqrt(det(J J^T)) of the tool's geometric Jacobian, m^3.
double panda_manipulability(const JointVector& q, const Pose& flange_from_tool);

/// False: no q7 and no posture reaches it, whatever the joint limits. True may still be none.
bool panda_in_reach(const Pose& base_from_flange);

struct PandaSolutions {
  std::array<JointVector, 8> q;
  int count = 0;
};
/// All postures with this q7 within the limits, in a fixed order.
PandaSolutions solve_panda(const Pose& base_from_flange, double q7, const JointLimits& limits);

}  // namespace flowscope
