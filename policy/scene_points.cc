#include "policy/scene_points.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "policy/farthest_points.h"
#include "policy/part_middles.h"
#include "policy/random.h"
#include "policy/recolor.h"
#include "policy/things.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct Candidate {
  ScenePoint point;
  int view = 0, x = 0, y = 0;
  float salience = 1;  ///< of its squared distance in the farthest-point order: the plane counts less
};

constexpr float plane_thickness_m = 0.004f;

void require_sane(const Observation& observation) {
  if (observation.views.empty()) throw std::invalid_argument("the observation has no view");
  for (const View& v : observation.views) {
    const auto pixels = static_cast<std::size_t>(v.camera.width) * v.camera.height;
    if (pixels == 0 || v.rgb.data.size() != pixels * 3 || v.depth.data.size() != pixels)
      throw std::invalid_argument("view '" + v.camera.name + "': picture, depth and camera differ in size");
  }
}

/// A view, and where its pixels stand if not where its camera says.
struct PlacedView {
  const View& view;
  const std::vector<Vector3d>* world = nullptr;
  Vector3d at(int x, int y) const {
    if (world) return (*world)[static_cast<std::size_t>(y) * view.camera.width + x];
    return view.camera.unproject(x + 0.5, y + 0.5, view.depth.at(x, y));
  }
};

PlacedView placed(const Observation& observation, const PixelPlaces* places, std::size_t v) {
  return {observation.views[v], places ? &(*places)[v] : nullptr};
}

// Normal from the pixels two to the side, towards the camera; zero where the surface breaks off.
Vector3f normal_at(const PlacedView& placed_view, int x, int y) {
  const View& view = placed_view.view;
  const int x0 = std::max(x - 1, 0), x1 = std::min(x + 1, view.camera.width - 1);
  const int y0 = std::max(y - 1, 0), y1 = std::min(y + 1, view.camera.height - 1);
  for (const auto& [px, py] : {std::pair{x0, y}, {x1, y}, {x, y0}, {x, y1}})
    if (std::abs(view.depth.at(px, py) - view.depth.at(x, y)) > 0.03f) return Vector3f::Zero();
  const Vector3d right = placed_view.at(x1, y) - placed_view.at(x0, y);
  const Vector3d down = placed_view.at(x, y1) - placed_view.at(x, y0);
  const Vector3d n = down.cross(right);
  const double length = n.norm();
  if (length < 1e-12) return Vector3f::Zero();
  const Vector3d to_camera = view.camera.world_from_camera.position - placed_view.at(x, y);
  return ((n.dot(to_camera) < 0 ? -1 : 1) / length * n).cast<float>();
}

std::vector<Candidate> collect(const Observation& observation, const PixelPlaces* places,
                               const Box& workspace) {
  std::vector<Candidate> out;
  for (std::size_t v = 0; v < observation.views.size(); ++v) {
    const View& view = observation.views[v];
    const PlacedView place = placed(observation, places, v);
    for (int y = 0; y < view.camera.height; ++y) {
      for (int x = 0; x < view.camera.width; ++x) {
        const float depth = view.depth.at(x, y);
        if (!std::isfinite(depth) || depth <= 0) continue;
        const Vector3d p = place.at(x, y);
        if (!workspace.contains(p)) continue;
        const std::uint8_t* rgb = view.rgb.at(x, y);
        out.push_back({{p.cast<float>(), Vector3f(rgb[0], rgb[1], rgb[2]) / 255.f, Vector3f::Zero(), {}},
                       static_cast<int>(v),
                       x,
                       y});
      }
    }
  }
  return out;
}

// Height of the fullest 5 mm layer: the table, where one is in view.
float dominant_plane(const std::vector<Candidate>& all, const Box& workspace) {
  constexpr float layer_m = 0.005f;
  std::vector<int> count(static_cast<std::size_t>((workspace.max.z() - workspace.min.z()) / layer_m) + 2);
  const auto floor_z = static_cast<float>(workspace.min.z());
  for (const Candidate& c : all)
    ++count[static_cast<std::size_t>((c.point.position.z() - floor_z) / layer_m)];
  const auto fullest = std::max_element(count.begin(), count.end()) - count.begin();
  return floor_z + (static_cast<float>(fullest) + 0.5f) * layer_m;
}

bool lies_on(float plane_z, const Vector3f& p) { return std::abs(p.z() - plane_z) < plane_thickness_m; }

