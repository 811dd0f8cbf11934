// Boxes of an overlay, ray by ray.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "render/overlay_ink.h"
#include "render/overlay_paint.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr double kEdge_px = 1.6;          ///< width of the drawn edges
constexpr double kEdgeOpacity = 0.95;     ///< of those in front
constexpr double kFarEdgeOpacity = 0.45;  ///< of those at the back, seen through the box

/// The pixels that can show any of the box: left, top, right, bottom, the last two exclusive.
struct Extent {
  int left, top, right, bottom;
};

std::optional<Extent> extent_of(const OverlayBox& box, const CameraModel& camera) {
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
  for (int corner = 0; corner < 8; ++corner) {
    Vector3d at = box.half_size;
    for (int axis = 0; axis < 3; ++axis)
      if (corner >> axis & 1) at[axis] = -at[axis];
    const Vector3d uvz = camera.project(box.world_from_box * at);
    // A corner behind the camera may show up anywhere.
    if (!(uvz.z() > camera.near_m)) return Extent{0, 0, camera.width, camera.height};
    left = std::min(left, uvz.x()), right = std::max(right, uvz.x());
    top = std::min(top, uvz.y()), bottom = std::max(bottom, uvz.y());
  }
  const auto within = [](double v, int limit) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(limit)));
  };
  const Extent e{within(left - 2, camera.width), within(top - 2, camera.height),
                 within(right + 3, camera.width), within(bottom + 3, camera.height)};
  if (e.left >= e.right || e.top >= e.bottom) return std::nullopt;
  return e;
}

/// How near a point of the surface is to an edge of the box, metres: the second smallest distance to a face.
double to_edge(const Vector3d& at, const Vector3d& half_size) {
  Vector3d margin = half_size - at.cwiseAbs();
  std::sort(margin.data(), margin.data() + 3);
  return margin[1];
}

class BoxPainter {
 public:
  BoxPainter(const OverlayBox& box, View& view)
      : box_(box),
        view_(view),
        box_from_camera_(box.world_from_box.inverse() * view.camera.world_from_camera),
        eye_(box_from_camera_.position) {}

  void pixel(int x, int y) {
    const CameraModel& camera = view_.camera;
    // A point at depth z on this pixel's ray is eye + z * ray, in the box's frame.
    const Vector3d ray = box_from_camera_.rotation *
                         Vector3d((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    for (int axis = 0; axis < 3; ++axis) {
      const double h = box_.half_size[axis];
      if (std::abs(ray[axis]) < 1e-12) {
        if (std::abs(eye_[axis]) > h) return;
        continue;
      }
      const double a = (-h - eye_[axis]) / ray[axis], b = (h - eye_[axis]) / ray[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    if (enter >= leave || leave <= camera.near_m) return;
    std::uint8_t* ink = view_.rgb.at(x, y);
    const double surface = view_.depth.at(x, y);
    mix(ink, box_.color, tint(surface, enter, leave, ray));
    edge(ink, ray, leave, surface, kFarEdgeOpacity);
    if (enter > camera.near_m) edge(ink, ray, enter, surface, kEdgeOpacity);
  }

 private:
  /// What stands in the box is tinted more than what is seen through it; where its faces cut a surface there
  /// is a line.
  double tint(double surface, double enter, double leave, const Vector3d& ray) const {
    const double alpha = box_.color[3];
    if (surface <= 0) return alpha;
    if (surface < enter) return hidden_opacity * alpha;
    const double off_faces = ((eye_ + surface * ray).cwiseAbs() - box_.half_size).maxCoeff();
    if (std::abs(off_faces) < 0.8 * surface / view_.camera.fx) return std::min(1.0, 3 * alpha);
    return surface < leave ? std::min(1.0, 1.5 * alpha) : alpha;
  }

  void edge(std::uint8_t* ink, const Vector3d& ray, double depth, double surface, double opacity) const {
    const double pixel_m = depth / view_.camera.fx;
    const double away = to_edge(eye_ + depth * ray, box_.half_size) / pixel_m;
    const double coverage = std::clamp(kEdge_px + 0.5 - away, 0.0, 1.0);
    if (coverage <= 0) return;
    const bool hidden = surface > 0 && surface < depth - depth_tolerance_m;
    mix(ink, box_.color, coverage * opacity * (hidden ? hidden_opacity : 1.0f));
  }

  const OverlayBox& box_;
  View& view_;
  const Pose box_from_camera_;
  const Vector3d eye_;
};

}  // namespace

void paint_boxes(const Overlay& overlay, View& view) {
  for (const OverlayBox& box : overlay.boxes) {
    const bool real = box.half_size.allFinite() && box.half_size.minCoeff() > 0 &&
                      box.world_from_box.position.allFinite() &&
                      box.world_from_box.rotation.coeffs().allFinite();
    if (!real) continue;
    const auto extent = extent_of(box, view.camera);
    if (!extent) continue;
    BoxPainter painter(box, view);
    for (int y = extent->top; y < extent->bottom; ++y)
      for (int x = extent->left; x < extent->right; ++x) painter.pixel(x, y);
  }
}

}  // namespace flowscope
