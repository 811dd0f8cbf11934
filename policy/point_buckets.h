// Points sorted into buckets of neighbours with bounding boxes, for farthest point sampling.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "policy/point_kernels.h"

namespace flowscope {

/// Points whose squared distance is salience[i] * (|place|² + color_weight |colour|²), i the point measured.
/// `color` and `salience` are both empty (distance in space alone, salience 1) or as long as `position`.
struct FarthestInput {
  std::span<const Eigen::Vector3f> position;  ///< metres
  std::span<const Eigen::Vector3f> color = {};
  std::span<const float> salience = {};  ///< >= 0
  float color_weight = 0;                ///< square metres per squared unit of colour
};

/// About 64 points to a bucket, split where the Morton curve crosses the middle of a cube. Throws
/// std::invalid_argument for no points, odd lengths and numbers that are not finite.
class PointBuckets {
 public:
  explicit PointBuckets(const FarthestInput& input);
  /// Valid as long as this object; distance2 starts at the largest float.
  BucketArrays arrays();
  /// Point of each slot; -1 for padding.
  const std::vector<int>& source() const { return source_; }

 private:
  struct Axes {
    std::vector<float> value[3], low[3], high[3];
    void fill(std::span<const Eigen::Vector3f> points, const std::vector<int>& source,
              const std::vector<int>& first);
  };

  std::vector<int> source_, first_;
  Axes place_, tint_;
  std::vector<float> salience_, least_salience_, distance2_, farthest2_;
  float color_weight_ = 0;
};

}  // namespace flowscope
