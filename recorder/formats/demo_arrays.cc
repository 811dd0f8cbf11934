#include "recorder/formats/demo_arrays.h"

#include <algorithm>
#include <cctype>

#include "recorder/demo_file.h"
#include "recorder/formats/demo_array_parts.h"

namespace flowscope {
namespace {

/// Puts one row per item together.
class Rows {
 public:
  template <typename Items, typename Row>
  void add(const std::string& name, const Items& items, Row&& row) {
    using T = typename std::decay_t<decltype(row(items.front()))>::value_type;
    std::vector<T> values;
    std::uint64_t width = 0;
    for (const auto& item : items) {
      const auto one = row(item);
      width = one.size();
      values.insert(values.end(), one.begin(), one.end());
    }
    add_values<T>(name, items.size(), width, values);
  }
  /// A width of 1 is a vector, not a matrix of one column, unless `matrix`.
  template <typename T>
  void add_values(const std::string& name, std::uint64_t count, std::uint64_t width,
                  const std::vector<T>& values, bool matrix = false) {
    std::vector<std::uint64_t> shape{count};
    if (width != 1 || matrix) shape.push_back(width);
    arrays.push_back(make_array<T>(name, shape, values));
  }
  std::vector<NamedArray> arrays;
};

using Numbers = std::vector<double>;

Numbers position_of(const Pose& pose) { return {pose.position.x(), pose.position.y(), pose.position.z()}; }
Numbers wxyz_of(const Pose& pose) {
  const Eigen::Vector4d q = pose.wxyz();
  return {q[0], q[1], q[2], q[3]};
}

/// The arm's joints, and no more: what a frame holds beyond them is 0.
void add_joints(const std::string& name, const std::vector<Frame>& frames, std::array<double, 7> Frame::*part,
                std::size_t joints, Rows& rows) {
  Numbers values;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::array<double, 7>& all = frames[i].*part;
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(joints);
    if (std::any_of(end, all.end(), [](double value) { return value != 0; })) {
      throw std::invalid_argument("frame " + std::to_string(i) + " holds more than the " +
                                  std::to_string(joints) + " joints of its robot");
    }
    values.insert(values.end(), all.begin(), end);
  }
  rows.add_values<double>(name, frames.size(), joints, values, true);
}

void add_frames(const std::vector<Frame>& frames, std::size_t joints, Rows& rows) {
  rows.add("frame/time_s", frames, [](const Frame& f) { return Numbers{f.time_s}; });
  add_joints("frame/q", frames, &Frame::q, joints, rows);
  add_joints("frame/dq", frames, &Frame::dq, joints, rows);
  rows.add("frame/openness", frames, [](const Frame& f) { return Numbers{f.openness}; });
  rows.add("frame/gripper_open", frames, [](const Frame& f) { return Bytes{std::uint8_t(f.gripper_open)}; });
  rows.add("frame/tool_position", frames, [](const Frame& f) { return position_of(f.world_from_tool); });
  rows.add("frame/tool_quaternion", frames, [](const Frame& f) { return wxyz_of(f.world_from_tool); });
  rows.add("state/time_s", frames, [](const Frame& f) { return Numbers{f.state.time_s}; });
  for_each_state_part([&](const std::string& name, auto part) {
    using T = typename std::decay_t<decltype(SceneState{}.*part)>::value_type;
    std::vector<T> values;
    for (const Frame& f : frames) values.insert(values.end(), (f.state.*part).begin(), (f.state.*part).end());
    rows.add_values<T>(name, frames.size(), frames.empty() ? 0 : (frames.front().state.*part).size(), values,
                       true);
  });
}

void add_keyframes(const std::vector<Keyframe>& keyframes, Rows& rows) {
  rows.add("keyframe/frame", keyframes, [](const Keyframe& k) { return std::vector<std::int32_t>{k.frame}; });
  rows.add("keyframe/position", keyframes,
           [](const Keyframe& k) { return position_of(k.action.world_from_tool); });
  rows.add("keyframe/quaternion", keyframes,
           [](const Keyframe& k) { return wxyz_of(k.action.world_from_tool); });
  rows.add("keyframe/openness", keyframes, [](const Keyframe& k) { return Numbers{k.action.openness}; });
}

template <typename Matrix>
void append(Numbers& out, const Matrix& matrix) {
  for (int r = 0; r < matrix.rows(); ++r)
    for (int c = 0; c < matrix.cols(); ++c) out.push_back(matrix(r, c));
}

void add_camera(const std::vector<const Observation*>& observations, std::size_t view, Rows& rows) {
  const CameraModel& first = observations.front()->views[view].camera;
  const std::string name = "observation/" + first.name;
  const std::uint64_t count = observations.size(), height = static_cast<std::uint64_t>(first.height),
                      width = static_cast<std::uint64_t>(first.width);
  Bytes rgb;
  std::vector<float> depth;
  Numbers intrinsics, extrinsics;
  for (const Observation* observation : observations) {
    const View& shown = observation->views[view];
    rgb.insert(rgb.end(), shown.rgb.data.begin(), shown.rgb.data.end());
    depth.insert(depth.end(), shown.depth.data.begin(), shown.depth.data.end());
    append(intrinsics, intrinsic_matrix(shown.camera));
    append(extrinsics, matrix_of(shown.camera.world_from_camera));
  }
  rows.arrays.push_back(make_array<std::uint8_t>(name + "_rgb", {count, height, width, 3}, rgb));
  rows.arrays.push_back(make_array<float>(name + "_depth", {count, height, width}, depth));
  rows.arrays.push_back(make_array<double>(name + "_intrinsics", {count, 3, 3}, intrinsics));
  rows.arrays.push_back(make_array<double>(name + "_extrinsics", {count, 4, 4}, extrinsics));
}

}  // namespace

bool is_plain_name(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-';
  });
}

Eigen::Matrix3d intrinsic_matrix(const CameraModel& camera) {
  Eigen::Matrix3d k;
  k << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return k;
}

Eigen::Matrix4d matrix_of(const Pose& pose) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = pose.rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = pose.position;
  return m;
}

std::vector<NamedArray> arrays_of(const Demo& demo, ArrayParts parts) {
  const DemoHeader header = describe_demo(demo);
  require_same_cameras<std::invalid_argument>(header);
  Rows rows;
  rows.arrays.push_back(text_array("header", to_json_text(header)));
  add_frames(demo.frames, stored_joints(header.info), rows);
  if (!demo.keyframes.empty()) add_keyframes(demo.keyframes, rows);
  if (parts == ArrayParts::without_pictures) return std::move(rows.arrays);
  std::vector<const Observation*> observations{&demo.start};
  for (const Keyframe& keyframe : demo.keyframes) observations.push_back(&keyframe.observation);
  for (std::size_t v = 0; v < demo.start.views.size(); ++v) add_camera(observations, v, rows);
  return std::move(rows.arrays);
}

}  // namespace flowscope
