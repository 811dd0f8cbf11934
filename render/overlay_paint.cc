#include "render/overlay_paint.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "render/overlay_ink.h"

namespace flowscope {

namespace {

struct Disc {
  double u, v, z;  ///< centre in pixels, depth in metres
  double radius;   ///< pixels
  Rgba color;
};

/// Where a pixel's ray passes a sphere: depths along z, half the way inside it, and how far from its centre
/// the seen surface lies. Metres.
struct Chord {
  double enter_m, leave_m, half_m, surface_to_center_m;
};

std::vector<Disc> project_points(const Overlay& overlay, const CameraModel& camera) {
  std::vector<Disc> discs;
  for (const OverlayPoints& group : overlay.points) {
    for (const Eigen::Vector3d& point : group.points) {
      const Eigen::Vector3d uvz = camera.project(point);
      if (!(uvz.z() > camera.near_m) || !uvz.allFinite()) continue;
      const double radius = std::clamp(0.5 * group.size_m * camera.fx / uvz.z(), 1.0, 64.0);
      if (uvz.x() < -radius || uvz.x() > camera.width + radius || uvz.y() < -radius ||
          uvz.y() > camera.height + radius) {
        continue;
      }
      discs.push_back({uvz.x(), uvz.y(), uvz.z(), radius, group.color});
    }
  }
  std::stable_sort(discs.begin(), discs.end(), [](const Disc& a, const Disc& b) { return a.z > b.z; });
  return discs;
}

/// How strongly a sphere tints the pixel whose ray passes it at chord half-length `half_chord`.
double sphere_opacity(const Chord& chord, double surface_m, double radius_m, double pixel_m, double alpha) {
  const double rim = std::pow(1 - chord.half_m / radius_m, 4);
  const double shell = alpha + (1 - alpha) * 0.6 * rim;
  if (surface_m <= 0) return 0.7 * shell;
  // The line along which the sphere cuts a surface shows what is inside better than any tint.
  const double off_sphere = std::abs(chord.surface_to_center_m - radius_m);
  if (off_sphere < 1.5 * pixel_m) return std::min(1.0, 3.5 * alpha);
  if (surface_m < chord.enter_m) return hidden_opacity * 0.7 * shell;
  return surface_m < chord.leave_m ? std::min(1.0, 1.3 * alpha + 0.3 * rim) : 0.7 * shell;
}

void paint_sphere(const OverlaySphere& sphere, View& view) {
  const CameraModel& camera = view.camera;
  const Eigen::Vector3d center = camera.world_from_camera.inverse() * sphere.center;
  for (int y = 0; y < view.rgb.height; ++y) {
    for (int x = 0; x < view.rgb.width; ++x) {
      // A point at depth z on this pixel's ray is z * ray.
      const Eigen::Vector3d ray((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
      const double middle = ray.dot(center) / ray.squaredNorm();
      const double reach = sphere.radius_m * sphere.radius_m - (middle * ray - center).squaredNorm();
      if (reach <= 0) continue;
      const double half = std::sqrt(reach), length = ray.norm();
      const double surface = view.depth.at(x, y);
      const Chord chord{middle - half / length, middle + half / length, half,
                        (surface * ray - center).norm()};
      if (chord.leave_m <= camera.near_m) continue;
      mix(view.rgb.at(x, y), sphere.color,
          sphere_opacity(chord, surface, sphere.radius_m, surface / camera.fx, sphere.color[3]));
    }
  }
}

void paint_disc(const Disc& disc, View& view) {
  const auto first = [](double v) { return std::max(0, static_cast<int>(std::floor(v))); };
  const int x_end = std::min(view.rgb.width, static_cast<int>(std::ceil(disc.u + disc.radius + 1)));
  const int y_end = std::min(view.rgb.height, static_cast<int>(std::ceil(disc.v + disc.radius + 1)));
  for (int y = first(disc.v - disc.radius - 1); y < y_end; ++y) {
    for (int x = first(disc.u - disc.radius - 1); x < x_end; ++x) {
      const double distance = std::hypot(x + 0.5 - disc.u, y + 0.5 - disc.v);
      const double coverage = std::clamp(disc.radius + 0.5 - distance, 0.0, 1.0);
      if (coverage <= 0) continue;
      const float surface = view.depth.at(x, y);
      const bool hidden = surface > 0 && surface < disc.z - depth_tolerance_m;
      const double opacity = coverage * disc.color[3] * (hidden ? hidden_opacity : 1.0f);
      // A darker rim keeps neighbours apart and points visible on a ground of their own colour.
      const float shade = disc.radius > 2 && distance > disc.radius - 1 ? 0.6f : 1.0f;
      Rgba ink = disc.color;
      for (std::size_t c = 0; c < 3; ++c) ink[c] *= shade;
      mix(view.rgb.at(x, y), ink, opacity);
    }
  }
}

std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0) == 0x80) continue;  // the rest of a UTF-8 character
    out += byte >= 0x20 && byte < 0x7F ? c : '?';
  }
  return out;
}

}  // namespace

