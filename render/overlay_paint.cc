#include "render/overlay_paint.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace flowscope {

namespace {

struct Disc {
  double u, v, z;  ///< centre in pixels, depth in metres
  double radius;   ///< pixels
  Rgba color;
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
      const double shade = disc.radius > 2 && distance > disc.radius - 1 ? 0.6 : 1.0;
      std::uint8_t* pixel = view.rgb.at(x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        pixel[c] = static_cast<std::uint8_t>(std::lround(
            pixel[c] * (1 - opacity) + 255.0 * shade * std::clamp(disc.color[c], 0.0f, 1.0f) * opacity));
      }
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
    const std::string text = printable(label.text);
    int baseline = 0;
    const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, scale, weight, &baseline);
    const int gap = static_cast<int>(12 * scale);
    const int x =
        std::clamp(static_cast<int>(uvz.x()) + gap, 2, std::max(2, view.rgb.width - size.width - 2));
    const int y = std::clamp(static_cast<int>(uvz.y()) - gap, size.height + 2,
                             std::max(size.height + 2, view.rgb.height - baseline - 2));
    cv::putText(picture, text, {x, y}, cv::FONT_HERSHEY_DUPLEX, scale, {16, 18, 24}, weight + 2, cv::LINE_AA);
    cv::putText(picture, text, {x, y}, cv::FONT_HERSHEY_DUPLEX, scale, {245, 246, 250}, weight, cv::LINE_AA);
  }
}

}  // namespace flowscope
