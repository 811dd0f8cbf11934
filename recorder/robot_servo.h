// An actuator of a scene as a position servo: a spring to where its input says, with damping.
#pragma once

#include <string>

struct mjModel_;

namespace flowscope {

/// Force = stiffness * (length_of(input) - length) - damping * speed, all in the units of what the actuator
/// moves (a joint's rad or m, a tendon's m), times its gear.
struct PositionServo {
  double gain = 0, offset = 0, stiffness = 0, damping = 0;
  double length_of(double input) const { return (gain * input + offset) / stiffness; }
  double input_for(double length) const { return (stiffness * length - offset) / gain; }
  /// Its input is the length itself.
  bool takes_lengths() const;
};

/// What the input of an actuator that is no position servo is instead ("is a motor: its input is a force");
/// empty: it is one.
std::string other_than_servo(const mjModel_* model, int actuator);
/// Only for what other_than_servo has found to be one.
PositionServo position_servo(const mjModel_* model, int actuator);

/// What the actuator acts on: "j2", "tendon split", "site grip".
std::string moved_by(const mjModel_* model, int actuator);

}  // namespace flowscope
