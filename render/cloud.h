// Point clouds through PCL: thinning and files. A target of its own (flowscope_cloud), because PCL is large.
#pragma once

#include <filesystem>

#include "render/observation.h"

namespace flowscope {

/// One point per occupied cube of side `leaf_m` (metres): the mean position and colour of what lies in it.
/// Points that are not finite are left out. A mean comes from no one pixel: `view` and `pixel` of the result
/// are -1. Throws std::invalid_argument when the leaf is not positive or so small that the cubes cannot be
/// counted.
PointCloud voxel_grid(const PointCloud& cloud, double leaf_m);

/// Binary PLY or PCD by the file's ending: x y z in metres (world), 8-bit colour. Whole or absent.
/// Throws std::invalid_argument for another ending or no finite point, std::system_error or
/// std::runtime_error that names the path when it cannot be written.
void write_cloud(const std::filesystem::path& path, const PointCloud& cloud);

}  // namespace flowscope
