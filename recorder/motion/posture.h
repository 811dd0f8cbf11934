// How good a joint posture is as the end of a motion: near, away from the joints' stops and from
// singularities.
//
// Manipulability is the product of the Jacobian's singular values, sqrt(det(J J^T)): Yoshikawa,
// "Manipulability of Robotic Mechanisms", IJRR 1985, DOI 10.1177/027836498500400201.
#pragma once

#include "recorder/motion/kinematics.h"

namespace flowscope {

/// Rad; smaller is better. The largest joint's way from `near`, plus what a lack of room before a joint limit
/// and a lack of manipulability are worth. Neither lacks in the middle of the workspace.
double posture_cost(const JointVector& q, const JointVector& near, const JointLimits& limits,
                    double manipulability);

}  // namespace flowscope
