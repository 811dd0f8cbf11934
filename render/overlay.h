// Things drawn over a view, as plain data in world metres. Knows no policy type: web/app translate a trace
// into this.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "render/pose.h"

namespace flowscope {

using Rgba = std::array<float, 4>;  ///< each in [0, 1]

/// Colours carry meaning and mean the same in the picture, the curves and the numbers (web/ui/src/colors.ts
/// holds the twin).
namespace palette {
inline constexpr Rgba noise{0.55f, 0.36f, 0.96f, 1};          // violet: t = 0
inline constexpr Rgba action{0.98f, 0.75f, 0.14f, 1};         // amber: t = 1
inline constexpr Rgba region{0.13f, 0.83f, 0.93f, 0.22f};     // cyan: perception sphere
inline constexpr Rgba inside{0.13f, 0.83f, 0.93f, 1};         // cyan: points inside it
inline constexpr Rgba expert{0.29f, 0.87f, 0.50f, 1};         // green
inline constexpr Rgba prediction{0.98f, 0.75f, 0.14f, 0.7f};  // amber
inline constexpr Rgba failure{0.97f, 0.44f, 0.44f, 1};        // red
inline constexpr Rgba met{0.29f, 0.87f, 0.50f, 0.2f};         // green: a success term that holds
inline constexpr Rgba unmet{0.96f, 0.45f, 0.71f, 0.2f};       // pink: one that does not
}  // namespace palette

struct OverlaySphere {
  Eigen::Vector3d center{0, 0, 0};
  double radius_m = 0;
  Rgba color{};
};
struct OverlayBox {
  Pose world_from_box;
  Eigen::Vector3d half_size{0, 0, 0};  ///< metres
  Rgba color{};
};  ///< see-through, with its edges
struct OverlayLine {
  std::vector<Eigen::Vector3d> points;
  double width_m = 0.004;
  Rgba color{};
  Rgba color_end{};
};  ///< colour blends from first to last point
struct OverlayPoints {
  std::vector<Eigen::Vector3d> points;
  double size_m = 0.006;
  Rgba color{};
};
struct OverlayFrame {
  Pose world_from_frame;
  double length_m = 0.08;
  float alpha = 1;
};
struct OverlayGhost {
  Pose world_from_tool;
  double openness = 1;
  Rgba color{};
};  ///< a see-through gripper
struct OverlayLabel {
  Eigen::Vector3d position{0, 0, 0};
  std::string text;
};

struct Overlay {
  std::vector<OverlaySphere> spheres;
  std::vector<OverlayBox> boxes;
  std::vector<OverlayLine> lines;
  std::vector<OverlayPoints> points;
  std::vector<OverlayFrame> frames;
  std::vector<OverlayGhost> ghosts;
  std::vector<OverlayLabel> labels;
};

}  // namespace flowscope
