#include "recorder/robot.h"

#include <algorithm>
#include <numbers>

#include "recorder/scene_files.h"
#include "recorder/task_tree.h"

namespace flowscope {
namespace {

class RobotReader {
 public:
  explicit RobotReader(const std::filesystem::path& file) : reader_(file.string()) {}

  RobotDescription read(const std::string& text) {
    root_ = reader_.parse(text);
    reader_.check_keys(root_, "robot",
                       {"joints", "actuators", "stiffness", "home", "tool", "attach", "hand",
                        "inverse_kinematics", "footprint", "limits", "gripper"});
    robot_.joints = names("joints");
    if (robot_.joints.empty() || robot_.joints.size() > max_joints) {
      reader_.fail(*root_.find("joints"), "an arm has 1 to " + std::to_string(max_joints) + " joints");
    }
    read_actuators();
    const auto home = reader_.numbers(reader_.require(root_, "home"), "home", robot_.joints.size());
    std::copy(home.begin(), home.end(), robot_.home.begin());
    robot_.tool = site("tool", robot_.tool_place);
    robot_.attach = site("attach", robot_.attach_place);
    robot_.hand = word(root_, "hand");
    read_inverse_kinematics();
    read_footprint();
    read_limits();
    read_gripper();
    return std::move(robot_);
  }

 private:
  std::string word(const TaskNode& map, const std::string& key) const {
    return reader_.text(reader_.require(map, key), key);
  }
  std::vector<std::string> names(const std::string& key) const {
    std::vector<std::string> result;
    for (const auto& item : reader_.list(reader_.require(root_, key), key)) {
      result.push_back(reader_.text(item, key));
    }
    return result;
  }
  double positive(const TaskNode& map, const std::string& key) const {
    const TaskNode& node = reader_.require(map, key);
    const double value = reader_.number(node, key);
    if (value <= 0) reader_.fail(node, "'" + key + "' must be above 0");
    return value;
  }

  void read_actuators() {
    if (const auto* stiffness = root_.find("stiffness")) {
      if (root_.find("actuators")) reader_.fail(*stiffness, "'stiffness' stands in place of 'actuators'");
      robot_.stiffness = reader_.numbers(*stiffness, "stiffness", robot_.joints.size());
      for (const double value : robot_.stiffness) {
        if (value <= 0) reader_.fail(*stiffness, "'stiffness' must be above 0");
      }
      for (const auto& joint : robot_.joints) robot_.actuators.push_back("drive_" + joint);
      return;
    }
    robot_.actuators = names("actuators");
    if (robot_.actuators.size() != robot_.joints.size()) {
      reader_.fail(*root_.find("actuators"), "there must be one actuator for each joint");
    }
  }

  /// Its name, and its place where that is given instead.
  std::string site(const std::string& key, std::optional<SiteDescription>& place) const {
    const TaskNode& node = reader_.require(root_, key);
    if (!node.is_map()) return reader_.text(node, key);
    const bool box = key == "attach";
    std::vector<std::string> known{"body", "position", "rpy_deg"};
    if (box) known.emplace_back("size");
    reader_.check_keys(node, key, known);
    place.emplace();
    place->body = word(node, "body");
    const auto vector = [&](const char* name) {
      const auto values = reader_.numbers(reader_.require(node, name), name, 3);
      return Eigen::Vector3d(values[0], values[1], values[2]);
    };
    const Eigen::Vector3d rpy = vector("rpy_deg") * (std::numbers::pi / 180);
    place->body_from_site = {vector("position"),
                             Eigen::Quaterniond(Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                                                Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                                                Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))};
    if (box) place->size = vector("size");
    if (box && place->size.minCoeff() <= 0) reader_.fail(*node.find("size"), "'size' must be above 0");
    return key;
  }

  void read_inverse_kinematics() {
    const TaskNode& node = reader_.require(root_, "inverse_kinematics");
    const std::string& kind = reader_.text(node, "inverse_kinematics");
    const bool panda = kind == "panda";
    if (!panda && kind != "numeric") {
      reader_.fail(node, "'inverse_kinematics' is panda or numeric, not '" + kind + "'");
    }
    if (panda && robot_.joints.size() != 7) reader_.fail(node, "a Panda has 7 joints");
    robot_.inverse_kinematics = panda ? InverseKinematics::panda : InverseKinematics::numeric;
  }
  void read_footprint() {
    const TaskNode* node = root_.find("footprint");
    if (!node) return;
    reader_.check_keys(*node, "footprint", {"center", "size"});
    const auto center = reader_.numbers(reader_.require(*node, "center"), "center", 2);
    const auto size = reader_.numbers(reader_.require(*node, "size"), "size", 2);
    if (size[0] < 0 || size[1] < 0) reader_.fail(*node->find("size"), "'size' must not be negative");
    robot_.footprint_center = {center[0], center[1]};
    robot_.footprint_size = {size[0], size[1]};
  }
  void read_limits() {
    const TaskNode& node = reader_.require(root_, "limits");
    reader_.check_keys(node, "limits", {"velocity", "acceleration", "deceleration"});
    robot_.limits = {positive(node, "velocity"), positive(node, "acceleration"),
                     positive(node, "deceleration")};
  }
  void read_gripper() {
    const TaskNode& node = reader_.require(root_, "gripper");
    reader_.check_keys(node, "gripper", {"fingers", "squeeze"});
    bool driven = false;
    for (const auto& item : reader_.list(reader_.require(node, "fingers"), "fingers")) {
      reader_.check_keys(item, "finger", {"joint", "actuator", "stiffness", "open", "closed"});
      FingerDescription finger;
      finger.joint = word(item, "joint");
      if (item.find("actuator")) finger.actuator = word(item, "actuator");
      if (item.find("stiffness")) {
        finger.stiffness = positive(item, "stiffness");
        finger.actuator = "drive_" + finger.joint;
      }
      finger.open = reader_.number(reader_.require(item, "open"), "open");
      finger.closed = reader_.number(reader_.require(item, "closed"), "closed");
      if (finger.open == finger.closed) reader_.fail(item, "'open' and 'closed' are the same");
      driven = driven || !finger.actuator.empty();
      robot_.fingers.push_back(std::move(finger));
    }
    if (!driven) reader_.fail(node, "no finger has an actuator");
    const TaskNode& squeeze = reader_.require(node, "squeeze");
    robot_.squeeze = reader_.number(squeeze, "squeeze");
    if (robot_.squeeze < 0) reader_.fail(squeeze, "'squeeze' must not be negative");
  }

  TaskReader reader_;
  TaskNode root_;
  RobotDescription robot_;
};

}  // namespace

RobotDescription read_robot(const std::filesystem::path& file) {
  RobotDescription robot = RobotReader(file).read(read_text(file));
  robot.name = file.stem().string();
  return robot;
}

}  // namespace flowscope
