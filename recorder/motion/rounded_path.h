// A path of straight stretches in joint space whose corners are rounded by arcs, so that an arm can pass them
// with finite acceleration.
//
// The geometry of Kunz & Stilman, "Time-Optimal Trajectory Generation for Path Following with Bounded
// Acceleration and Velocity", RSS 2012, DOI 10.15607/RSS.2012.VIII.027.
#pragma once

#include <Eigen/Core>
#include <tuple>
#include <vector>

#include "recorder/motion/planner.h"

namespace flowscope {

class RoundedPath {
 public:
  static constexpr int joints = std::tuple_size_v<JointVector>;
  using Joints = Eigen::Matrix<double, joints, 1>;

  /// No point of the result lies farther than `deviation_rad` (Euclidean, joint space) from `corners`; the
  /// first and the last are kept.
  RoundedPath(const JointPath& corners, double deviation_rad);

  /// Part of the path between two places at which the speed along it is chosen.
  struct Interval {
    double begin = 0, length = 0;  ///< of the arc length, rad (Euclidean)
    Joints slope, bend;            ///< largest |dq/ds| and |d2q/ds2| in it, every joint
    bool stop_before = false;      ///< a corner that no arc can round: the arm has to rest there
  };
  std::vector<Interval> intervals() const;

  double length() const { return length_; }
  JointVector at(double arc_length) const;

 private:
  /// A line (radius 0): origin + s x. An arc: origin + radius (cos(s/radius) x + sin(s/radius) y).
  struct Piece {
    double begin = 0, length = 0, radius = 0;
    Joints origin, x, y;
    bool stop_before = false;
  };
  void add_line(const Joints& from, const Joints& to, bool stop_before);

  std::vector<Piece> pieces_;
  double length_ = 0;
};

}  // namespace flowscope
