// What a cut would give, measured without making it: a search tries dozens for each that it makes.
#pragma once

#include "recorder/mesh/mesh_cut.h"

namespace flowscope {

struct CutVolumes {
  double low = 0;                      ///< of what lies below; meaningful for closed meshes
  double low_hull = 0, high_hull = 0;  ///< 0 for a side that is flat or empty
};

/// Of shapes whose size is about 1.
class CutTrial {
 public:
  /// `inner`: where the part's cuts meet inside of `whole` (inner_corners). The three must outlive this.
  CutTrial(const CutMesh& part, const std::vector<Eigen::Vector3d>& inner, const TriangleMesh& whole,
           bool closed);
  CutVolumes measure(const Plane& plane) const;

 private:
  struct Sides {
    std::vector<bool> low, high;  ///< per corner
  };
  Sides sides_of(const Plane& plane, const std::vector<double>& height) const;
  double volume_below(const Plane& plane, const std::vector<double>& height) const;

  const CutMesh& part_;
  const std::vector<Eigen::Vector3d>& inner_;
  const TriangleMesh& whole_;
  bool closed_;
  std::vector<std::pair<int, int>> edges_;  ///< of the surface itself, each once
};

}  // namespace flowscope
