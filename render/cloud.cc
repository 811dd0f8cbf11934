#include "render/cloud.h"

#include <pcl/filters/voxel_grid.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

#include "render/new_file.h"

namespace flowscope {

namespace {

using Colored = pcl::PointCloud<pcl::PointXYZRGB>;

std::uint8_t byte(float value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0f, 1.0f)));
}

/// Finite points only: PCL asserts on others.
Colored::Ptr to_pcl(const PointCloud& cloud) {
  if (cloud.color.size() != cloud.size())
    throw std::invalid_argument("cloud: as many colours as points are needed");
  Colored::Ptr out(new Colored);
  out->reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.position[i];
    const Eigen::Vector3f& c = cloud.color[i];
    if (!p.allFinite() || !c.allFinite()) continue;
    pcl::PointXYZRGB point(byte(c.x()), byte(c.y()), byte(c.z()));
    point.getVector3fMap() = p;
    out->push_back(point);
  }
  return out;
}

PointCloud from_pcl(const Colored& cloud) {
  PointCloud out;
  for (const pcl::PointXYZRGB& point : cloud) {
    out.position.push_back(point.getVector3fMap());
    out.color.push_back(Eigen::Vector3f(point.r, point.g, point.b) / 255.0f);
  }
  out.view.assign(out.size(), -1);
  out.pixel.assign(out.size(), -1);
  return out;
}

/// PCL numbers the cubes with 32 bits and hands the input back when they do not suffice.
void check_leaf(const Colored& cloud, double leaf_m) {
  if (!(leaf_m > 0) || !std::isfinite(leaf_m))
    throw std::invalid_argument("voxel grid: the leaf must be positive");
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const pcl::PointXYZRGB& point : cloud) {
    low = low.min(point.getVector3fMap().cast<double>().array());
    high = high.max(point.getVector3fMap().cast<double>().array());
  }
  const double cubes = ((high - low) / leaf_m + 2).prod();
  const double farthest = low.abs().max(high.abs()).maxCoeff() / leaf_m;
  constexpr double limit = std::numeric_limits<std::int32_t>::max();
  if (cubes < limit && farthest < limit) return;
  throw std::invalid_argument("voxel grid: a leaf of " + std::to_string(leaf_m) +
                              " m is too small for a cloud of " + std::to_string((high - low).maxCoeff()) +
                              " m");
}

/// What PCL returns is no proof: it calls a file of 0 bytes written.
void require_same(const std::filesystem::path& file, const std::string& ending, const Colored& points) {
  constexpr std::size_t least_bytes = 3 * sizeof(float) + 3;  // of one point: x y z and its colour
  Colored there;
  if (std::filesystem::file_size(file) > least_bytes * points.size()) {
    if (ending == ".ply") {
      pcl::PLYReader().read(file.string(), there);
    } else {
      pcl::PCDReader().read(file.string(), there);
    }
  }
  const bool same =
      std::equal(there.begin(), there.end(), points.begin(), points.end(),
                 [](const pcl::PointXYZRGB& a, const pcl::PointXYZRGB& b) {
                   return a.getVector3fMap() == b.getVector3fMap() && a.r == b.r && a.g == b.g && a.b == b.b;
                 });
  if (!same) throw std::runtime_error("PCL wrote another cloud");
}

}  // namespace

PointCloud voxel_grid(const PointCloud& cloud, double leaf_m) {
  const Colored::Ptr points = to_pcl(cloud);
  if (points->empty()) {
    if (!(leaf_m > 0)) throw std::invalid_argument("voxel grid: the leaf must be positive");
    return {};
  }
  check_leaf(*points, leaf_m);
  pcl::VoxelGrid<pcl::PointXYZRGB> grid;
  const auto leaf = static_cast<float>(leaf_m);
  grid.setLeafSize(leaf, leaf, leaf);
  grid.setInputCloud(points);
  Colored thinned;
  grid.filter(thinned);
  return from_pcl(thinned);
}

void write_cloud(const std::filesystem::path& path, const PointCloud& cloud) {
  const std::string ending = path.extension().string();
  if (ending != ".ply" && ending != ".pcd") {
    throw std::invalid_argument("cloud: " + path.string() + " must end in .ply or .pcd");
  }
  const Colored::Ptr points = to_pcl(cloud);
  if (points->empty()) throw std::invalid_argument("cloud: no finite point to write to " + path.string());
  NewFile file(path);
  file.check([&](const std::filesystem::path& place) {
    if (ending == ".ply") {
      pcl::PLYWriter().write(place.string(), *points, /*binary=*/true, /*use_camera=*/false);
    } else {
      pcl::PCDWriter().writeBinary(place.string(), *points);
    }
    require_same(place, ending, *points);
  });
  file.commit();
}

}  // namespace flowscope
