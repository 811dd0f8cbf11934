// Cutting meshes by planes.
#pragma once

#include "recorder/mesh/mesh.h"

namespace flowscope {

struct Plane {
  Eigen::Vector3d normal{0, 0, 1};  ///< unit length
  double offset = 0;                ///< normal . point on the plane, metres
  Plane turned() const { return {-normal, -offset}; }
};

/// A part of a mesh. Its cuts are closed by fans of signed triangles from one of their corners, which may
/// overlap: volumes of a closed mesh and further cuts stay exact.
struct CutMesh {
  TriangleMesh mesh;
  std::vector<bool> is_lid{};    ///< per triangle: belongs to a fan
  std::vector<bool> is_guess{};  ///< per corner: only fans meet there, so it may lie outside the part
  std::vector<Plane> cuts{};     ///< below all of these
};

/// What lies below the plane (against its normal); `closed` says whether the mesh was. Colours are dropped.
CutMesh below(const CutMesh& part, const Plane& plane, bool closed);
/// The part's corners without those that lie outside of `whole`, from which it was cut: their hull is the
/// part's.
std::vector<Eigen::Vector3d> corners_of(const CutMesh& part, const TriangleMesh& whole);
/// How often a closed mesh winds around a point: 1 inside, 0 outside, 1/2 on a face.
double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& point);

}  // namespace flowscope
