#include "recorder/gripper_check.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "recorder/gripper_holds.h"
#include "recorder/gripper_scene.h"
#include "recorder/robot_names.h"
#include "recorder/robot_servo.h"

namespace flowscope {
namespace {

constexpr double kWidest_m = 1, kWidest_rad = 2 * std::numbers::pi;  ///< a finger's way
constexpr double kPart = 0.1;      ///< of a finger's way: by how much inputs may miss its ends
constexpr double kPressing = 0.5;  ///< of its way: how far inputs may reach beyond it
constexpr double kNarrower_m = 0.001;
constexpr double kAtRange = 0.01;  ///< of its range: limits give by as much

/// What each finger says of itself.
class FingerCheck {
 public:
  explicit FingerCheck(GripperScene& scene) : scene_(scene) {}

  void run() {
    const std::size_t fingers = scene_.robot.fingers.size();
    for (std::size_t i = 0; i < fingers; ++i) {
      find_joint(i);
      check_range(i);
    }
    for (std::size_t i = 0; i < fingers; ++i) find_actuator(i);
    for (std::size_t i = 0; i < fingers; ++i) {
      if (scene_.actuators[i] >= 0) check_inputs(i);
    }
    check_opening();
  }

 private:
  void find_joint(std::size_t i) {
    const std::string& name = scene_.robot.fingers[i].joint;
    const int joint =
        find_named(scene_.model, mjOBJ_JOINT, name, scene_.robot, "fingers[" + std::to_string(i) + "].joint");
    if (scene_.model->jnt_type[joint] != mjJNT_SLIDE && scene_.model->jnt_type[joint] != mjJNT_HINGE) {
      scene_.fail(i, ".joint",
                  "joint '" + name + "' is neither a slide nor a hinge: it can not be a finger's");
    }
    if (!scene_.is_below(scene_.model->jnt_bodyid[joint], scene_.model->jnt_bodyid[scene_.arm.back()])) {
      scene_.fail(i, ".joint",
                  "finger '" + name + "' does not hang below " + scene_.joint_name(scene_.arm.back()) +
                      ", the last joint of the arm");
    }
    scene_.joints.push_back(joint);
  }

  void check_range(std::size_t i) const {
    const FingerDescription& finger = scene_.robot.fingers[i];
    const bool slide = scene_.model->jnt_type[scene_.joints[i]] == mjJNT_SLIDE;
    const double smaller = slide ? 1e-3 : std::numbers::pi / 180;
    const char* other_unit = slide ? ": mm?" : ": degrees?";
    if (!scene_.model->jnt_limited[scene_.joints[i]]) {
      if (scene_.way(i) <= (slide ? kWidest_m : kWidest_rad)) return;
      scene_.fail(i, ".open",
                  "finger '" + finger.joint + "' would move by " + to_words(scene_.way(i)) + scene_.unit(i) +
                      other_unit);
    }
    const mjtNum* range = scene_.model->jnt_range + 2 * scene_.joints[i];
    const double give = kAtRange * (range[1] - range[0]);
    for (const auto& [key, value] : {std::pair{".open", finger.open}, {".closed", finger.closed}}) {
      if (value >= range[0] - give && value <= range[1] + give) continue;
      const double converted = value * smaller;
      std::string advice = converted >= range[0] && converted <= range[1] ? other_unit : "";
      const int actuator = mj_name2id(scene_.model, mjOBJ_ACTUATOR, finger.actuator.c_str());
      if (actuator >= 0 && !finger.command_open && scene_.model->actuator_ctrllimited[actuator] &&
          value <= scene_.model->actuator_ctrlrange[2 * actuator + 1] &&
          value >= scene_.model->actuator_ctrlrange[2 * actuator]) {
        advice = ": if that is the input of " + finger.actuator +
                 ", write the joint's value here and 'command_" + (key + 1) + ": " + to_words(value) + "'";
      }
      scene_.fail(i, key,
                  std::string(key + 1) + ": " + to_words(value) + scene_.unit(i) + " lies outside " +
                      finger.joint + "'s " + to_words(range[0]) + "\u2026" + to_words(range[1]) + advice);
    }
  }

  void find_actuator(std::size_t i) {
    const FingerDescription& finger = scene_.robot.fingers[i];
    scene_.actuators.push_back(-1);
    scene_.pulled.emplace_back(static_cast<std::size_t>(scene_.model->njnt));
    if (scene_.is_added(i)) scene_.pulled[i][static_cast<std::size_t>(scene_.joints[i])] = true;
    if (finger.actuator.empty() || scene_.is_added(i)) return;
    const int actuator = find_named(scene_.model, mjOBJ_ACTUATOR, finger.actuator, scene_.robot,
                                    "fingers[" + std::to_string(i) + "].actuator");
    scene_.actuators[i] = actuator;
    // Half open: where a linkage stretches out, it moves nothing.
    scene_.pose(0.5);
    for (int joint = 0; joint < scene_.model->njnt; ++joint) {
      scene_.pulled[i][static_cast<std::size_t>(joint)] = scene_.acts_on(actuator, joint);
    }
    bool moves = false, directly = scene_.pulls(i, scene_.joints[i]);
    for (int joint = 0; joint < scene_.model->njnt; ++joint) {
      moves = moves || (scene_.pulls(i, joint) && scene_.ties.tied(joint, scene_.joints[i]));
    }
    if (!moves) {
      scene_.fail(i, ".actuator",
                  finger.actuator + " moves " + moved_by(scene_.model, actuator) + ", not " + finger.joint +
                      scene_.driver_of(scene_.joints[i]));
    }
    if (!directly && !finger.command_open) {
      scene_.fail(i, ".actuator",
                  finger.actuator + " moves " + moved_by(scene_.model, actuator) + ", and " + finger.joint +
                      " only follows: give its inputs as 'command_open' and 'command_closed'");
    }
    const std::string other = other_than_servo(scene_.model, actuator);
    if (!other.empty()) {
      scene_.fail(i, ".actuator",
                  "actuator '" + finger.actuator + "' of finger " + finger.joint + " " + other +
                      ": with 'stiffness: 500' in place of 'actuator' flowscope adds a position servo");
    }
    const mjtNum* force = scene_.model->actuator_forcerange + 2 * actuator;
    if (scene_.model->actuator_forcelimited[actuator] && (force[0] >= 0 || force[1] <= 0)) {
      scene_.fail(i, ".actuator",
                  "actuator '" + finger.actuator + "' of finger " + finger.joint + " has a force range of " +
                      to_words(force[0]) + "\u2026" + to_words(force[1]) + ": it can not push both ways");
    }
  }

