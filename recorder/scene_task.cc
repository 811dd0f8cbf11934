#include "recorder/scene_task.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "recorder/frame_time.h"
#include "recorder/instruction.h"
#include "recorder/robot_check.h"
#include "recorder/scene_edit.h"
#include "recorder/scene_facts.h"
#include "recorder/scene_files.h"
#include "recorder/scene_origin.h"
#include "recorder/scene_start.h"
#include "recorder/urdf.h"
#include "recorder/urdf_mimic.h"
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
            StartState start, SceneOrigin origin)
      : name_(std::move(name)),
        instruction_(std::move(instruction)),
        model_(std::move(model)),
        robot_(std::move(robot)),
        start_(std::move(start)),
        origin_(std::move(origin)) {
    // A recorded frame is a whole number of physics steps.
    const double steps = std::ceil(frame_s / std::min(model_->opt.timestep, kLongestStep_s) - 1e-9);
    model_->opt.timestep = frame_s / steps;
    if (!robot_.joints.empty()) kinematics_of(model_.get(), robot_);
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
    begin_with(start_, data);
    WorldRobot(model, robot_).go_home(data);
    mj_kinematics(model, data);
    return {name_, variation, seed, {instruction_}, {}, ""};
  }
  bool settles() const override { return !robot_.joints.empty() && !start_.moves; }
  std::unique_ptr<SuccessCheck> success(const mjModel*, const mjData*, const Episode&) const override {
    return std::make_unique<NoTerms>();
  }

 private:
  std::string name_, instruction_;
  ModelPtr model_;
  RobotDescription robot_;
  StartState start_;
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

/// What a policy reads where nobody said what is to be done: the scene's name in words.
std::string instruction_of(const SceneCall& call) {
  if (!call.instruction.empty()) return call.instruction;
  std::string words;
  for (const std::string& word : split_words(call.scene.stem().string()))
    words += (words.empty() ? "" : " ") + word;
  return words.empty() ? "scene" : words;
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

/// A scene as its author wrote it, in MuJoCo's own words.
struct RawScene {
  ModelPtr model;
  std::string mjcf;
  SceneSource source;
  std::vector<JointCoupling> mimics;
};

RawScene read_urdf(const SceneCall& call, SceneFiles& files) {
  RawScene raw;
  raw.source = files.source(call.scene);
  if (!raw.source.unread.empty()) throw SceneError(raw.source.unread);
  const OpenedUrdf opened = opened_urdf(raw.source, call.note);
  for (const auto& [name, bytes] : opened.files) {
    if (!files.add(name, bytes))
      throw std::runtime_error("too many files for one scene, or two are called " + name);
  }
  raw.model = files.compile(opened.text, raw.source);
  raw.mjcf = dressed_urdf(mjcf_of_last_loaded(raw.model.get()), opened.skins);
  raw.mimics = read_mimics(raw.source);
  if (!raw.mimics.empty()) raw.mjcf = with_couplings(raw.mjcf, raw.model.get(), raw.mimics);
  // Its pictures and couplings are part of what it is.
  if (!opened.skins.empty() || !raw.mimics.empty()) raw.model = files.compile({raw.mjcf, {}}, raw.source);
  return raw;
}

RawScene read_mjcf(const SceneCall& call, SceneFiles& files) {
  RawScene raw;
  raw.model = files.compile(call.scene);
  raw.mjcf = mjcf_of_last_loaded(raw.model.get());
  try {
    raw.source = files.source(call.scene);
  } catch (const SceneError&) {  // MuJoCo read it all the same
    raw.source.files = {call.scene};
  }
  return raw;
}

void check_usable(const SceneCall& call, const RawScene& raw) {
  const mjModel* model = raw.model.get();
  const std::string file = call.scene.string();
  if (!(model->opt.timestep > 0)) throw SceneError(file + ": <option> has a timestep that is not above 0");
  if (model->ngeom == 0) {
    std::string why = "it has no <geom>";
    if (raw.source.root.tag == "robot") {
      why = "none of its links has a <visual> or <collision> with a shape";
      for (const auto& child : raw.source.root.children) {
        if (child.tag == "mujoco")
          why += ", or they are left out (its <mujoco> can say <compiler discardvisual=\"false\"/>)";
      }
    }
    throw SceneError(file + ": there is nothing to see or to touch in it: " + why);
  }
  for (int i = 0; i < model->ngeom; ++i) {
    if (model->geom_group[i] <= 2 && model->geom_rgba[4 * i + 3] > 0) return;
  }
  if (call.note)
    call.note(file + ": nothing in it can be seen: all its geoms are transparent or in the groups 3 to 5");
}

/// Who names one of our robots has written the scene only: its file is to blame.
void check_fits(const SceneCall& call, const RawScene& raw, const RobotDescription& robot, bool is_ours) {
  try {
    check_robot(raw.model.get(), robot, Additions::to_come);
  } catch (const BadScript& error) {
    if (!is_ours) throw;
    throw SceneError(call.scene.string() + ": the robot " + call.robot + " does not fit: " + error.what());
  }
}

std::shared_ptr<const Task> open(const SceneCall& call, const std::filesystem::path& assets) {
  RobotDescription robot = find_robot(call.robot, assets);
  SceneFiles files(assets);
  const ModelPtr table = files.compile(assets / "scenes" / "table.xml");
  const bool is_urdf = root_element(read_text(call.scene)) == "robot";
  const RawScene raw = is_urdf ? read_urdf(call, files) : read_mjcf(call, files);
  check_usable(call, raw);
  check_fits(call, raw, robot, robot_file(call.robot, assets).empty());
  const std::string completed = completed_scene(raw.mjcf, raw.model.get(), table.get(), robot);
  ModelPtr model = files.compile({completed, {}}, raw.source);
  if (raw.model->nlight == 0) model->vis.headlight = table->vis.headlight;
  StartState start = start_state(raw.model.get(), model.get(), call.key);
  follow(raw.mimics, model.get(), start.qpos);
  return std::make_shared<SceneTask>(scene_name(call.scene), instruction_of(call), std::move(model),
                                     std::move(robot), std::move(start),
                                     scene_origin(call, raw.model.get(), robot_file(call.robot, assets)));
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
