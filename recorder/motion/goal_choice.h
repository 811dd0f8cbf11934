// Which postures a planned move goes for: those that reach the tool pose, with a view to the lines that
// follow.
#pragma once

#include <optional>
#include <vector>

#include "recorder/motion/collision.h"
#include "recorder/motion/planner.h"

namespace flowscope {

/// Whether lines are possible, and without the arm's links touching anything.
enum class Onward { no, with_touch, free };

/// The straight tool lines that are going to follow a move. Refers to what it is made of. One thread at a
/// time, as the checker.
class LookAhead {
 public:
  /// `then`: world_from_tool at the end of each line.
  LookAhead(const Kinematics& kinematics, const std::vector<Pose>& then)
      : kinematics_(kinematics), then_(then) {}
  bool nothing_follows() const { return then_.empty(); }
  /// Along all of them from posture `q`. What the hand touches then is for those moves to say: things will
  /// have moved.
  Onward from(JointVector q, CollisionChecker& checker) const;

 private:
  const Kinematics& kinematics_;
  const std::vector<Pose>& then_;
};

struct Goals {
  std::vector<JointVector> postures;   ///< free, clearly different from each other, the best first
  Onward onward = Onward::no;          ///< from all of them
  std::optional<JointVector> nearest;  ///< that reaches the pose, free or not; none: out of reach
};

/// Postures from which the lines that follow touch something, or are impossible, are taken only where no
/// others exist.
Goals choose_goals(const Kinematics& kinematics, const Pose& world_from_tool, const JointVector& start,
                   const LookAhead& ahead, const IsFree& is_free, CollisionChecker& checker);

}  // namespace flowscope
