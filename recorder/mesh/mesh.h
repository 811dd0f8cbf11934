// A triangle mesh as physics needs it: corners shared, coloured face by face.
#pragma once

#include <array>
#include <vector>

#include "render/image.h"
#include "render/pose.h"

namespace flowscope {

using TextureCorners = std::array<Eigen::Vector2f, 3>;

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;              ///< metres
  std::vector<std::array<int, 3>> triangles;          ///< counter-clockwise as seen from outside
  std::vector<std::array<std::uint8_t, 3>> colors{};  ///< sRGB, one per triangle; or empty
  std::vector<ImageRgb> textures{};                   ///< sRGB
  std::vector<int> texture_of{};                      ///< one per triangle, -1: its colour; or empty
  /// Where in its texture each corner of a triangle lies: u to the right, v up, the picture from 0 to 1 and
  /// repeated beyond; one per triangle, or empty.
  std::vector<TextureCorners> texture_corners{};
};
/// Adds another one's triangles with their colours and textures; both have a colour for each or none has.
void append(TriangleMesh& mesh, const TriangleMesh& other);

struct Extent {
  Eigen::Vector3d low{0, 0, 0}, high{0, 0, 0};
  Eigen::Vector3d size() const { return high - low; }
};
Extent extent_of(const std::vector<Eigen::Vector3d>& points);

/// Makes corners at the same place (to a millionth of the size) one, drops triangles without area and
/// repeated ones, and turns neighbours the same way round where each edge has two. A closed mesh ends with
/// its outside out.
void tidy(TriangleMesh& mesh);
/// Every edge is gone along as often in one direction as in the other: it bounds a volume.
bool is_closed(const TriangleMesh& mesh);

/// Exact, by signed tetrahedra; meaningful for closed meshes.
struct MassProperties {
  double volume = 0;                                  ///< m^3
  Eigen::Vector3d center{0, 0, 0};                    ///< of mass, metres
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre at density 1, m^5
};
MassProperties mass_properties(const TriangleMesh& mesh);

}  // namespace flowscope
