#include "recorder/robot_check.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "recorder/gripper_check.h"
#include "recorder/robot_names.h"
#include "recorder/robot_servo.h"
#include "recorder/robot_ties.h"
#include "recorder/script.h"

namespace flowscope {
namespace {

constexpr double kRounding = 1e-4;  ///< of an angle or input: people write 1.5708

constexpr double kTinyRange_rad = 0.15;
const char* const kRangeUnit = ": are the scene's ranges in rad, and its <compiler> reads degrees?";
const char* const kAddServos =
    ": with 'stiffness: […]' in place of 'actuators' (and of a finger's 'actuator') flowscope adds position "
    "servos";

const char* word_of(int joint_type) {
  switch (joint_type) {
    case mjJNT_FREE:
      return "a free joint";
    case mjJNT_BALL:
      return "a ball joint";
    case mjJNT_SLIDE:
      return "a slide";
    default:
      return "a hinge";
  }
}

std::string numbered(const char* what, std::size_t i) {
  return std::string(what) + "[" + std::to_string(i) + "]";
}

class ArmCheck {
 public:
  ArmCheck(const mjModel* model, const RobotDescription& robot, Additions additions)
      : model_(model), robot_(robot), to_come_(additions == Additions::to_come) {}

  void run() {
    check_engine();
    find_joints();
    check_chain();
    check_home();
    check_actuators();
    check_held();
    check_gripper(model_, robot_, joints_, hand_, to_come_);
  }

 private:
  [[noreturn]] void fail(const std::string& place, const std::string& message) const {
    throw BadScript(robot_.places.of(place) + message);
  }
  std::string joint_name(int joint) const { return name_of(model_, mjOBJ_JOINT, joint); }
  bool is_below(int body, int ancestor) const {
    while (body != 0 && body != ancestor) body = model_->body_parentid[body];
    return body == ancestor;
  }
  bool is_of_arm(int joint) const { return std::ranges::find(joints_, joint) != joints_.end(); }

  void check_engine() const {
    const int off = model_->opt.disableflags;
    if (off & mjDSBL_ACTUATION) {
      fail("actuators",
           "the scene switches actuators off (flag actuation=\"disable\"): nothing can move the arm");
    }
    if (off & (mjDSBL_EQUALITY | mjDSBL_CONSTRAINT)) {
      fail(
          "hand",
          "the scene switches equality constraints off (a flag is \"disable\"): the hand could hold nothing");
    }
  }

  void find_joints() {
    for (std::size_t i = 0; i < robot_.joints.size(); ++i) {
      const std::string place = numbered("joints", i);
      const int joint = find_named(model_, mjOBJ_JOINT, robot_.joints[i], robot_, place);
      if (model_->jnt_type[joint] != mjJNT_HINGE) {
        fail(place, "joint '" + robot_.joints[i] + "' is " + word_of(model_->jnt_type[joint]) +
                        ": the joints of an arm are hinges");
      }
      joints_.push_back(joint);
    }
    hand_ = find_named(model_, mjOBJ_BODY, robot_.hand, robot_, "hand");
    tool_ = body_of("tool", robot_.tool, robot_.tool_place);
    attach_ = body_of("attach", robot_.attach, robot_.attach_place);
  }
  /// Of a site that exists or is to come.
  int body_of(const std::string& key, const std::string& name,
              const std::optional<SiteDescription>& place) const {
    if (place && to_come_) {
      if (mj_name2id(model_, mjOBJ_SITE, key.c_str()) >= 0) {
        fail(key, "the scene has a site '" + key + "' of its own: write '" + key + ": " + key +
                      "' to take that one, or give it another name");
      }
      return find_named(model_, mjOBJ_BODY, place->body, robot_, key);
    }
    const int site = find_named(model_, mjOBJ_SITE, name, robot_, key);
    if (key == "attach" && model_->site_type[site] != mjGEOM_BOX) {
      fail(key, "site '" + name + "' is no box: what lies inside the box is taken");
    }
    return model_->site_bodyid[site];
  }

