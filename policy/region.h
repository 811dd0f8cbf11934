// Dynamic radius schedule: which points the network looks at around the noisy position (paper §3.3, M = {(p,
// r)}).
#pragma once

#include <vector>

#include "policy/scene_points.h"

namespace flowscope {

/// What lies in the sphere, in Morton order along its cube, so that neighbours in space are neighbours in the
/// scan.
struct RegionPoints {
  std::vector<int> index;    ///< into PreparedScene::points; exactly `count` of them
  std::vector<char> inside;  ///< 0 for a padding point
  int points_inside = 0;     ///< all points of the scene inside, chosen or not
};

/// Which of more points than wanted inside the sphere are taken.
enum class SphereRule {
  scene_order,  ///< the first in the scene's own order, which is even at its front: no search at every step
  farthest      ///< farthest points among all those inside, so that a smaller sphere is seen more sharply
};

/// Above this many candidates the even front of the scene's order would leave most of a small sphere's points
/// unused: they are chosen anew in every sphere.
inline constexpr int scene_order_points = 8192;
SphereRule sphere_rule(const NetworkShape& shape);

/// `count` of the points within `radius_m` of `center` by `rule`, the farthest beginning with the first of
/// the scene's order that lies inside. Too few: padded with the nearest points outside, marked as such, and
/// if the scene itself is smaller, with its points again. With `everywhere` the sphere does not cut. Throws
/// std::invalid_argument for a scene without points.
RegionPoints select_region(const std::vector<ScenePoint>& points, const Eigen::Vector3f& center,
                           float radius_m, int count, bool everywhere = false,
                           SphereRule rule = SphereRule::scene_order);

}  // namespace flowscope
