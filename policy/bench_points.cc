#include "policy/bench_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "policy/bench_timer.h"
#include "policy/farthest_points.h"
#include "policy/random.h"
#include "policy/region.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double table_z = 0.75;
constexpr int picture_side = 128;

struct Ball {
  Vector3d center;
  double radius;
};

std::vector<Ball> balls_on_table() {
  Random random(3);
  std::vector<Ball> balls;
  for (int i = 0; i < 24; ++i)
    balls.push_back(
        {{random.uniform(0, 0.5), random.uniform(-0.35, 0.35), table_z}, random.uniform(0.02, 0.09)});
  return balls;
}

/// Depth along the ray that has length 1 along z; far where nothing is met.
double depth_along(const Vector3d& origin, const Vector3d& ray, const std::vector<Ball>& balls) {
  double depth = ray.z() < 0 ? (table_z - origin.z()) / ray.z() : 10;
  for (const Ball& ball : balls) {
    const Vector3d o = origin - ball.center;
    const double a = ray.squaredNorm(), b = o.dot(ray), c = o.squaredNorm() - ball.radius * ball.radius;
    const double root = b * b - a * c;
    if (root > 0) depth = std::min(depth, (-b - std::sqrt(root)) / a);
  }
  return depth;
}

View look_down(const Vector3d& eye, double tilt_rad, const std::vector<Ball>& balls) {
  const Eigen::Quaterniond down(Eigen::AngleAxisd(std::numbers::pi + tilt_rad, Vector3d::UnitX()));
  View view;
  view.camera = CameraModel::from_vertical_fov("bench", picture_side, picture_side, 0.8, {eye, down});
  view.rgb = ImageRgb(picture_side, picture_side);
  view.depth = DepthImage(picture_side, picture_side);
  for (int y = 0; y < picture_side; ++y)
    for (int x = 0; x < picture_side; ++x) {
      const Vector3d ray = view.camera.unproject(x + 0.5, y + 0.5, 1) - eye;
      view.depth.at(x, y) = static_cast<float>(depth_along(eye, ray, balls));
      for (int c = 0; c < 3; ++c) view.rgb.at(x, y)[c] = static_cast<std::uint8_t>(80 + 40 * c + x / 2);
    }
  return view;
}

Observation four_pictures() {
  const std::vector<Ball> balls = balls_on_table();
  Observation o;
  for (int i = 0; i < 4; ++i)
    o.views.push_back(look_down({0.15 + 0.07 * i, 0.02 * i, 1.45 + 0.03 * i}, 0.05 * i - 0.08, balls));
  return o;
}

/// Greatest distance from any point to the nearest chosen one.
double coverage_mm(const std::vector<Vector3f>& position, const std::vector<int>& chosen) {
  float worst2 = 0;
  for (const Vector3f& p : position) {
    float nearest2 = std::numeric_limits<float>::max();
    for (const int i : chosen)
      nearest2 = std::min(nearest2, (p - position[static_cast<std::size_t>(i)]).squaredNorm());
    worst2 = std::max(worst2, nearest2);
  }
  return 1000 * std::sqrt(worst2);
}

}  // namespace

std::vector<BenchResult> bench_points(const OtherSampler* other, const PointBenchOptions& o) {
  const Observation pictures = four_pictures();
  const Box bounds{{-0.3, -0.7, table_z - 0.1}, {0.9, 0.7, 1.2}};
  NetworkShape shape;
  shape.scene_points = o.points;
  shape.image_tokens = o.chosen;
  shape.voxel_m = 0;
  PreparedScene scene;
  const double prepared = fastest_run_ms(2, [&] { scene = prepare_scene(pictures, bounds, shape); });
  std::vector<Vector3f> position;
  for (const ScenePoint& p : scene.points) position.push_back(p.position);

  const std::string size = std::to_string(o.chosen) + "_of_" + std::to_string(position.size());
  std::vector<BenchResult> results;
  std::optional<double> other_ms, other_mm;
  std::optional<std::string> name;
  if (other) {
    std::vector<int> chosen;
    name = other->name;
    other_ms = fastest_run_ms(2, [&] { chosen = other->choose(position, o.chosen); });
    other_mm = coverage_mm(position, chosen);
  }
  const auto against = [&](const std::optional<double>& theirs, double ours) {
    return theirs ? std::optional(*theirs / ours) : std::nullopt;
  };
  std::vector<int> chosen;
  for (const PointKernels* kernels : supported_point_kernels()) {
    const double ms =
        fastest_run_ms(o.repeats, [&] { chosen = farthest_points({position}, o.chosen, 0, kernels); });
    results.push_back({"farthest_" + size + "_" + kernels->name, ms, "ms", against(other_ms, ms), name});
  }
  const double coverage = coverage_mm(position, chosen);
  results.push_back({"farthest_coverage", coverage, "mm", against(other_mm, coverage), name});
  for (const float radius_m : {0.4f, 0.2f, 0.1f}) {
    const double ms = fastest_run_ms(o.repeats, [&] {
      select_region(scene.points, {0.25f, 0, table_z}, radius_m, o.chosen, false, SphereRule::farthest);
    });
    results.push_back({"region_" + std::to_string(std::lround(1000 * radius_m)) + "mm", ms, "ms", {}, {}});
  }
  results.push_back({"prepare_scene_" + std::to_string(position.size()), prepared, "ms", {}, {}});
  return results;
}

}  // namespace flowscope
