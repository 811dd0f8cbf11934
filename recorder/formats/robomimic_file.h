// robomimic's HDF5 layout: https://robomimic.github.io/docs/datasets/overview.html
//
//   data                     attributes total, env_args (JSON: env_name, env_type, env_kwargs)
//   data/demo_<i>            attributes num_samples, model_file (MJCF), task, variation, seed, instruction
//     states  (T,1+nq+nv)    time, qpos, qvel: MuJoCo's flattened state
//     actions (T,7)          step of the tool's position and rotation, gripper; within [-1, 1]
//     actions_abs (T,7)      the pose at the next frame: position, rotation vector; gripper
//     action_dict/           the same by parts: abs_pos, abs_rot_axis_angle, abs_rot_6d, rel_pos, …, gripper
//     rewards, dones (T)     1 at the last sample; no reward where the demonstration is unfinished
//     obs/, next_obs/        robot0_eef_pos, robot0_eef_quat (x,y,z,w), robot0_joint_pos, robot0_joint_vel
//                            (T,J), robot0_gripper_qpos (T,2), object; obs/ on request also <camera>_image
//                            (T,H,W,3), <camera>_depth (T,H,W,1; metres), <camera>_extrinsics (T,4,4)
//     flowscope/             demo_arrays.h: what an import reads
//   mask/train, valid, <task>, and unfinished, whose demonstrations are in neither of the first two
//
// J is the arm's number of joints, 6 of a UR5. robomimic takes every shape from the first demonstration, so
// robots of different J do not go into one file. A gripper has two numbers: its first finger's joint (m, rad
// where it is a hinge) and the negative of that.
//
// N frames make T = N - 1 samples: sample t goes from frame t to frame t + 1.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "recorder/formats/export_source.h"
#include "recorder/formats/hdf5_file.h"

namespace flowscope {

/// Writes demonstration after demonstration, one in memory at a time. Throws std::invalid_argument (see
/// arrays_of), or std::runtime_error that names the file and the place.
class RobomimicWriter {
 public:
  explicit RobomimicWriter(const std::filesystem::path& file);
  /// `source.observe` empty: without pictures in obs/.
  void add(const Demo& demo, const ExportSource& source);
  /// Totals and masks; every tenth demonstration, and at least one of several, is for validation. The file
  /// appears now, once `check` has seen it.
  void finish(const FileCheck& check = {});

 private:
  void require_same_joints(std::size_t joints);
  void write_samples(const std::string& group, const Demo& demo, const ExportSource& source);
  void write_pictures(const std::string& group, const Demo& demo, const ExportSource& source);

  Hdf5Writer file_;
  std::vector<std::string> tasks_;  ///< of each demonstration
  std::vector<bool> unfinished_;    ///< each of them
  std::vector<std::string> cameras_, robots_;
  std::size_t joints_ = 0;  ///< of the robots
  std::int64_t samples_ = 0;
  std::string simulator_;
};

/// The demonstrations of a file that RobomimicWriter wrote. Throws std::runtime_error naming the file and the
/// place.
class RobomimicReader {
 public:
  explicit RobomimicReader(const std::filesystem::path& file);
  int count() const { return static_cast<int>(names_.size()); }
  Demo read(int index) const;

 private:
  std::filesystem::path path_;
  Hdf5Reader file_;
  std::vector<std::string> names_;
};

}  // namespace flowscope
