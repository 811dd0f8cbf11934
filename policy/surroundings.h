// What a point belongs to: the middle and the yaw of the like-coloured points around it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace flowscope {

/// A point alone says where a surface is; a gripper goes to the middle of a thing, turned as the thing is.
/// Both are read off all points nearby, more sharply than a mean over a few tokens could. They turn and move
/// with the scene.
struct Surroundings {
  Eigen::Vector3f middle =
      Eigen::Vector3f::Zero();  ///< metres, world: where the mean shift from the point ends
  /// Σ z^4 / |z|^2 over Σ |z|^2, z the horizontal place to the middle as a complex number: arg / 4 is the yaw
  /// of a square.
  Eigen::Vector2f square = Eigen::Vector2f::Zero();
  /// Σ z^2 over Σ |z|^2: arg / 2 is the yaw of a bar.
  Eigen::Vector2f bar = Eigen::Vector2f::Zero();
  int neighbours = 0;
};

/// At most so many points are counted as neighbours: the first without `skip`, which a prepared scene orders
/// as a fair sample of all. So a denser cloud costs no more per point, and the number of neighbours keeps its
/// scale.
inline constexpr std::size_t surroundings_sample = 4096;

/// For each point of `position` (metres, world) with `color` in [0, 1]: flat mean shift within 45 mm over
/// points of the sample whose colour differs by less than 0.3, three rounds. Points with `skip` (the table)
/// belong to nothing: their middle is themselves.
std::vector<Surroundings> find_surroundings(const std::vector<Eigen::Vector3f>& position,
                                            const std::vector<Eigen::Vector3f>& color,
                                            const std::vector<char>& skip);

/// The same after a turn about world z by `yaw_rad` about the origin and a shift.
Surroundings moved(const Surroundings& around, float yaw_rad, const Eigen::Vector3f& shift);

}  // namespace flowscope