  /// Whether the inputs open and close the finger, not only in name.
  void check_inputs(std::size_t i) {
    const FingerDescription& finger = scene_.robot.fingers[i];
    const int actuator = scene_.actuators[i];
    scene_.pose(1);
    const double open = scene_.data->actuator_length[actuator];
    scene_.pose(0);
    const double closed = scene_.data->actuator_length[actuator];
    const PositionServo servo = position_servo(scene_.model, actuator);
    const mjtNum* range = scene_.model->actuator_ctrlrange + 2 * actuator;
    const bool limited =
        scene_.model->actuator_ctrllimited[actuator] && !(scene_.model->opt.disableflags & mjDSBL_CLAMPCTRL);
    const std::string inputs =
        limited ? " (it takes " + to_words(range[0]) + "\u2026" + to_words(range[1]) + ")" : "";
    const std::string advice = "'command_open: " + to_words(servo.input_for(open)) +
                               "' and 'command_closed: " + to_words(servo.input_for(closed)) +
                               "' would do it";
    if (std::abs(open - closed) < 1e-9) {
      scene_.fail(i, ".actuator",
                  finger.actuator + " moves " + moved_by(scene_.model, actuator) +
                      ", which is as long with the fingers open as closed");
    }
    const struct {
      const char* key;
      const char* plain;
      double input, wanted, other;
    } ends[] = {{".command_open", ".open", finger.command_open.value_or(finger.open), open, closed},
                {".command_closed", ".closed", finger.command_closed.value_or(finger.closed), closed, open}};
    for (const auto& end : ends) {
      const char* key = finger.command_open ? end.key : end.plain;
      const double give = 1e-6 * (range[1] - range[0]);
      if (limited && (end.input < range[0] - give || end.input > range[1] + give)) {
        scene_.fail(i, key,
                    std::string(key + 1) + ": " + to_words(end.input) + " lies outside the inputs of " +
                        finger.actuator + ", " + to_words(range[0]) + "\u2026" + to_words(range[1]) + ": " +
                        advice);
      }
      // How far beyond its end, as a part of the way: below 0 the finger does not get there.
      const double beyond = (servo.length_of(end.input) - end.wanted) / (end.wanted - end.other);
      if (beyond >= -kPart && beyond <= kPressing) continue;
      const double reached = std::lerp(end.other, end.wanted, 1 + beyond);
      scene_.fail(i, key,
                  "an input of " + to_words(end.input) + " to " + finger.actuator + inputs + " takes " +
                      moved_by(scene_.model, actuator) + " to " + to_words(reached) + ", but with " +
                      finger.joint + " " + (end.plain + 1) + " it is at " + to_words(end.wanted) + ": " +
                      advice);
    }
  }

  /// The fingers are farther from the tool's axis when they are open.
  void check_opening() {
    scene_.pose(1);
    const double open_m = breadth();
    scene_.pose(0);
    const double closed_m = breadth();
    if (closed_m <= open_m + kNarrower_m) return;
    const auto mm = [](double metres) { return to_words(1000 * metres) + " mm"; };
    scene_.fail(0, ".open",
                "with " + scene_.robot.fingers[0].joint + " at " + to_words(scene_.robot.fingers[0].open) +
                    " ('open') the fingers are " + mm(open_m) + " from the tool's axis, with " +
                    to_words(scene_.robot.fingers[0].closed) + " ('closed') " + mm(closed_m) +
                    ": are 'open' and 'closed' exchanged, or does the tool's z not leave the hand?");
  }
  /// Mean distance of the fingers' shapes from the tool's axis, m.
  double breadth() const {
    const Pose tool_from_world = scene_.world_from_tool().inverse();
    double sum = 0;
    int count = 0;
    for (int geom = 0; geom < scene_.model->ngeom; ++geom) {
      const bool of_finger = std::ranges::any_of(scene_.joints, [&](int joint) {
        return scene_.is_below(scene_.model->geom_bodyid[geom], scene_.model->jnt_bodyid[joint]);
      });
      if (!of_finger) continue;
      const Eigen::Vector3d at =
          tool_from_world * Eigen::Map<const Eigen::Vector3d>(scene_.data->geom_xpos + 3 * geom);
      sum += at.head<2>().norm();
      ++count;
    }
    return count > 0 ? sum / count : 0;
  }

  GripperScene& scene_;
};

}  // namespace

void check_gripper(const mjModel* model, const RobotDescription& robot, const std::vector<int>& arm, int hand,
                   bool to_come) {
  GripperScene scene(model, robot, arm, hand, to_come);
  FingerCheck(scene).run();
  check_fingers_held(scene);
}

}  // namespace flowscope
