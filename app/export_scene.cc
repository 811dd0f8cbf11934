#include "app/export_scene.h"

#include <numbers>
#include <stdexcept>

#include "app/cli.h"
#include "recorder/scene_facts.h"
#include "render/renderer.h"

namespace flowscope {

struct ExportScenes::Scene {
  std::string name;
  DemoOrigin origin;
  std::shared_ptr<const Task> task;  ///< null: not here as it was
  std::string reason;                ///< why not
  std::string model_xml;
  std::unique_ptr<Renderer> renderer;
};

namespace {

/// Over the middle of the benchmark's workspace, or high enough over a user's own scene.
Eigen::Vector3d overhead_place(const Demo& demo) {
  if (!demo.info.origin.scene) return {0.25, 0, 2.05};
  const Eigen::Vector3d middle = (demo.bounds.min + demo.bounds.max) / 2, half = demo.bounds.max - middle;
  return middle + Eigen::Vector3d(0, 0, 2.5 * half.maxCoeff());
}

/// Upright: the top of its picture is far from the robot.
CameraModel overhead_camera(const CameraModel& like, const Eigen::Vector3d& place) {
  Eigen::Matrix3d axes;  // columns: x right, y down, z forward, seen from the world
  axes << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  CameraModel camera = CameraModel::from_vertical_fov(
      "overhead", like.width, like.height, std::numbers::pi / 4, {place, Eigen::Quaterniond(axes)});
  camera.near_m = like.near_m;
  camera.far_m = like.far_m;
  return camera;
}

Observation take_pictures(Renderer& renderer, const Demo& demo, int frame, bool overhead) {
  const SceneState& state = demo.frames.at(static_cast<std::size_t>(frame)).state;
  Observation observation;
  if (const Observation* own = stored_observation(demo, frame)) {
    observation = *own;
  } else {
    for (const View& view : demo.start.views) {
      const CameraModel& like = view.camera;
      observation.views.push_back(
          renderer.observe(state, renderer.camera(state, like.name, like.width, like.height)));
    }
  }
  if (overhead && !observation.views.empty()) {
    observation.views.push_back(
        renderer.observe(state, overhead_camera(observation.views.front().camera, overhead_place(demo))));
  }
  return observation;
}

}  // namespace

ExportScenes::ExportScenes(app::DemoScenes scenes, ExportPictures pictures)
    : scenes_(std::move(scenes)), pictures_(pictures) {}

ExportScenes::~ExportScenes() = default;

ExportSource ExportScenes::source_for(const Demo& demo) {
  if (!scene_ || scene_->name != demo.info.task || scene_->origin != demo.info.origin) {
    scene_ = std::make_shared<Scene>();
    scene_->name = demo.info.task;
    scene_->origin = demo.info.origin;
    try {
      scene_->task = app::DemoTasks(scenes_).get(demo.info);  // tasks of its own: compiles now, and last
      scene_->model_xml = mjcf_of_last_loaded(scene_->task->model());
      if (pictures_.every_frame) {
        scene_->renderer = std::make_unique<Renderer>(scene_->task->model(), demo.info.task);
      }
    } catch (const app::UsageError& error) {
      scene_->reason = error.what();
      if (scene_->reason.starts_with(demo.info.id + ": ")) scene_->reason.erase(0, demo.info.id.size() + 2);
    }
  }
  left_out_ = scene_->reason;
  if (scene_->task && !is_state_of(scene_->task->model(), demo.frames.front().state)) {
    left_out_ = "recorded in another version of the scene of " + scene_->name;
  }
  if (!left_out_.empty()) {
    if (pictures_.every_frame) throw std::invalid_argument(left_out_);
    return {};
  }
  ExportSource source;
  const RobotDescription& robot = scene_->task->robot();
  source.model_xml = scene_->model_xml;
  source.robot = robot.name;
  source.joints = robot.joints.size();
  if (!robot.fingers.empty()) {
    source.finger_open = robot.fingers.front().open;
    source.finger_closed = robot.fingers.front().closed;
  }
  source.object_state = [scene = scene_](const SceneState& state) {
    return object_state(scene->task->model(), scene->task->robot().tool, state);
  };
  if (pictures_.every_frame) {
    source.observe = [scene = scene_, overhead = pictures_.overhead](const Demo& shown, int frame) {
      return take_pictures(*scene->renderer, shown, frame, overhead);
    };
  }
  return source;
}

}  // namespace flowscope
