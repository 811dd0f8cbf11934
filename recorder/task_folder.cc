#include "recorder/task_folder.h"

#include <mujoco/mujoco.h>

#include <stdexcept>

#include "recorder/instruction.h"
#include "recorder/robot_check.h"
#include "recorder/scene_files.h"
#include "recorder/success.h"
#include "recorder/task_placement.h"
#include "recorder/task_variations.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

Kinematics arm_of(const mjModel* model, const RobotDescription& robot) {
  check_robot(model, robot, Additions::in_place);
  return kinematics_of(model, robot);
}

class FolderTask : public Task {
 public:
  FolderTask(const std::filesystem::path& folder, const std::filesystem::path& assets)
      : name_(folder.filename().string()),
        reader_((folder / "task.yaml").string()),
        root_(reader_.parse(read_text(folder / "task.yaml"))),
        model_(SceneFiles(assets).compile(folder / "scene.xml")),
        robot_(find_robot(folder, assets)),
        arm_(arm_of(model_.get(), robot_)) {
    reader_.check_keys(root_, "task",
                       {"robot", "bounds", "keyframes", "published_keyframes", "variations", "draw",
                        "instructions", "colors", "placement", "success", "demonstration"});
    bounds_ = read_box(reader_, reader_.require(root_, "bounds"), "bounds");
    keyframes_ = reader_.integer(reader_.require(root_, "keyframes"), "keyframes", 1, 1000);
    if (const TaskNode* mean = root_.find("published_keyframes"))
      published_keyframes_ = reader_.number(*mean, "published_keyframes");
    variations_ = read_variations(reader_, name_, reader_.require(root_, "variations"));
    check_all();
  }

  const std::string& name() const override { return name_; }
  int variations() const override { return static_cast<int>(variations_.size()); }
  Box bounds() const override { return bounds_; }
  int keyframes() const override { return keyframes_; }
  std::optional<double> published_keyframes() const override { return published_keyframes_; }
  const mjModel* model() const override { return model_.get(); }
  const RobotDescription& robot() const override { return robot_; }

  std::vector<std::string> instructions(int variation) const override {
    const TaskNode filled = reader_.fill(reader_.require(root_, "instructions"), bound(variation));
    std::vector<std::string> result;
    for (const auto& item : reader_.list(filled, "instructions")) {
      std::string sentence;
      if (item.is_list()) {
        for (const auto& part : item.items) sentence += reader_.text(part, "instruction");
      } else {
        sentence = reader_.text(item, "instruction");
      }
      if (!has_word(sentence))
        reader_.fail(item, "an instruction must hold a word: it is what a policy reads");
      result.push_back(std::move(sentence));
    }
    if (result.empty()) reader_.fail(filled, "'instructions' is empty");
    return result;
  }

  Episode reset(mjModel* model, mjData* data, int variation, std::uint64_t seed) const override {
    TaskRandom random(name_, static_cast<std::uint64_t>(variation), seed);
    const Variables variables = draw(variation, random);
    Episode episode{name_, variation, seed, instructions(variation), {}, demonstration_text(variables)};
    episode.demonstration = parse_script(episode.demonstration_text, name_ + " demonstration");
    std::copy_n(model_->mat_rgba, 4 * model_->nmat, model->mat_rgba);
    std::copy_n(model_->eq_active, model_->neq, model->eq_active);
    std::copy_n(model_->eq_data, mjNEQDATA * model_->neq, model->eq_data);
    paint(variables, model);
    place(placement(variables), robot_, episode.demonstration, bounds_, arm_, random, model, data);
    return episode;
  }

  std::unique_ptr<SuccessCheck> success(const mjModel* model, const mjData* data,
                                        const Episode& episode) const override {
    TaskRandom random(name_, static_cast<std::uint64_t>(episode.variation), episode.seed);
    const Variables variables = draw(episode.variation, random);
    return make_success(reader_, reader_.fill(reader_.require(root_, "success"), variables), model, data);
  }

 private:
  /// `robot: ur5` is one of the shared robots, `robot: mine.yaml` a file in the task's own folder.
  RobotDescription find_robot(const std::filesystem::path& folder,
                              const std::filesystem::path& assets) const {
    const TaskNode* node = root_.is_map() ? root_.find("robot") : nullptr;
    if (!node) return read_robot(assets / "robots" / "panda.yaml");
    const std::filesystem::path name = reader_.text(*node, "robot");
    const auto file =
        name.extension() == ".yaml" ? folder / name : assets / "robots" / (name.string() + ".yaml");
    if (!std::filesystem::is_regular_file(file)) {
      reader_.fail(*node, "there is no robot '" + name.string() + "' (" + file.string() + ")");
    }
    return read_robot(file);
  }

