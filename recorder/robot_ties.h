// What equality constraints tie together: joints that are no longer free to move on their own.
#pragma once

#include <vector>

struct mjModel_;

namespace flowscope {

/// Immutable; the model as it is when this is made, with the constraints that are active then.
class JointTies {
 public:
  explicit JointTies(const mjModel_* model);

  /// Whether constraints lead from one joint to the other, on however long a way: joints that follow each
  /// other, and those of a linkage that a `connect` or `weld` closes.
  bool tied(int joint1, int joint2) const { return find(joint1) == find(joint2); }
  /// Whether any other joint is tied to it.
  bool is_tied(int joint) const;
  /// Whether a constraint holds it at one value.
  bool is_locked(int joint) const { return locked_[static_cast<std::size_t>(joint)]; }

  /// Sets the positions of joints that follow, one by one, those of `known` joints (and adds them to it).
  void spread(std::vector<bool>& known, double* qpos) const;
  /// How far `joint` is from where its constraint with `leader` wants it; 0 when none ties these two
  /// directly.
  double gap(int joint, int leader, const double* qpos) const;

 private:
  struct Follow {
    int follower = 0, leader = 0, equality = 0;
  };
  int find(int joint) const;
  void unite(int joint1, int joint2);
  void unite_linkage(int body1, int body2);
  void unite_tendon(int tendon, int& first);
  double followed(const Follow& follow, const double* qpos) const;

  const mjModel_* model_;
  std::vector<int> parent_;
  std::vector<bool> locked_;
  std::vector<Follow> follows_;
};

}  // namespace flowscope