  void check_chain() const {
    for (std::size_t i = 1; i < joints_.size(); ++i) {
      const int above = joints_[i - 1], below = joints_[i];
      if (comes_after(above, below)) continue;
      const std::string &one = robot_.joints[i - 1], &other = robot_.joints[i];
      fail(numbered("joints", i),
           other + (comes_after(below, above)
                        ? " lies above " + one + ": name joints from the base to the flange"
                        : " does not hang below " + one + ": an arm is one chain"));
    }
    const int last = joints_.back();
    for (const auto& [key, body] : {std::pair{"tool", tool_}, {"attach", attach_}, {"hand", hand_}}) {
      if (!is_below(body, model_->jnt_bodyid[last])) {
        fail(key, std::string("'") + key + "' is of body " + name_of(model_, mjOBJ_BODY, body) +
                      ", which the last joint, " + robot_.joints.back() + ", does not move");
      }
      for (int above = body; above != 0; above = model_->body_parentid[above]) {
        for (int k = 0; k < model_->body_jntnum[above]; ++k) {
          const int joint = model_->body_jntadr[above] + k;
          if (is_of_arm(joint)) continue;
          const std::string what = model_->jnt_type[joint] == mjJNT_HINGE
                                       ? ""
                                       : std::string(", ") + word_of(model_->jnt_type[joint]) + ",";
          fail("joints", "joint '" + joint_name(joint) + "'" + what + " moves the " + key +
                             ", but 'joints' does not name it");
        }
      }
    }
  }
  bool comes_after(int above, int below) const {
    const int one = model_->jnt_bodyid[above], other = model_->jnt_bodyid[below];
    return one == other ? above < below : is_below(other, one);
  }

  void check_home() const {
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const bool limited = model_->jnt_limited[joints_[i]];
      const mjtNum* range = model_->jnt_range + 2 * joints_[i];
      const double lower = limited ? range[0] : -std::numbers::pi,
                   upper = limited ? range[1] : std::numbers::pi;
      const double q = robot_.home[i], in_rad = q * std::numbers::pi / 180;
      if (q >= lower - kRounding && q <= upper + kRounding) continue;
      fail(numbered("home", i), "home: " + to_words(q) + " rad lies outside " + robot_.joints[i] + "'s " +
                                    to_words(lower) + "\u2026" + to_words(upper) +
                                    (upper - lower < kTinyRange_rad       ? kRangeUnit
                                     : in_rad >= lower && in_rad <= upper ? ": degrees?"
                                                                          : ""));
    }
  }

  void check_actuators() const {
    const bool added = to_come_ && !robot_.stiffness.empty();
    std::vector<int> ours;
    for (std::size_t i = 0; i < joints_.size() && !added; ++i) {
      const std::string place = numbered("actuators", i);
      ours.push_back(find_named(model_, mjOBJ_ACTUATOR, robot_.actuators[i], robot_, place));
      check_transmission(ours.back(), joints_[i], place);
      check_servo(ours.back(), i, place);
    }
    if (to_come_) check_added_names();
    for (int other = 0; other < model_->nu && !ours.empty(); ++other) {
      if (std::ranges::find(ours, other) != ours.end() || !acts_on_joint(other)) continue;
      const int joint = model_->actuator_trnid[2 * other];
      const bool holds = other_than_servo(model_, other).empty();
      const bool of_finger = std::ranges::any_of(robot_.fingers, [&](const FingerDescription& finger) {
        return finger.actuator == name_of(model_, mjOBJ_ACTUATOR, other);  // has a complaint of its own
      });
      if (is_of_arm(joint) && holds && !of_finger) {
        fail("actuators", "actuator '" + name_of(model_, mjOBJ_ACTUATOR, other) + "' holds " +
                              joint_name(joint) + " as well, against the one that is named here" +
                              kAddServos);
      }
    }
  }
  bool acts_on_joint(int actuator) const {
    const int kind = model_->actuator_trntype[actuator];
    return kind == mjTRN_JOINT || kind == mjTRN_JOINTINPARENT;
  }
  void check_added_names() const {
    const auto check = [this](const std::string& name, const char* place) {
      if (mj_name2id(model_, mjOBJ_ACTUATOR, name.c_str()) < 0) return;
      fail(place, "the scene has an actuator '" + name +
                      "' already: name it under 'actuators' in place of 'stiffness'");
    };
    for (std::size_t i = 0; i < robot_.stiffness.size(); ++i) check(robot_.actuators[i], "stiffness");
    for (const auto& finger : robot_.fingers) {
      if (finger.stiffness > 0) check(finger.actuator, "gripper");
    }
  }

