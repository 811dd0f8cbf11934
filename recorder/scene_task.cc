#include "recorder/scene_task.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "recorder/frame_time.h"
#include "recorder/motion/kinematics.h"
#include "recorder/scene_edit.h"
#include "recorder/scene_facts.h"
#include "recorder/scene_files.h"
#include "recorder/scene_origin.h"
#include "recorder/world_robot.h"

namespace flowscope {
namespace {

constexpr double kLongestStep_s = 0.005;

class NoTerms : public SuccessCheck {
 public:
  bool update(const mjModel*, const mjData*, const std::vector<std::string>&) override { return false; }
  std::vector<SuccessTerm> terms() const override { return {}; }
};

class SceneTask : public Task {
 public:
  SceneTask(std::string name, std::string instruction, ModelPtr model, RobotDescription robot,
            std::vector<double> start, SceneOrigin origin)
      : name_(std::move(name)),
        instruction_(std::move(instruction)),
        model_(std::move(model)),
        robot_(std::move(robot)),
        start_(std::move(start)),
        origin_(std::move(origin)) {
    // A recorded frame is a whole number of physics steps.
    const double steps = std::ceil(frame_s / std::min(model_->opt.timestep, kLongestStep_s) - 1e-9);
    model_->opt.timestep = frame_s / steps;
    if (!robot_.joints.empty()) Kinematics::from_model(model_.get(), robot_);
    WorldRobot(model_.get(), robot_);
  }

  const std::string& name() const override { return name_; }
  int variations() const override { return 1; }
  std::vector<std::string> instructions(int) const override { return {instruction_}; }
  Box bounds() const override {
    const Eigen::Vector3d center(model_->stat.center), half = Eigen::Vector3d::Constant(model_->stat.extent);
    return {center - half, center + half};
  }
  int keyframes() const override { return 30; }
  const mjModel* model() const override { return model_.get(); }
  const RobotDescription& robot() const override { return robot_; }
  DemoOrigin origin() const override {
    DemoOrigin origin = Task::origin();
    origin.scene = origin_;
    return origin;
  }

  Episode reset(mjModel* model, mjData* data, int variation, std::uint64_t seed) const override {
    if (variation != 0) throw std::invalid_argument("the scene " + name_ + " has variation 0 only");
    std::copy_n(model_->mat_rgba, 4 * model_->nmat, model->mat_rgba);
    std::copy_n(model_->eq_active, model_->neq, model->eq_active);
    std::copy_n(model_->eq_data, mjNEQDATA * model_->neq, model->eq_data);
    std::copy(start_.begin(), start_.end(), data->qpos);
    WorldRobot(model, robot_).go_home(data);
    mj_kinematics(model, data);
    return {name_, variation, seed, {instruction_}, {}, ""};
  }
  std::unique_ptr<SuccessCheck> success(const mjModel*, const mjData*, const Episode&) const override {
    return std::make_unique<NoTerms>();
  }

 private:
  std::string name_, instruction_;
  ModelPtr model_;
  RobotDescription robot_;
  std::vector<double> start_;  ///< positions that it begins with
  SceneOrigin origin_;
};

std::string scene_name(const std::filesystem::path& file) {
  std::string name = file.stem().string().substr(0, 64);
  for (char& c : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
    if (!plain) c = '_';
  }
  return name;
}

/// A user's description; none where there is no robot or it is one of ours.
std::filesystem::path robot_file(const std::string& robot, const std::filesystem::path& assets) {
  const bool is_ours = !std::filesystem::is_regular_file(robot) &&
                       std::filesystem::is_regular_file(assets / "robots" / (robot + ".yaml"));
  return is_ours ? "" : robot;
}

RobotDescription find_robot(const std::string& robot, const std::filesystem::path& assets) {
  if (robot.empty()) return {};
  const auto file = robot_file(robot, assets);
  return read_robot(file.empty() ? assets / "robots" / (robot + ".yaml") : file);
}

/// Name of an XML text's first element.
std::string root_element(const std::string& text) {
  std::size_t at = text.find('<');
  while (at + 1 < text.size() && !std::isalpha(static_cast<unsigned char>(text[at + 1]))) {
    at = text.find('<', text.compare(at, 4, "<!--") == 0 ? text.find("-->", at) : at + 1);
    if (at == std::string::npos) return "";
  }
  return at == std::string::npos ? "" : text.substr(at + 1, text.find_first_of(" \t\r\n/>", at) - at - 1);
}

std::shared_ptr<const Task> open(const SceneCall& call, const std::filesystem::path& assets) {
  RobotDescription robot = find_robot(call.robot, assets);
  SceneFiles files(assets);
  const ModelPtr table = files.compile(assets / "scenes" / "table.xml");
  const std::string text = read_text(call.scene);
  ModelPtr raw;
  if (root_element(text) == "robot") {
    std::string opened = text;
    try {
      opened = opened_urdf(text, call.scene.parent_path());
    } catch (const std::runtime_error&) {
      // no XML: MuJoCo says what is wrong with it
    }
    const auto place = call.scene.parent_path() / "flowscope-opened.urdf";
    files.add(place.filename().string(), opened);
    raw = files.compile(place);
  } else {
    raw = files.compile(call.scene);
  }
  const std::string completed =
      completed_scene(mjcf_of_last_loaded(raw.get()), raw.get(), table.get(), robot);
  // Under a name beside the scene, so that its meshes are found.
  const auto place = call.scene.parent_path() / "flowscope-completed.xml";
  files.add(place.filename().string(), completed);
  ModelPtr model = files.compile(place);
  if (raw->nlight == 0) model->vis.headlight = table->vis.headlight;
  std::vector<double> start(model->qpos0, model->qpos0 + model->nq);
  if (raw->nkey > 0 && raw->nq == model->nq) start.assign(raw->key_qpos, raw->key_qpos + raw->nq);
  return std::make_shared<SceneTask>(scene_name(call.scene), call.instruction, std::move(model),
                                     std::move(robot), std::move(start),
                                     scene_origin(call, raw.get(), robot_file(call.robot, assets)));
}

}  // namespace

std::shared_ptr<const Task> open_scene(const SceneCall& call, const std::filesystem::path& assets) {
  try {
    return open(call, assets);
  } catch (const BadScript&) {
    throw;
  } catch (const std::exception& error) {
    const std::string message = error.what(), file = call.scene.string();
    throw BadScript(message.starts_with(file) ? message : file + ": " + message);
  }
}

}  // namespace flowscope