void paint_spheres(const Overlay& overlay, View& view) {
  for (const OverlaySphere& sphere : overlay.spheres) {
    if (sphere.radius_m > 0 && std::isfinite(sphere.radius_m) && sphere.center.allFinite())
      paint_sphere(sphere, view);
  }
}

void paint_layer(const View& layer, float opacity, View& view) {
  for (std::size_t i = 0; i < view.depth.data.size(); ++i) {
    const float ink_m = layer.depth.data[i], surface_m = view.depth.data[i];
    if (ink_m <= 0) continue;
    const bool hidden = surface_m > 0 && surface_m < ink_m - depth_tolerance_m;
    const float weight = hidden ? opacity * hidden_opacity : opacity;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      const float below = view.rgb.data[c];
      view.rgb.data[c] = static_cast<std::uint8_t>(std::lround(below + (layer.rgb.data[c] - below) * weight));
    }
  }
}

void paint_points(const Overlay& overlay, View& view) {
  for (const Disc& disc : project_points(overlay, view.camera)) paint_disc(disc, view);
}

void paint_labels(const Overlay& overlay, View& view) {
  cv::Mat picture(view.rgb.height, view.rgb.width, CV_8UC3, view.rgb.data.data());
  const double scale = std::clamp(view.rgb.height / 900.0, 0.35, 1.2);
  const int weight = scale > 0.8 ? 2 : 1;
  for (const OverlayLabel& label : overlay.labels) {
    const Eigen::Vector3d uvz = view.camera.project(label.position);
    if (!(uvz.z() > view.camera.near_m) || !uvz.allFinite()) continue;
    if (uvz.x() < 0 || uvz.x() > view.rgb.width || uvz.y() < 0 || uvz.y() > view.rgb.height) continue;
    std::vector<std::string> lines;
    std::istringstream text(label.text);
    for (std::string line; std::getline(text, line);) lines.push_back(printable(line));
    if (lines.empty()) continue;
    int baseline = 0, width = 0, height = 0;
    for (const auto& line : lines) {
      const cv::Size size = cv::getTextSize(line, cv::FONT_HERSHEY_DUPLEX, scale, weight, &baseline);
      width = std::max(width, size.width);
      height = std::max(height, size.height);
    }
    const int gap = static_cast<int>(12 * scale), step = height + baseline;
    const int below = step * (static_cast<int>(lines.size()) - 1);
    const int x = std::clamp(static_cast<int>(uvz.x()) + gap, 2, std::max(2, view.rgb.width - width - 2));
    int y = std::clamp(static_cast<int>(uvz.y()) - gap, height + 2,
                       std::max(height + 2, view.rgb.height - baseline - below - 2));
    for (const auto& line : lines) {
      const auto put = [&](const cv::Scalar& color, int thickness) {
        cv::putText(picture, line, {x, y}, cv::FONT_HERSHEY_DUPLEX, scale, color, thickness, cv::LINE_AA);
      };
      put({16, 18, 24}, weight + 2);
      put({245, 246, 250}, weight);
      y += step;
    }
  }
}

}  // namespace flowscope
