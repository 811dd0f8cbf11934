// Demonstrations of toy tasks on an analytic table: boxes and a plane, ray-cast into the benchmark's four
// cameras.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "policy/random.h"
#include "recorder/colors.h"
#include "recorder/demo.h"

namespace flowscope::testing {

inline constexpr double table_z = 0.752;

/// A coloured box standing anywhere, turned about z.
struct ToyBox {
  Eigen::Vector3d center, half;
  double yaw = 0;
  Eigen::Vector3d color;
};

inline Eigen::Vector3d rgb_of(const NamedColor& color) {
  return Eigen::Vector3f(color.rgb[0], color.rgb[1], color.rgb[2]).cast<double>();
}

/// Distance along the ray and the normal of the first hit, or infinity.
inline double hit_box(const ToyBox& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                      Eigen::Vector3d* normal) {
  const Eigen::Matrix3d world_from_box =
      Eigen::AngleAxisd(box.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d o = world_from_box.transpose() * (origin - box.center);
  const Eigen::Vector3d d = world_from_box.transpose() * direction;
  double near = -1e30, far = 1e30;
  Eigen::Vector3d n = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    const double inverse = 1 / (std::abs(d[a]) < 1e-12 ? 1e-12 : d[a]);
    double t0 = (-box.half[a] - o[a]) * inverse, t1 = (box.half[a] - o[a]) * inverse;
    if (t0 > t1) std::swap(t0, t1);
    if (t0 > near) near = t0, n = Eigen::Vector3d::Unit(a) * (d[a] > 0 ? -1 : 1);
    far = std::min(far, t1);
  }
  if (near > far || near < 1e-6) return std::numeric_limits<double>::infinity();
  *normal = world_from_box * n;
  return near;
}

inline View cast_view(const CameraModel& camera, const std::vector<ToyBox>& boxes) {
  View view{camera, ImageRgb(camera.width, camera.height), DepthImage(camera.width, camera.height)};
  const Eigen::Vector3d light = Eigen::Vector3d(-0.3, 0.2, 1).normalized();
  const Eigen::Vector3d origin = camera.world_from_camera.position;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d direction = camera.unproject(x + 0.5, y + 0.5, 1) - origin;  // length 1 along z
      double depth = (table_z - origin.z()) / direction.z();
      Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(), color(0.55, 0.45, 0.35);
      if (depth <= 0) depth = std::numeric_limits<double>::infinity();
      for (const ToyBox& box : boxes) {
        Eigen::Vector3d n;
        const double at = hit_box(box, origin, direction, &n);
        if (at < depth) depth = at, normal = n, color = box.color;
      }
      if (!std::isfinite(depth) || depth > camera.far_m) continue;
      view.depth.at(x, y) = static_cast<float>(depth);
      const double shade = 0.35 + 0.6 * std::max(0.0, normal.dot(light));
      for (int c = 0; c < 3; ++c)
        view.rgb.at(x, y)[c] = static_cast<std::uint8_t>(std::lround(255 * std::min(1.0, shade * color[c])));
    }
  }
  return view;
}

/// Camera that looks from `eye` at `target`, upright.
inline CameraModel toy_camera(const std::string& name, const Eigen::Vector3d& eye,
                              const Eigen::Vector3d& target, double fovy_deg, int size) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d(1e-3, 0, 1)).normalized();
  Eigen::Matrix3d m;
  m << x, z.cross(x), z;
  return CameraModel::from_vertical_fov(name, size, size, fovy_deg * std::numbers::pi / 180,
                                        {eye, Eigen::Quaterniond(m)});
}

