#include "recorder/robot_servo.h"

#include <mujoco/mujoco.h>

#include <cmath>

#include "recorder/robot_names.h"

namespace flowscope {

bool PositionServo::takes_lengths() const {
  return std::abs(gain - stiffness) <= 1e-6 * stiffness && std::abs(offset) <= 1e-6 * stiffness;
}

std::string other_than_servo(const mjModel* model, int actuator) {
  const mjtNum* gain = model->actuator_gainprm + mjNGAIN * actuator;
  const mjtNum* bias = model->actuator_biasprm + mjNBIAS * actuator;
  const int gain_type = model->actuator_gaintype[actuator], bias_type = model->actuator_biastype[actuator];
  switch (model->actuator_dyntype[actuator]) {
    case mjDYN_NONE:
      break;
    case mjDYN_INTEGRATOR:
      return "adds its input up over time: that is a speed, not a position";
    case mjDYN_MUSCLE:
      return "is a muscle: its input is an activation";
    default:
      return "follows its input with a delay (a dyntype of its own)";
  }
  if (gain_type == mjGAIN_MUSCLE || bias_type == mjBIAS_MUSCLE)
    return "is a muscle: its input is an activation";
  const bool plain = gain_type == mjGAIN_FIXED && (bias_type == mjBIAS_NONE || bias_type == mjBIAS_AFFINE);
  if (!plain) return "has a gain or bias that changes with its position, so that its input is not a position";
  const double spring = bias_type == mjBIAS_AFFINE ? bias[1] : 0,
               brake = bias_type == mjBIAS_AFFINE ? bias[2] : 0;
  if (spring > 0 || brake > 0) return "pushes away from where it should go (positive biasprm)";
  if (spring == 0 && brake < 0) return "is a velocity servo: its input is a speed";
  if (spring == 0) return "is a motor: its input is a force";
  if (gain[0] == 0) return "does not heed its input (gainprm 0)";
  return "";
}

PositionServo position_servo(const mjModel* model, int actuator) {
  const mjtNum* bias = model->actuator_biasprm + mjNBIAS * actuator;
  return {model->actuator_gainprm[mjNGAIN * actuator], bias[0], -bias[1], -bias[2]};
}

std::string moved_by(const mjModel* model, int actuator) {
  const int id = model->actuator_trnid[2 * actuator];
  switch (model->actuator_trntype[actuator]) {
    case mjTRN_JOINT:
    case mjTRN_JOINTINPARENT:
      return name_of(model, mjOBJ_JOINT, id);
    case mjTRN_TENDON:
      return "tendon " + name_of(model, mjOBJ_TENDON, id);
    case mjTRN_SITE:
    case mjTRN_SLIDERCRANK:
      return "site " + name_of(model, mjOBJ_SITE, id);
    case mjTRN_BODY:
      return "body " + name_of(model, mjOBJ_BODY, id);
    default:
      return "nothing";
  }
}

}  // namespace flowscope
