// What the policy sees: named RGB-D views. Adding a camera is data.
#pragma once

#include <vector>

#include "render/camera_model.h"
#include "render/image.h"

namespace flowscope {

struct View {
  CameraModel camera;  ///< its name names the view: front, left_shoulder, right_shoulder, wrist
  ImageRgb rgb;
  DepthImage depth;
  bool operator==(const View&) const = default;
};

struct Observation {
  std::vector<View> views;
  bool operator==(const Observation&) const = default;
};

/// World-frame points with colour and the pixel that each came from.
struct PointCloud {
  std::vector<Eigen::Vector3f> position;  ///< metres, world
  std::vector<Eigen::Vector3f> color;     ///< linear copy of 8-bit RGB scaled to [0, 1]
  std::vector<int> view;                  ///< index into Observation::views
  std::vector<int> pixel;                 ///< y * width + x in that view
  std::size_t size() const { return position.size(); }
};

/// Axis-aligned box, metres, world.
struct Box {
  Eigen::Vector3d min = Eigen::Vector3d::Zero(), max = Eigen::Vector3d::Zero();
  bool contains(const Eigen::Vector3d& p) const {
    return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
  }
  bool operator==(const Box& o) const { return min == o.min && max == o.max; }
};

/// All valid depth pixels of all views as world points inside `workspace`.
PointCloud to_point_cloud(const Observation& observation, const Box& workspace);

}  // namespace flowscope