inline Observation cast_scene(std::vector<ToyBox> boxes, const Pose& world_from_tool, int size = 128) {
  // A grey hand above the tool: it hides things, as the real one does.
  boxes.push_back({world_from_tool * Eigen::Vector3d(0, 0, -0.12), {0.03, 0.09, 0.05}, 0, {0.9, 0.9, 0.9}});
  Observation o;
  o.views.push_back(cast_view(toy_camera("front", {1.35, 0, 1.58}, {0.4, 0, 1.14}, 40, size), boxes));
  o.views.push_back(
      cast_view(toy_camera("left_shoulder", {-0.175, 0.20, 1.98}, {0.3, 0.1, 0.9}, 40, size), boxes));
  o.views.push_back(
      cast_view(toy_camera("right_shoulder", {-0.175, -0.20, 1.98}, {0.3, -0.1, 0.9}, 40, size), boxes));
  const Eigen::Vector3d wrist = world_from_tool.position + Eigen::Vector3d(0.07, 0, 0.06);
  o.views.push_back(
      cast_view(toy_camera("wrist", wrist, wrist - Eigen::Vector3d(0.01, 0, 1), 60, size), boxes));
  return o;
}

/// Tool pointing down, its x axis turned by yaw.
inline Eigen::Quaterniond tool_down(double yaw) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
}
inline Pose toy_home() { return {{0.278, -0.008, 1.15}, tool_down(0)}; }

/// Builds a demonstration keyframe by keyframe.
class ToyRecorder {
 public:
  ToyRecorder(std::string task, std::string instruction, const Box& bounds, std::uint64_t seed) {
    demo_.info.task = std::move(task);
    demo_.info.id = demo_.info.task + "-" + std::to_string(seed);
    demo_.info.seed = seed;
    demo_.info.instruction = std::move(instruction);
    demo_.instructions = {demo_.info.instruction};
    demo_.bounds = bounds;
    add_frame({toy_home(), 1});
  }
  void start(const std::vector<ToyBox>& boxes) { demo_.start = cast_scene(boxes, toy_home()); }
  void reach(const GripperAction& action, const std::vector<ToyBox>& boxes) {
    add_frame(action);
    demo_.keyframes.push_back(
        {static_cast<int>(demo_.frames.size()) - 1, action, cast_scene(boxes, action.world_from_tool)});
  }
  Demo finish() {
    demo_.info.frames = static_cast<int>(demo_.frames.size());
    demo_.info.keyframes = static_cast<int>(demo_.keyframes.size());
    return demo_;
  }

 private:
  void add_frame(const GripperAction& action) {
    Frame f;
    f.time_s = 0.05 * static_cast<double>(demo_.frames.size());
    f.world_from_tool = action.world_from_tool;
    f.openness = action.openness;
    f.gripper_open = action.openness > 0.95;
    for (std::size_t j = 0; j < f.q.size(); ++j)
      f.q[j] = action.world_from_tool.position[static_cast<int>(j) % 3] * (j < 3 ? 2 : 1);
    if (!demo_.frames.empty()) {  // speeds that tell the same story as the positions
      const Frame& before = demo_.frames.back();
      for (std::size_t j = 0; j < f.q.size(); ++j)
        f.dq[j] = 2 * (f.q[j] - before.q[j]) / (f.time_s - before.time_s) - before.dq[j];
    }
    demo_.frames.push_back(f);
  }
  Demo demo_;
};

/// `count` places on the table at least `apart` metres from each other.
inline std::vector<Eigen::Vector3d> toy_places(Random& random, int count, const Eigen::Vector2d& low,
                                               const Eigen::Vector2d& high, double apart) {
  std::vector<Eigen::Vector3d> places;
  while (static_cast<int>(places.size()) < count) {
    const Eigen::Vector3d p(random.uniform(low.x(), high.x()), random.uniform(low.y(), high.y()), table_z);
    bool free = true;
    for (const auto& q : places) free = free && (p - q).norm() > apart;
    if (free) places.push_back(p);
  }
  return places;
}

