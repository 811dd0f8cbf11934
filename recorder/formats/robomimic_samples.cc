#include "recorder/formats/robomimic_samples.h"

#include <algorithm>

#include "recorder/formats/frame_actions.h"

namespace flowscope {
namespace {

using Numbers = std::vector<double>;

void append(Numbers& out, const Eigen::Vector3d& v) { out.insert(out.end(), v.begin(), v.end()); }

/// A row per item, all of one length.
template <typename Items, typename Row>
NamedArray table(const std::string& name, const Items& items, Row&& row) {
  Numbers values;
  std::uint64_t width = 0;
  for (const auto& item : items) {
    const Numbers one = row(item);
    width = one.size();
    values.insert(values.end(), one.begin(), one.end());
  }
  return make_array<double>(name, {items.size(), width}, values);
}

Numbers flattened(const SceneState& state) {
  Numbers values{state.time_s};
  values.insert(values.end(), state.qpos.begin(), state.qpos.end());
  values.insert(values.end(), state.qvel.begin(), state.qvel.end());
  return values;
}

Numbers with_gripper(const Eigen::Vector3d& position, const Eigen::Vector3d& rotation, double gripper) {
  Numbers values;
  append(values, position);
  append(values, rotation);
  values.push_back(gripper);
  return values;
}

/// The first two rows of the matrix, as PyTorch3D has it.
Numbers rotation_6d(const Eigen::Matrix3d& r) {
  return {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2)};
}

Eigen::Matrix3d matrix_of_vector(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
}

void add_actions(const std::vector<FrameAction>& actions, std::vector<NamedArray>& out) {
  const auto add = [&](const std::string& name, auto&& row) { out.push_back(table(name, actions, row)); };
  const auto vector = [](const Eigen::Vector3d& v) { return Numbers(v.begin(), v.end()); };
  using A = FrameAction;
  add("actions", [](const A& a) { return with_gripper(a.position_step, a.rotation_step, a.gripper); });
  add("actions_abs",
      [](const A& a) { return with_gripper(a.target.position, a.rotation_vector, a.gripper); });
  add("action_dict/abs_pos", [&](const A& a) { return vector(a.target.position); });
  add("action_dict/abs_rot_axis_angle", [&](const A& a) { return vector(a.rotation_vector); });
  add("action_dict/abs_rot_6d", [](const A& a) { return rotation_6d(a.target.rotation.toRotationMatrix()); });
  add("action_dict/rel_pos", [&](const A& a) { return vector(a.position_step); });
  add("action_dict/rel_rot_axis_angle", [&](const A& a) { return vector(a.rotation_step); });
  add("action_dict/rel_rot_6d",
      [](const A& a) { return rotation_6d(matrix_of_vector(a.rotation_step * action_rotation_rad)); });
  add("action_dict/gripper", [](const A& a) { return Numbers{a.gripper}; });
}

void add_observations(const std::string& group, std::span<const Frame> frames, std::ptrdiff_t joints,
                      const ExportSource& source, std::vector<NamedArray>& out) {
  const auto add = [&](const std::string& name, auto&& row) {
    out.push_back(table(group + name, frames, row));
  };
  add("robot0_eef_pos", [](const Frame& f) {
    const Eigen::Vector3d& p = f.world_from_tool.position;
    return Numbers(p.begin(), p.end());
  });
  add("robot0_eef_quat", [](const Frame& f) {  // robosuite's order: x, y, z, w
    const Eigen::Vector4d wxyz = f.world_from_tool.wxyz();
    return Numbers{wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
  });
  add("robot0_joint_pos", [&](const Frame& f) { return Numbers(f.q.begin(), f.q.begin() + joints); });
  add("robot0_joint_vel", [&](const Frame& f) { return Numbers(f.dq.begin(), f.dq.begin() + joints); });
  add("robot0_gripper_qpos", [&](const Frame& f) {  // robosuite counts the second finger downwards
    const double finger = source.finger(f.openness);
    return Numbers{finger, -finger};
  });
  if (source.object_state) add("object", [&](const Frame& f) { return source.object_state(f.state); });
}

}  // namespace

std::vector<NamedArray> robomimic_samples(const Demo& demo, const ExportSource& source) {
  const std::span<const Frame> frames = demo.frames;
  const std::size_t samples = frames.size() - 1;
  std::vector<NamedArray> out;
  out.push_back(table("states", frames.first(samples), [](const Frame& f) { return flattened(f.state); }));
  add_actions(frame_actions(demo.frames), out);
  Numbers rewards(samples, 0.0);
  std::vector<std::int64_t> dones(samples, 0);
  rewards.back() = demo.info.unfinished() ? 0 : 1;
  dones.back() = 1;
  out.push_back(make_array<double>("rewards", {samples}, rewards));
  out.push_back(make_array<std::int64_t>("dones", {samples}, dones));
  const auto joints = static_cast<std::ptrdiff_t>(joints_of(demo, source));
  add_observations("obs/", frames.first(samples), joints, source, out);
  add_observations("next_obs/", frames.last(samples), joints, source, out);
  return out;
}

}  // namespace flowscope
