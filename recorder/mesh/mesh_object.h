// A mesh as an object of the simulator: a body with a picture of it, convex collision parts and its inertia.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recorder/mesh/convex_parts.h"
#include "recorder/mesh/mesh_import.h"

namespace flowscope {

struct ObjectOptions {
  std::string name;  ///< letters, digits and _
  std::optional<double> mass_kg{};
  double density = 1000;  ///< kg/m^3, without a mass
  PartOptions parts{};
};

struct ObjectReport {
  std::filesystem::path file;                    ///< the MJCF
  std::vector<std::filesystem::path> all_files;  ///< with those it needs beside it
  std::size_t triangles = 0, parts = 0, colors = 0, textures = 0;
  bool closed = false;  ///< else mass and inertia are those of the hull
  double volume = 0, parts_volume = 0, mass_kg = 0;
  Eigen::Vector3d size{0, 0, 0}, center_of_mass{0, 0, 0};  ///< metres
  /// By how much of the mesh's volume its parts exceed it: holes filled in. Of a closed mesh.
  double excess() const { return parts_volume / volume - 1; }
};

/// Writes `<name>.xml`, `<name>_visual.obj`, `<name>_part_<k>.obj` and, with a texture or more than one
/// colour, `<name>_colors.png` into the folder, and has the simulator read them. The object stands on z = 0
/// with its bounding box around the origin. Throws BadMesh for a mesh that is flat, tiny, huge or too fine,
/// std::invalid_argument for a name or a folder that will not do; nothing is left behind then.
ObjectReport write_object(TriangleMesh mesh, const ObjectOptions& options,
                          const std::filesystem::path& folder);

}  // namespace flowscope
