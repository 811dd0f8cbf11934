// Where the arm, the hand and what it holds are at a joint posture: forward kinematics of those bodies alone,
// for the collision checker.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <vector>

#include "recorder/motion/kinematics.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

/// Whether nothing holds the body back: it is on a free joint, or on six of its own that let it go and turn
/// every way, without limits.
bool goes_anywhere(const mjModel_* model, int body);

/// Everything else in the scene stands still, and the fingers stay as far open as they are.
class MovingParts {
 public:
  struct Geom {
    int id = 0, part = 0;  ///< in the model; index of its body among the parts
    Eigen::Vector3d body_from_geom_position;
    Eigen::Matrix3d body_from_geom;
  };

  /// `data` must be up to date with its positions. `held`: names of bodies in the hand; those that
  /// nothing holds back (a free joint, or slides and a ball without limits) go along with it.
  MovingParts(const mjModel_* model, const mjData_* data, const ArmIndices& arm,
              const std::vector<std::string>& held);

  /// Writes geom_xpos and geom_xmat (metres, world) of every geom in geoms().
  void place(const JointVector& q, mjData_* data);
  const std::vector<Geom>& geoms() const { return geoms_; }  ///< those that take part in contacts
  bool moves(int body) const { return moves_[static_cast<std::size_t>(body)] != 0; }
  /// The hand, the fingers, and what is held even if joints hold it back (a drawer): these may touch
  /// each other.
  bool in_hand(int body) const { return in_hand_[static_cast<std::size_t>(body)] != 0; }
  /// What is held and goes along.
  bool carried(int body) const { return carried_[static_cast<std::size_t>(body)] != 0; }
  bool carries_anything() const { return std::ranges::find(carried_, 1) != carried_.end(); }

 private:
  struct Part {
    int parent = -1;  ///< index of the part that it moves with; -1: `parent_from_part` is the world's
    int joint = -1;   ///< index in a JointVector; -1: fixed to its parent
    /// parent_from_part before its joint turns it about `axis` through `anchor`.
    Eigen::Vector3d position{0, 0, 0}, axis{0, 0, 1}, anchor{0, 0, 0};
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    double zero = 0;  ///< joint angle at which it is not turned
    Eigen::Vector3d world_position{0, 0, 0};
    Eigen::Matrix3d world_rotation = Eigen::Matrix3d::Identity();
  };
  void add_part(const mjData_* data, int body, int parent);

  std::vector<char> moves_, in_hand_, carried_;  ///< per body
  std::vector<int> part_of_;                     ///< per body, -1 for what stands still
  std::vector<Part> parts_;                      ///< parents before children
  std::vector<Geom> geoms_;
};

}  // namespace flowscope