// One point per cell: the one nearest to the cell's centre, so positions stay measured ones. All of them
// where the cells have no size.
std::vector<Candidate> thin(std::vector<Candidate> all, float plane_z, double voxel_m) {
  for (Candidate& c : all) c.salience = lies_on(plane_z, c.point.position) ? 0.004f : 1.f;
  if (voxel_m <= 0) return all;
  struct Cell {
    std::size_t index;
    float distance2;
  };
  std::unordered_map<std::uint64_t, std::size_t> slot_of;
  slot_of.reserve(all.size());
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Vector3f& p = all[i].point.position;
    const bool on_plane = lies_on(plane_z, p);
    const float side = static_cast<float>(on_plane ? 5 * voxel_m : voxel_m);
    const Eigen::Vector3i cell = (p.array() / side).floor().cast<int>();
    std::uint64_t key = on_plane ? 1 : 0;
    for (int a = 0; a < 3; ++a) key = key << 20 | (static_cast<std::uint64_t>(cell[a] + (1 << 19)) & 0xFFFFF);
    const float d2 = (p - (cell.cast<float>().array() + 0.5f).matrix() * side).squaredNorm();
    const auto [it, fresh] = slot_of.try_emplace(key, cells.size());
    if (fresh)
      cells.push_back({i, d2});
    else if (d2 < cells[it->second].distance2)
      cells[it->second] = {i, d2};
  }
  std::vector<Candidate> out;
  out.reserve(cells.size());
  for (const Cell& c : cells) out.push_back(all[c.index]);
  return out;
}

// Farthest-point order in position and colour (a full change of colour counts as 20 cm) for the first `even`
// points.
std::vector<Candidate> in_farthest_order(std::vector<Candidate> points, int even) {
  Random shuffle(7);
  for (std::size_t i = points.size(); i > 1; --i)
    std::swap(points[i - 1], points[static_cast<std::size_t>(shuffle.below(static_cast<int>(i)))]);
  std::vector<Vector3f> position, color;
  std::vector<float> salience;
  for (const Candidate& c : points) {
    position.push_back(c.point.position);
    color.push_back(c.point.color);
    salience.push_back(c.salience);
  }
  const FarthestInput input{
      .position = position, .color = color, .salience = salience, .color_weight = 0.04f};
  std::vector<Candidate> ordered;
  ordered.reserve(points.size());
  for (const int i : farthest_order(input, even)) ordered.push_back(points[static_cast<std::size_t>(i)]);
  return ordered;
}

Patch patch_around(const View& view, int x, int y) {
  Patch patch{};
  std::size_t k = 0;
  for (int j = 0; j < patch_side; ++j) {
    for (int i = 0; i < patch_side; ++i) {
      const int px = std::clamp(x + 2 * i - patch_side + 1, 0, view.camera.width - 1);
      const int py = std::clamp(y + 2 * j - patch_side + 1, 0, view.camera.height - 1);
      for (int c = 0; c < 3; ++c) patch[k++] = static_cast<float>(view.rgb.at(px, py)[c]) / 255.f;
    }
  }
  return patch;
}

}  // namespace

Box workspace_of(const Box& bounds) {
  return {bounds.min - Vector3d(0.2, 0.2, 0.1), bounds.max + Vector3d(0.2, 0.2, 0.1)};
}

PreparedScene prepare_scene(const Observation& observation, const Box& bounds, const NetworkShape& shape,
                            const PixelPlaces* places) {
  require_sane(observation);
  const Box workspace = workspace_of(bounds);
  std::vector<Candidate> all = collect(observation, places, workspace);
  if (all.empty())
    throw std::invalid_argument("no point of the observation lies inside the policy's workspace");
  PreparedScene scene;
  scene.plane_z = dominant_plane(all, workspace);
  std::vector<Candidate> points = in_farthest_order(thin(std::move(all), scene.plane_z, shape.voxel_m),
                                                    std::max(512, shape.image_tokens));
  points.resize(std::min<std::size_t>(points.size(), static_cast<std::size_t>(shape.scene_points)));
  scene.points.reserve(points.size());
  for (Candidate& c : points) {
    const View& view = observation.views[static_cast<std::size_t>(c.view)];
    c.point.normal = normal_at(placed(observation, places, static_cast<std::size_t>(c.view)), c.x, c.y);
    scene.points.push_back(c.point);
    if (scene.patches.size() < 2 * static_cast<std::size_t>(shape.image_tokens)) {
      scene.patches.push_back(patch_around(view, c.x, c.y));
      scene.patch_place.emplace_back(static_cast<float>(c.view), static_cast<float>(c.x) + 0.5f,
                                     static_cast<float>(c.y) + 0.5f);
    }
  }
  if (shape.image_branch == "clip") {
    auto pictures = std::make_shared<std::vector<ImageRgb>>();
    for (const View& view : observation.views) pictures->push_back(view.rgb);
    scene.pictures = std::move(pictures);
  }
  std::vector<Vector3f> position, color;
  std::vector<char> on_plane;
  for (const ScenePoint& p : scene.points) {
    position.push_back(p.position);
    color.push_back(p.color);
    on_plane.push_back(lies_on(scene.plane_z, p.position));
  }
  scene.thing = find_things(position, on_plane);
  scene.part = find_parts(position, color, on_plane);
  std::vector<Surroundings> around = find_surroundings(position, color, on_plane);
  if (shape.part_middles) center_small_parts(position, scene.part, around);
  for (std::size_t i = 0; i < scene.points.size(); ++i) scene.points[i].around = around[i];
  return scene;
}

}  // namespace flowscope
