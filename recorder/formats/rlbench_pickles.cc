#include "recorder/formats/rlbench_pickles.h"

#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/pickle_writer.h"
#include "recorder/formats/rlbench_camera.h"

namespace flowscope {
namespace {

using Numbers = std::vector<double>;

NamedArray vector_of(const Numbers& values) { return make_array<double>("", {values.size()}, values); }

template <int N>
NamedArray matrix_array(const Eigen::Matrix<double, N, N>& matrix) {
  const Eigen::Matrix<double, N, N> rows = matrix.transpose();
  return make_array<double>("", {N, N}, {rows.data(), N * N});
}

Numbers pose_xyzw(const Pose& pose) {
  const Eigen::Vector3d& p = pose.position;
  const Eigen::Vector4d wxyz = pose.wxyz();
  return {p.x(), p.y(), p.z(), wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
}

void write_cameras(const std::vector<CameraModel>& cameras, PickleWriter& out) {
  for (const CameraModel& camera : cameras) {
    const std::string name = camera.name + "_camera_";
    out.text(name + "extrinsics");
    out.array(matrix_array<4>(rlbench_extrinsics(camera)));
    out.text(name + "intrinsics");
    out.array(matrix_array<3>(rlbench_intrinsics(camera)));
    out.text(name + "near");
    out.number(camera.near_m);
    out.text(name + "far");
    out.number(camera.far_m);
  }
}

void write_observation(const RlbenchMoment& moment, std::ptrdiff_t joints, const ExportSource& source,
                       PickleWriter& out) {
  const Frame& frame = *moment.frame;
  const auto attribute = [&](const char* name, const NamedArray& value) {
    out.text(name);
    out.array(value);
  };
  const auto none = [&](const std::string& name) {
    out.text(name);
    out.none();
  };
  // Pictures lie beside the pickle; whoever loads an episode puts them here.
  for (const char* camera : {"left_shoulder", "right_shoulder", "overhead", "wrist", "front"}) {
    for (const char* kind : {"_rgb", "_depth", "_mask", "_point_cloud"}) none(std::string(camera) + kind);
  }
  attribute("joint_velocities", vector_of({frame.dq.begin(), frame.dq.begin() + joints}));
  attribute("joint_positions", vector_of({frame.q.begin(), frame.q.begin() + joints}));
  none("joint_forces");
  out.text("gripper_open");
  out.number(frame.gripper_open ? 1 : 0);
  attribute("gripper_pose", vector_of(pose_xyzw(frame.world_from_tool)));
  attribute("gripper_matrix", matrix_array<4>(matrix_of(frame.world_from_tool)));
  const double finger = source.finger(frame.openness);
  attribute("gripper_joint_positions", vector_of({finger, finger}));
  none("gripper_touch_forces");
  if (source.object_state) {
    attribute("task_low_dim_state", vector_of(source.object_state(frame.state)));
  } else {
    none("task_low_dim_state");
  }
  attribute("ignore_collisions", make_array<double>("", {}, Numbers{1}));
  out.text("misc");
  out.dictionary([&] { write_cameras(moment.cameras, out); });
}

}  // namespace

Bytes rlbench_low_dim_pickle(const Demo& demo, const std::vector<RlbenchMoment>& moments,
                             const ExportSource& source) {
  PickleWriter out;
  const auto joints = static_cast<std::ptrdiff_t>(joints_of(demo, source));
  out.object("rlbench.demo", "Demo", [&] {
    out.text("_observations");
    out.list([&] {
      for (const RlbenchMoment& moment : moments) {
        out.object("rlbench.backend.observation", "Observation",
                   [&] { write_observation(moment, joints, source, out); });
      }
    });
    out.text("random_seed");
    out.none();
    out.text("num_reset_attempts");
    out.none();
    out.text("variation_number");
    out.integer(demo.info.variation);
  });
  return out.finish();
}

Bytes rlbench_variation_pickle(const Demo& demo) {
  PickleWriter out;
  out.integer(demo.info.variation);
  return out.finish();
}

Bytes rlbench_descriptions_pickle(const Demo& demo) {
  PickleWriter out;
  out.list([&] {
    for (const std::string& instruction : demo.instructions) out.text(instruction);
  });
  return out.finish();
}

}  // namespace flowscope