  void check_transmission(int actuator, int joint, const std::string& place) const {
    const std::string actual = moved_by(model_, actuator), wanted = joint_name(joint);
    const std::string who = name_of(model_, mjOBJ_ACTUATOR, actuator);
    if (!acts_on_joint(actuator) || model_->actuator_trnid[2 * actuator] != joint) {
      std::string advice;
      for (int other = 0; other < model_->nu && advice.empty(); ++other) {
        if (acts_on_joint(other) && model_->actuator_trnid[2 * other] == joint) {
          advice = "; " + name_of(model_, mjOBJ_ACTUATOR, other) + " does";
        }
      }
      fail(place, who + " moves " + actual + ", not " + wanted + advice);
    }
    const mjtNum gear = model_->actuator_gear[6 * actuator];
    if (gear != 1) {
      fail(place, "actuator '" + who + "' turns " + wanted + " through a gear of " + to_words(gear) +
                      ", so that its input is not the joint's angle" + kAddServos);
    }
  }

  void check_servo(int actuator, std::size_t i, const std::string& place) const {
    const std::string who = "actuator '" + robot_.actuators[i] + "' of " + robot_.joints[i] + " ";
    if (const auto other = other_than_servo(model_, actuator); !other.empty())
      fail(place, who + other + kAddServos);
    const PositionServo servo = position_servo(model_, actuator);
    if (!servo.takes_lengths()) {
      fail(place, who + "takes an input of 1 for " + to_words(servo.length_of(1)) + " rad" +
                      (servo.offset == 0 ? "" : " and 0 for " + to_words(servo.length_of(0)) + " rad") +
                      ": its input must be the angle in rad" + kAddServos);
    }
    const mjtNum *force = model_->actuator_forcerange + 2 * actuator,
                 *input = model_->actuator_ctrlrange + 2 * actuator;
    if (model_->actuator_forcelimited[actuator] && (force[0] >= 0 || force[1] <= 0)) {
      fail(place, who + "has a force range of " + to_words(force[0]) + "\u2026" + to_words(force[1]) +
                      ": it can not push both ways");
    }
    const double home = robot_.home[i];
    if (model_->actuator_ctrllimited[actuator] &&
        (home < input[0] - kRounding || home > input[1] + kRounding)) {
      fail(numbered("home", i), "home: " + to_words(home) + " rad lies outside the inputs of " +
                                    robot_.actuators[i] + ", " + to_words(input[0]) + "\u2026" +
                                    to_words(input[1]));
    }
  }

  /// By anything but its own servos.
  void check_held() const {
    for (int i = 0; i < model_->neq; ++i) {
      const bool bodies = model_->eq_type[i] == mjEQ_WELD || model_->eq_type[i] == mjEQ_CONNECT;
      if (!bodies || !model_->eq_active[i]) continue;
      const int first = model_->eq_obj1id[i], second = std::max(model_->eq_obj2id[i], 0);
      for (const auto& [own, other] : {std::pair{first, second}, {second, first}}) {
        if (!is_below(own, model_->jnt_bodyid[joints_[0]]) || !stands_still(other)) continue;
        const bool mocap = model_->body_mocapid[model_->body_rootid[other]] >= 0;
        fail("joints", "the scene ties body '" + name_of(model_, mjOBJ_BODY, own) + "' of the arm to " +
                           (mocap ? "mocap body '" : "body '") + name_of(model_, mjOBJ_BODY, other) +
                           "', which would hold it against the actuators of " + robot_.joints.front() +
                           " and the others: take that " +
                           (model_->eq_type[i] == mjEQ_WELD ? "weld" : "connect") +
                           " out, or write active=\"false\"");
      }
    }
    const JointTies ties(model_);
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      if (ties.is_locked(joints_[i])) {
        fail(numbered("joints", i), "an equality of the scene locks " + robot_.joints[i] + ": take it out");
      }
      for (std::size_t k = 0; k < i; ++k) {
        if (!ties.tied(joints_[i], joints_[k])) continue;
        fail(numbered("joints", i), "an equality of the scene ties " + robot_.joints[i] + " to " +
                                        robot_.joints[k] + ": the joints of an arm move each on its own");
      }
    }
  }
  bool stands_still(int body) const {
    for (; body != 0; body = model_->body_parentid[body]) {
      if (model_->body_dofnum[body] > 0) return false;
    }
    return true;
  }

  const mjModel* model_;
  const RobotDescription& robot_;
  bool to_come_;
  std::vector<int> joints_;
  int hand_ = -1, tool_ = -1, attach_ = -1;
};

}  // namespace

void check_robot(const mjModel* model, const RobotDescription& robot, Additions additions) {
  if (!robot.joints.empty()) ArmCheck(model, robot, additions).run();
}

Kinematics kinematics_of(const mjModel* model, const RobotDescription& robot) {
  try {
    return Kinematics::from_model(model, robot);
  } catch (const std::runtime_error& error) {
    throw BadScript(robot.places.of("inverse_kinematics") + error.what());
  }
}

}  // namespace flowscope
