// Dynamic radius schedule: which points the network looks at around the noisy position (paper §3.3, M = {(p,
// r)}).
#pragma once

#include <vector>

#include "policy/scene_points.h"

namespace flowscope {

/// What lies in the sphere, in Morton order along its cube so that neighbours in space are neighbours in the
/// scan.
struct RegionPoints {
  std::vector<int> index;    ///< into PreparedScene::points; exactly `count` of them
  std::vector<char> inside;  ///< 0 for a padding point
  int points_inside = 0;     ///< all points of the scene inside, chosen or not
};

/// The first `count` points, in the scene's own (farthest-point) order, within `radius_m` of `center`. Too
/// few: padded with the nearest points outside, marked as such, and if the scene itself is smaller, with its
/// points again. With `everywhere` the sphere does not cut.
RegionPoints select_region(const std::vector<ScenePoint>& points, const Eigen::Vector3f& center,
                           float radius_m, int count, bool everywhere = false);

}  // namespace flowscope