/// Three of the 20 colours; 1 to 3 of them are pushed in the order of the instruction.
inline Demo toy_push_buttons(std::uint64_t seed) {
  Random random(seed * 7919 + 1);
  std::vector<int> order;
  while (order.size() < 3) {
    const int c = random.below(static_cast<int>(benchmark_colors.size()));
    if (std::find(order.begin(), order.end(), c) == order.end()) order.push_back(c);
  }
  const int pushes = 1 + random.below(3);
  std::string text;
  for (int i = 0; i < pushes; ++i)
    text += std::string(i ? ", then push the " : "push the ") +
            std::string(benchmark_colors[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])].name) +
            " button";
  const auto places = toy_places(random, 3, {0.02, -0.32}, {0.48, 0.32}, 0.15);
  std::vector<ToyBox> boxes;
  for (std::size_t i = 0; i < 3; ++i) {
    const double yaw = random.uniform(-3, 3);
    boxes.push_back({places[i] + Eigen::Vector3d(0, 0, 0.0105), {0.05, 0.05, 0.0105}, yaw, {0.2, 0.2, 0.2}});
    boxes.push_back({places[i] + Eigen::Vector3d(0, 0, 0.026),
                     {0.025, 0.025, 0.006},
                     yaw,
                     rgb_of(benchmark_colors[static_cast<std::size_t>(order[i])])});
  }
  ToyRecorder recorder("push_buttons", text, {{0.025, -0.353, 0.770}, {0.475, 0.352, 0.846}}, seed);
  recorder.start(boxes);
  for (std::size_t i = 0; i < static_cast<std::size_t>(pushes); ++i) {
    recorder.reach({{{places[i].x(), places[i].y(), 0.8435}, tool_down(0)}, 0}, boxes);
    boxes[2 * i + 1].color = {0, 1, 0};
    boxes[2 * i + 1].center.z() -= 0.004;
    recorder.reach({{{places[i].x(), places[i].y(), 0.7785}, tool_down(0)}, 0}, boxes);
  }
  return recorder.finish();
}

/// A cabinet with three handles, turned by up to 22.5°; one drawer is opened: in front, at the handle,
/// pulled.
inline Demo toy_open_drawer(std::uint64_t seed) {
  Random random(seed * 7919 + 2);
  const double yaw = random.uniform(-0.39, 0.39);
  const int drawer = random.below(3);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d root(random.uniform(0.18, 0.30), random.uniform(-0.12, 0.02), table_z);
  const auto boxes_at = [&](double pulled) {
    std::vector<ToyBox> boxes{
        {root + Eigen::Vector3d(0, 0, 0.278), {0.19, 0.19, 0.19}, yaw, {0.6, 0.4, 0.2}}};
    for (int i = 0; i < 3; ++i) {
      const double out = i == drawer ? pulled : 0;
      const double z = 0.163 + 0.12 * i;
      boxes.push_back(
          {root + turn * Eigen::Vector3d(0, 0.195 + out, z), {0.05, 0.006, 0.008}, yaw, {0.8, 0.8, 0.8}});
      if (out > 0)
        boxes.push_back(
            {root + turn * Eigen::Vector3d(0, out, z), {0.18, 0.185, 0.055}, yaw, {0.65, 0.45, 0.25}});
    }
    return boxes;
  };
  const char* names[] = {"bottom", "middle", "top"};
  ToyRecorder recorder("open_drawer", std::string("open the ") + names[drawer] + " drawer",
                       {{0.103, -0.065, 0.914}, {0.366, 0.436, 1.229}}, seed);
  const Eigen::Vector3d handle = root + turn * Eigen::Vector3d(0, 0.195, 0.163 + 0.12 * drawer);
  Eigen::Matrix3d tool;  // looks along the cabinet's -y, fingers close up and down
  tool << turn * Eigen::Vector3d(1, 0, 0), turn * Eigen::Vector3d(0, 0, -1), turn * Eigen::Vector3d(0, -1, 0);
  tool.col(1) = tool.col(2).cross(tool.col(0));
  const Eigen::Quaterniond rotation(tool);
  recorder.start(boxes_at(0));
  recorder.reach({{handle + turn * Eigen::Vector3d(0, 0.087, 0), rotation}, 1}, boxes_at(0));
  recorder.reach({{handle, rotation}, 0}, boxes_at(0));
  recorder.reach({{handle + turn * Eigen::Vector3d(0, 0.237, 0), rotation}, 0}, boxes_at(0.237));
  return recorder.finish();
}

