// Is a joint posture free of collisions in the world as it stands?
//
// Cheap first, exact last: only the moving bodies are placed, bounding spheres and boxes rule out nearly all
// pairs of geoms, and MuJoCo's own routine for the pair decides the rest. The answer is that of the engine's
// whole collision pass.
#pragma once

#include <memory>
#include <string>

#include "recorder/motion/kinematics.h"

namespace flowscope {

class World;

/// Keeps a copy of the world's present moment (objects, fingers, what is grasped); the world may go on
/// meanwhile, but its scene must outlive this. One thread at a time.
///
/// A posture collides when a moving part (arm, hand, fingers, what they hold) goes more than a millimetre
/// into anything else. Pairs that touch already at the start may go on touching, no deeper than at the start:
/// a hand may leave the button that it has just pressed. What is held may touch the hand.
class CollisionChecker {
 public:
  explicit CollisionChecker(const World& world);
  ~CollisionChecker();
  CollisionChecker(const CollisionChecker&) = delete;
  CollisionChecker& operator=(const CollisionChecker&) = delete;

  bool is_free(const JointVector& q);
  /// Stricter than that millimetre: what planning asks for, so that a path which is clear at one resolution
  /// is free at finer ones.
  bool is_clear(const JointVector& q, double depth_m = clear_depth_m);
  static constexpr double clear_depth_m = 0.0005;
  /// As is_clear, and what the hand carries stays `carried_clearance_m` away from everything that stands
  /// still, or as near as it is at the start: a weld gives, so what is carried lags behind where the hand
  /// takes it.
  bool carries_clear(const JointVector& q);
  static constexpr double carried_clearance_m = 0.005;
  bool carries() const;  ///< whether the hand holds something that goes along
  /// As is_free, but things that give way (joints let them move) may be pushed by the hand and what it holds.
  bool is_free_to_push(const JointVector& q);
  /// As is_free, for the arm's links alone: a hand that shall touch things must not push the arm into others.
  bool links_are_free(const JointVector& q);
  /// Whether a moving part touches something other than what the hand holds, however little and allowed or
  /// not.
  bool touches(const JointVector& q);
  /// From here on what touches at `q` may go on touching, and nothing else.
  void start_from(const JointVector& q);
  /// Deepest collision at `q` as "hand and drawer_frame, 12 mm deep"; empty when free.
  std::string describe(const JointVector& q);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