  const Variables& bound(int variation) const {
    if (variation < 0 || variation >= variations()) {
      throw std::invalid_argument("task " + name_ + " has variations 0 to " +
                                  std::to_string(variations() - 1) + ", not " + std::to_string(variation));
    }
    return variations_[static_cast<std::size_t>(variation)];
  }

  Variables draw(int variation, TaskRandom& random) const {
    Variables variables = bound(variation);
    draw_variables(reader_, root_.find("draw"), random, variables);
    return variables;
  }

  Placement placement(const Variables& variables) const {
    return read_placement(reader_, reader_.fill(reader_.require(root_, "placement"), variables),
                          model_.get());
  }

  void paint(const Variables& variables, mjModel* model) const {
    const TaskNode* colors = root_.find("colors");
    if (!colors) return;
    for (const auto& rule : reader_.fill(*colors, variables).items) {
      reader_.check_keys(rule, "colors", {"material", "color"});
      const TaskNode &material = reader_.require(rule, "material"), &color = reader_.require(rule, "color");
      const int id = mj_name2id(model, mjOBJ_MATERIAL, reader_.text(material, "material").c_str());
      if (id < 0) reader_.fail(material, "the scene has no material '" + material.text + "'");
      try {
        const auto rgb = color_rgb(reader_.text(color, "color"));
        std::copy(rgb.begin(), rgb.end(), model->mat_rgba + 4 * id);
      } catch (const std::invalid_argument& error) {
        reader_.fail(color, error.what());
      }
    }
  }

  std::string demonstration_text(const Variables& variables) const {
    const TaskNode filled = reader_.fill(reader_.require(root_, "demonstration"), variables);
    std::string text = "task: " + name_ + "\nsteps:\n";
    for (const auto& step : reader_.list(filled, "demonstration")) {
      if (!step.is_map() || step.keys.size() != 1)
        reader_.fail(step, "a step is one 'move: …' or one 'gripper: …'");
      text += "  - " + step.keys[0] + ": " + to_yaml(step.items[0]) + "\n";
    }
    return text;
  }

  /// The steps one by one, each at its own line of task.yaml, so that a complaint names the true place; and
  /// their frames.
  void check_demonstration(const Variables& variables) const {
    const TaskNode filled = reader_.fill(reader_.require(root_, "demonstration"), variables);
    for (const auto& step : reader_.list(filled, "demonstration")) {
      const std::string above(static_cast<std::size_t>(std::max(step.line - 2, 0)), '\n');
      const Script script = parse_script(above + "steps:\n- " + to_yaml(step), reader_.file());
      const auto* move = std::get_if<MoveStep>(&script.steps.at(0).what);
      if (!move || has_frame(model_.get(), move->frame)) continue;
      reader_.fail(step, "the scene has no body or site '" + move->frame + "'");
    }
  }

  /// Everything that depends on a variation, so that a mistake shows when the task is read and not in some
  /// episode.
  void check_all() const {
    const DataPtr data(mj_makeData(model_.get()));
    const ModelPtr scratch(mj_copyModel(nullptr, model_.get()));
    for (int i = 0; i < variations(); ++i) {
      TaskRandom random(name_, static_cast<std::uint64_t>(i), 0);
      const Variables variables = draw(i, random);
      instructions(i);
      paint(variables, scratch.get());
      placement(variables);
      check_demonstration(variables);
      make_success(reader_, reader_.fill(reader_.require(root_, "success"), variables), model_.get(),
                   data.get());
    }
  }

  std::string name_;
  TaskReader reader_;
  TaskNode root_;
  ModelPtr model_;
  RobotDescription robot_;
  Kinematics arm_;
  Box bounds_;
  int keyframes_ = 0;
  std::optional<double> published_keyframes_;
  std::vector<Variables> variations_;
};

}  // namespace

std::shared_ptr<const Task> load_task(const std::filesystem::path& folder,
                                      const std::filesystem::path& assets) {
  return std::make_shared<FolderTask>(folder, assets);
}

}  // namespace flowscope