/// A square ring anywhere, three pegs on a base; the ring goes on the named peg.
inline Demo toy_ring_on_peg(std::uint64_t seed) {
  Random random(seed * 7919 + 3);
  const double base_yaw = random.uniform(-0.6, 0.6),
               ring_yaw = random.uniform(-std::numbers::pi, std::numbers::pi);
  const Eigen::Vector3d base(random.uniform(0.2, 0.3), random.uniform(-0.15, -0.05), table_z);
  const Eigen::Vector3d ring(random.uniform(0.08, 0.42), random.uniform(0.08, 0.25), table_z);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(base_yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::vector<int> colors;
  while (colors.size() < 3) {
    const int c = random.below(16);
    if (std::find(colors.begin(), colors.end(), c) == colors.end()) colors.push_back(c);
  }
  const int target = random.below(3);
  const auto color_of = [&](int i) {
    return benchmark_colors[static_cast<std::size_t>(colors[static_cast<std::size_t>(i)])];
  };
  const auto boxes_at = [&](const Pose& world_from_ring) {
    std::vector<ToyBox> boxes{
        {base + Eigen::Vector3d(0, 0, 0.01), {0.2, 0.05, 0.01}, base_yaw, {0.6, 0.6, 0.6}}};
    for (int i = 0; i < 3; ++i)
      boxes.push_back({base + turn * Eigen::Vector3d(0.125 * (i - 1), 0, 0.08),
                       {0.0125, 0.0125, 0.06},
                       base_yaw,
                       rgb_of(color_of(i))});
    const Eigen::Vector3d x = world_from_ring.rotation * Eigen::Vector3d::UnitX();
    const double yaw = std::atan2(x.y(), x.x());
    for (int i = 0; i < 4; ++i) {
      const double angle = yaw + i * std::numbers::pi / 2;
      const Eigen::Vector3d side(std::cos(angle), std::sin(angle), 0);
      boxes.push_back(
          {world_from_ring.position + 0.02 * side, {0.005, 0.025, 0.005}, angle, {0.5, 0.35, 0.1}});
    }
    return boxes;
  };
  // Of the ring's four equal yaws, the one nearest to the tool's.
  const double quarter = std::numbers::pi / 2;
  const double grasp_yaw = ring_yaw - quarter * std::round(ring_yaw / quarter);
  const double peg_yaw = base_yaw + quarter * std::round((grasp_yaw - base_yaw) / quarter);
  const Eigen::Vector3d peg = base + turn * Eigen::Vector3d(0.125 * (target - 1), 0, 0);
  const auto at = [](const Eigen::Vector3d& p, double z, double yaw) {
    return Pose{{p.x(), p.y(), z}, tool_down(yaw)};
  };
  const auto ring_at = [](const Pose& tool, double yaw) {
    return Pose{tool.position, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
  };
  ToyRecorder recorder("insert_onto_square_peg",
                       "put the ring on the " + std::string(color_of(target).name) + " spoke",
                       {{-0.027, -0.349, 0.753}, {0.493, 0.360, 0.969}}, seed);
  const Pose lying{ring + Eigen::Vector3d(0, 0, 0.005),
                   Eigen::Quaterniond(Eigen::AngleAxisd(ring_yaw, Eigen::Vector3d::UnitZ()))};
  recorder.start(boxes_at(lying));
  recorder.reach({at(ring, 0.859, grasp_yaw), 1}, boxes_at(lying));
  recorder.reach({at(ring, 0.759, grasp_yaw), 0}, boxes_at(lying));
  const Pose lifted = at(ring, 0.962, grasp_yaw), above = at(peg, 0.962, peg_yaw),
             down = at(peg, 0.881, peg_yaw);
  recorder.reach({lifted, 0}, boxes_at(ring_at(lifted, grasp_yaw)));
  recorder.reach({above, 0}, boxes_at(ring_at(above, peg_yaw)));
  recorder.reach({down, 1}, boxes_at(ring_at(down, peg_yaw)));
  return recorder.finish();
}

inline Demo toy_demo(const std::string& task, std::uint64_t seed) {
  if (task == "open_drawer") return toy_open_drawer(seed);
  if (task == "insert_onto_square_peg") return toy_ring_on_peg(seed);
  return toy_push_buttons(seed);
}

}  // namespace flowscope::testing
