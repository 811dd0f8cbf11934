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
/// Of each corner above the plane, metres; 0 within a millionth of the mesh's size.
std::vector<double> heights(const TriangleMesh& mesh, const Plane& plane);
/// Where the plane meets two of the cuts, below all of them and inside of `whole`, which is closed.
std::vector<Eigen::Vector3d> inner_corners(const std::vector<Plane>& cuts, const Plane& plane,
                                           const TriangleMesh& whole);
/// The part's corners on the surface that it was cut from.
std::vector<Eigen::Vector3d> surface_corners(const CutMesh& part);
/// Those of the surface of `whole`, from which it was cut, and those where cuts meet inside of
/// it: their hull is the part's.
std::vector<Eigen::Vector3d> corners_of(const CutMesh& part, const TriangleMesh& whole);
/// How often a closed mesh winds around a point: 1 inside, 0 outside, 1/2 on a face.
double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& point);

}  // namespace flowscope
