#include "recorder/gripper_holds.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "recorder/gripper_scene.h"
#include "recorder/robot_names.h"
#include "recorder/robot_servo.h"
#include "recorder/script.h"

namespace flowscope {
namespace {

constexpr double kPart = 0.1;  ///< of a finger's way: by how much fingers may miss their equality

class HoldCheck {
 public:
  explicit HoldCheck(GripperScene& scene) : scene_(scene) {}

  void run() {
    for (std::size_t i = 0; i < scene_.joints.size(); ++i) {
      check_held(i);
      check_follows(i);
    }
    check_loose();
    check_opposed();
  }

 private:
  /// By an equality that leads to something driven, or by its own actuator alone.
  void check_held(std::size_t i) const {
    const FingerDescription& finger = scene_.robot.fingers[i];
    const int joint = scene_.joints[i];
    if (scene_.ties.is_locked(joint))
      scene_.fail(i, ".joint", "an equality of the scene locks finger '" + finger.joint + "'");
    bool follows = false;
    for (int other = 0; other < scene_.model->njnt; ++other) {
      follows = follows || (other != joint && scene_.ties.tied(joint, other) && scene_.is_driven(other));
    }
    if (follows) return;
    if (finger.actuator.empty()) {
      if (scene_.is_driven(joint) && scene_.model->jnt_stiffness[joint] > 0)
        return;  // a tendon pulls it against its spring
      scene_.fail(i, ".joint",
                  "finger '" + finger.joint + "' has no actuator, and no equality of the scene ties it to " +
                      driven_names() +
                      ": nothing would hold it. Give it an 'actuator' (or 'stiffness'), or " +
                      "add <joint joint1=\"" + finger.joint + "\" joint2=\"" + driven_names() +
                      "\"/> to <equality> (in a URDF: <mimic>)");
    }
    // A tendon over several joints leaves open which of them moves.
    for (int other = 0; other < scene_.model->njnt; ++other) {
      if (other == joint || !scene_.pulls(i, other) || scene_.model->jnt_stiffness[other] > 0) continue;
      scene_.fail(i, ".actuator",
                  finger.actuator + " moves " + finger.joint + " and " + scene_.joint_name(other) +
                      " together, but no equality ties them: what the one gains the other loses. Add <joint "
                      "joint1=\"" +
                      scene_.joint_name(other) + "\" joint2=\"" + finger.joint + "\"/> to <equality>");
    }
  }
  std::string driven_names() const {
    for (const auto& finger : scene_.robot.fingers) {
      if (!finger.actuator.empty()) return finger.joint;
    }
    return "another finger";
  }

  /// What the description says of two fingers must suit the equality that ties them.
  void check_follows(std::size_t i) {
    const FingerDescription& finger = scene_.robot.fingers[i];
    for (const double openness : {1.0, 0.0}) {
      scene_.pose(openness);
      for (std::size_t k = 0; k < scene_.joints.size(); ++k) {
        const double gap = scene_.ties.gap(scene_.joints[i], scene_.joints[k], scene_.data->qpos);
        if (std::abs(gap) <= kPart * scene_.way(i)) continue;
        const FingerDescription& leader = scene_.robot.fingers[k];
        const char* key = openness == 1 ? "open" : "closed";
        const double value = openness == 1 ? finger.open : finger.closed;
        scene_.fail(i, openness == 1 ? ".open" : ".closed",
                    std::string(key) + ": " + to_words(value) + scene_.unit(i) + " of " + finger.joint +
                        " does not go with the equality that ties it to " + leader.joint +
                        ": where that is " + key + " (" +
                        to_words(openness == 1 ? leader.open : leader.closed) + "), " + finger.joint +
                        " is at " + to_words(value - gap));
      }
    }
  }

  /// Joints of the hand that nobody has named: not to be left loose.
  void check_loose() const {
    for (int joint = 0; joint < scene_.model->njnt; ++joint) {
      const bool known = std::ranges::find(scene_.joints, joint) != scene_.joints.end() ||
                         std::ranges::find(scene_.arm, joint) != scene_.arm.end();
      const int type = scene_.model->jnt_type[joint];
      if (known || (type != mjJNT_HINGE && type != mjJNT_SLIDE) ||
          !scene_.is_below(scene_.model->jnt_bodyid[joint], scene_.hand))
        continue;
      if (scene_.ties.is_locked(joint) || scene_.ties.is_tied(joint) ||
          scene_.model->jnt_stiffness[joint] > 0)
        continue;
      if (scene_.is_driven(joint) || !scene_.driver_of(joint).empty() ||
          !can_touch(scene_.model->jnt_bodyid[joint]))
        continue;
      throw BadScript(
          scene_.robot.places.of("gripper") + "joint '" + scene_.joint_name(joint) +
          "' of the hand is loose: no equality, actuator or spring holds it. If it is a finger, name it "
          "under 'fingers' and tie it to " +
          driven_names() + " by an equality");
    }
  }
  /// Servos that nobody has named stay where they are and pull the fingers there.
  void check_opposed() {
    scene_.pose(0.5);
    for (int actuator = 0; actuator < scene_.model->nu; ++actuator) {
      if (is_named(actuator) || is_switched_off(actuator) ||
          !other_than_servo(scene_.model, actuator).empty())
        continue;
      for (std::size_t i = 0; i < scene_.joints.size(); ++i) {
        if (scene_.acts_on(actuator, scene_.joints[i])) fail_opposed(i, actuator);
      }
      for (int joint = 0; joint < scene_.model->njnt; ++joint) {
        for (std::size_t i = 0; i < scene_.joints.size(); ++i) {
          if (scene_.acts_on(actuator, joint) && scene_.ties.tied(joint, scene_.joints[i]))
            fail_opposed(i, actuator);
        }
      }
    }
  }
  [[noreturn]] void fail_opposed(std::size_t i, int actuator) const {
    scene_.fail(i, ".joint",
                "actuator '" + name_of(scene_.model, mjOBJ_ACTUATOR, actuator) + "' moves " +
                    moved_by(scene_.model, actuator) + " and so holds finger '" +
                    scene_.robot.fingers[i].joint +
                    "', but the description does not name it: give it to its finger as 'actuator'");
  }
  bool is_named(int actuator) const {
    const std::string name = name_of(scene_.model, mjOBJ_ACTUATOR, actuator);
    return std::ranges::find(scene_.actuators, actuator) != scene_.actuators.end() ||
           std::ranges::find(scene_.robot.actuators, name) != scene_.robot.actuators.end();
  }
  /// By the one that comes in its place.
  bool is_switched_off(int actuator) const {
    const int kind = scene_.model->actuator_trntype[actuator],
              moved = scene_.model->actuator_trnid[2 * actuator];
    if (kind != mjTRN_JOINT && kind != mjTRN_JOINTINPARENT) return false;
    for (std::size_t i = 0; i < scene_.joints.size(); ++i) {
      if (scene_.is_added(i) && scene_.joints[i] == moved) return true;
    }
    return false;
  }
  bool can_touch(int ancestor) const {
    for (int geom = 0; geom < scene_.model->ngeom; ++geom) {
      if (scene_.model->geom_contype[geom] == 0 && scene_.model->geom_conaffinity[geom] == 0) continue;
      for (int body = scene_.model->geom_bodyid[geom]; body != 0; body = scene_.model->body_parentid[body]) {
        if (body == ancestor) return true;
      }
    }
    return false;
  }

  GripperScene& scene_;
};

}  // namespace

void check_fingers_held(GripperScene& scene) { HoldCheck(scene).run(); }

}  // namespace flowscope
