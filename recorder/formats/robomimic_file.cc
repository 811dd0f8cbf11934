#include "recorder/formats/robomimic_file.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/frame_actions.h"
#include "recorder/formats/robomimic_samples.h"

namespace flowscope {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* exact_group = "/flowscope/";
constexpr int robosuite_type = 1;  // of robomimic's environment types the one whose states are MuJoCo's
constexpr int validation_every = 10;

std::string demo_name(std::size_t index) { return "demo_" + std::to_string(index); }

std::uint64_t pixels(int side) { return static_cast<std::uint64_t>(side); }

void add_new(std::vector<std::string>& names, const std::string& name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

NamedArray under(const std::string& group, NamedArray array) {
  array.name = group + "/" + array.name;
  return array;
}

}  // namespace

RobomimicWriter::RobomimicWriter(const std::filesystem::path& file) : file_(file) {
  file_.make_group("data");
}

void RobomimicWriter::add(const Demo& demo, const ExportSource& source) {
  if (demo.frames.size() < 2) throw std::invalid_argument("a demonstration of one frame has no action");
  require_same_joints(joints_of(demo, source));
  const std::string group = "data/" + demo_name(tasks_.size());
  for (NamedArray& array : arrays_of(demo, ArrayParts::all)) {
    file_.write(under(group, {exact_group + 1 + array.name, array.spec, std::move(array.data)}));
  }
  write_samples(group, demo, source);
  if (source.observe) write_pictures(group, demo, source);
  tasks_.push_back(demo.info.task);
  unfinished_.push_back(demo.info.unfinished());
  samples_ += static_cast<std::int64_t>(demo.frames.size()) - 1;
  simulator_ = demo.simulator;
  for (const View& view : demo.start.views) add_new(cameras_, view.camera.name);
  const std::string& robot = demo.info.origin.robot.empty() ? source.robot : demo.info.origin.robot;
  if (!robot.empty()) add_new(robots_, robot);
}

/// robomimic takes all shapes from the file's first demonstration.
void RobomimicWriter::require_same_joints(std::size_t joints) {
  if (tasks_.empty()) joints_ = joints;
  if (joints != joints_) {
    throw std::invalid_argument("its robot has " + std::to_string(joints) + " joints, that of those before " +
                                std::to_string(joints_) +
                                ": robomimic wants one shape in a file, so give "
                                "each robot a file of its own");
  }
}

void RobomimicWriter::write_samples(const std::string& group, const Demo& demo, const ExportSource& source) {
  for (NamedArray& array : robomimic_samples(demo, source)) file_.write(under(group, std::move(array)));
  file_.set_attribute(group, "num_samples", static_cast<std::int64_t>(demo.frames.size()) - 1);
  if (!source.model_xml.empty()) file_.set_attribute(group, "model_file", source.model_xml);
  file_.set_attribute(group, "task", demo.info.task);
  file_.set_attribute(group, "variation", std::int64_t{demo.info.variation});
  file_.set_attribute(group, "seed", std::to_string(demo.info.seed));  // may be above 2^63
  file_.set_attribute(group, "instruction", demo.info.instruction);
  const std::string actions = group + "/actions";
  file_.set_attribute(
      actions, "meaning",
      "step of the tool from this frame to the next, world frame: position / position_unit_m, "
      "rotation vector / rotation_unit_rad, gripper (-1 opens, 1 closes)");
  file_.set_attribute(actions, "position_unit_m", std::vector<double>{action_position_m});
  file_.set_attribute(actions, "rotation_unit_rad", std::vector<double>{action_rotation_rad});
  const auto steps = frame_actions(demo.frames);
  file_.set_attribute(actions, "clipped_samples",
                      std::int64_t{std::ranges::count_if(steps, &FrameAction::clipped)});
  file_.set_attribute(
      group + "/actions_abs", "meaning",
      "tool pose at the next frame, world frame: position in metres, rotation vector in radians "
      "(continuous, so it may be longer than pi), gripper (-1 opens, 1 closes)");
  file_.set_attribute(group + "/action_dict/abs_rot_6d", "meaning", "the rotation matrix's first two rows");
}

void RobomimicWriter::write_pictures(const std::string& group, const Demo& demo, const ExportSource& source) {
  const std::uint64_t samples = demo.frames.size() - 1;
  for (std::uint64_t t = 0; t < samples; ++t) {
    const Observation observation = source.observe(demo, static_cast<int>(t));
    for (const View& view : observation.views) {
      const CameraModel& camera = view.camera;
      if (!is_plain_name(camera.name)) {
        throw std::invalid_argument("camera \"" + camera.name + "\": not a plain name");
      }
      const std::string name = group + "/obs/" + camera.name;
      if (t == 0) {
        const std::uint64_t height = pixels(camera.height), width = pixels(camera.width);
        file_.create(name + "_image", {ArrayType::u8, {samples, height, width, 3}});
        file_.create(name + "_depth", {ArrayType::f32, {samples, height, width, 1}});
        file_.create(name + "_extrinsics", {ArrayType::f64, {samples, 4, 4}});
        file_.set_attribute(name + "_depth", "unit",
                            "metres along the camera's axis; 0 where nothing was hit");
        file_.set_attribute(name + "_extrinsics", "meaning", "world_from_camera: x right, y down, z forward");
        file_.set_attribute(name + "_image", "fx_fy_cx_cy",
                            std::vector<double>{camera.fx, camera.fy, camera.cx, camera.cy});
      }
      Bytes depth, extrinsics;
      put_all<float>(depth, view.depth.data);
      const Eigen::Matrix4d columns = matrix_of(camera.world_from_camera).transpose();
      put_all<double>(extrinsics, {columns.data(), 16});
      file_.write_row(name + "_image", t, view.rgb.data);
      file_.write_row(name + "_depth", t, depth);
      file_.write_row(name + "_extrinsics", t, extrinsics);
    }
  }
}

void RobomimicWriter::finish(const FileCheck& check) {
  std::map<std::string, std::vector<std::string>> masks{{"train", {}}, {"valid", {}}};
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const bool valid = i % validation_every == validation_every - 1 ||
                       (tasks_.size() < validation_every && tasks_.size() > 1 && i + 1 == tasks_.size());
    masks[unfinished_[i] ? "unfinished" : valid ? "valid" : "train"].push_back(demo_name(i));
    masks[tasks_[i]].push_back(demo_name(i));
  }
  for (const auto& [name, demos] : masks) file_.write_names("mask/" + name, demos);
  const bool one_task = std::ranges::all_of(tasks_, [&](const auto& task) { return task == tasks_.front(); });
  const Json controller{{"type", "OSC_POSE"},
                        {"position_unit_m", action_position_m},
                        {"rotation_unit_rad", action_rotation_rad}};
  const Json env_args{{"env_name", one_task && !tasks_.empty() ? tasks_.front() : "mixed"},
                      {"env_type", robosuite_type},
                      {"env_version", simulator_},
                      {"env_kwargs",
                       {{"robots", robots_},
                        {"control_freq", 20},
                        {"camera_names", cameras_},
                        {"controller_configs", controller}}}};
  file_.set_attribute("data", "total", samples_);
  file_.set_attribute("data", "env_args", env_args.dump());
  file_.close(check);
}

RobomimicReader::RobomimicReader(const std::filesystem::path& file) : path_(file), file_(file) {
  if (!file_.has("data"))
    throw std::runtime_error(path_.string() + ": has no group data: not robomimic's layout");
  names_ = file_.children("data");
  // demo_10 comes after demo_9.
  std::ranges::sort(names_, [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  for (const std::string& name : names_) {
    if (!file_.has("data/" + name + "/flowscope/header")) {
      throw std::runtime_error(
          path_.string() + ": data/" + name +
          " was not written by flowscope: it has no group flowscope with the exact frames");
    }
  }
}

Demo RobomimicReader::read(int index) const {
  const std::string group = "data/" + names_.at(static_cast<std::size_t>(index)) + exact_group;
  return demo_from_arrays(
      [&](const std::string& name, const ArraySpec& expected) { return file_.read(group + name, expected); },
      ArrayParts::all, path_.string() + ": " + group);
}

}  // namespace flowscope
