#include "recorder/robot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "recorder/scene_files.h"
#include "recorder/task_tree.h"

namespace flowscope {
namespace {

// What no arm that stands on a table has: a number beyond these was meant in another unit.
constexpr double kFarthest_m = 3, kFastest_rad_s = 30;

class RobotReader {
 public:
  explicit RobotReader(const std::filesystem::path& file) : reader_(file.string()) {
    robot_.places.file = file.string();
  }

  RobotDescription read(const std::string& text) {
    root_ = reader_.parse(text);
    reader_.check_keys(root_, "robot",
                       {"joints", "actuators", "stiffness", "home", "tool", "attach", "hand",
                        "inverse_kinematics", "footprint", "limits", "gripper"});
    for (std::size_t i = 0; i < root_.keys.size(); ++i) mark(root_.keys[i], root_.items[i]);
    robot_.joints = names("joints", "joint");
    if (robot_.joints.empty() || robot_.joints.size() > max_joints) {
      reader_.fail(*root_.find("joints"), "an arm has 1 to " + std::to_string(max_joints) + " joints");
    }
    read_actuators();
    const TaskNode& home = reader_.require(root_, "home");
    const auto angles = reader_.numbers(home, "home", robot_.joints.size());
    std::copy(angles.begin(), angles.end(), robot_.home.begin());
    for (std::size_t i = 0; i < angles.size(); ++i) mark("home[" + std::to_string(i) + "]", home.items[i]);
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
  void mark(const std::string& what, const TaskNode& node) {
    robot_.places.marks[what] = ":" + std::to_string(node.line) + ":" + std::to_string(node.column) + ": ";
  }
  std::vector<std::string> names(const std::string& key, const std::string& kind) {
    std::vector<std::string> result;
    for (const auto& item : reader_.list(reader_.require(root_, key), key)) {
      mark(key + "[" + std::to_string(result.size()) + "]", item);
      result.push_back(once(item, reader_.text(item, key), kind));
    }
    return result;
  }
  /// A joint or actuator has one part in a robot.
  const std::string& once(const TaskNode& node, const std::string& name, const std::string& kind) {
    if (!taken_.insert(kind + " " + name).second) {
      reader_.fail(node, kind + " '" + name + "' is named twice");
    }
    return name;
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
    robot_.actuators = names("actuators", "actuator");
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
    const auto in_metres = [&](const char* name) {
      const Eigen::Vector3d value = vector(name);
      if (value.norm() > kFarthest_m) {
        reader_.fail(*node.find(name), std::string("'") + name + "' is in metres, and farther than " +
                                           std::to_string(int(kFarthest_m)) + " m from '" + place->body +
                                           "': mm?");
      }
      return value;
    };
    const Eigen::Vector3d rpy = vector("rpy_deg") * (std::numbers::pi / 180);
    place->body_from_site = {in_metres("position"),
                             Eigen::Quaterniond(Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                                                Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                                                Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))};
    if (box) place->size = in_metres("size");
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
    if (std::max(size[0], size[1]) > kFarthest_m) {
      reader_.fail(*node->find("size"), "'size' is in metres, and no base is that large: mm?");
    }
    robot_.footprint_center = {center[0], center[1]};
    robot_.footprint_size = {size[0], size[1]};
  }
  void read_limits() {
    const TaskNode& node = reader_.require(root_, "limits");
    reader_.check_keys(node, "limits", {"velocity", "acceleration", "deceleration"});
    robot_.limits = {positive(node, "velocity"), positive(node, "acceleration"),
                     positive(node, "deceleration")};
    if (robot_.limits.velocity > kFastest_rad_s) {
      reader_.fail(*node.find("velocity"), "'velocity' is in rad/s, and no arm is that fast: degrees?");
    }
  }
  void read_gripper() {
    const TaskNode& node = reader_.require(root_, "gripper");
    reader_.check_keys(node, "gripper", {"fingers", "squeeze"});
    bool driven = false;
    for (const auto& item : reader_.list(reader_.require(node, "fingers"), "fingers")) {
      robot_.fingers.push_back(finger(item));
      driven = driven || !robot_.fingers.back().actuator.empty();
    }
    if (!driven) reader_.fail(node, "no finger has an actuator");
    const TaskNode& squeeze = reader_.require(node, "squeeze");
    robot_.squeeze = reader_.number(squeeze, "squeeze");
    if (robot_.squeeze < 0) reader_.fail(squeeze, "'squeeze' must not be negative");
    for (const auto& finger : robot_.fingers) {
      if (finger.actuator.empty() || robot_.squeeze <= std::abs(finger.open - finger.closed)) continue;
      reader_.fail(squeeze, "'squeeze' is more than the whole way of '" + finger.joint +
                                "' from open to closed: it is in m or rad");
    }
  }
  FingerDescription finger(const TaskNode& item) {
    reader_.check_keys(
        item, "finger",
        {"joint", "actuator", "stiffness", "open", "closed", "command_open", "command_closed"});
    const std::string place = "fingers[" + std::to_string(robot_.fingers.size()) + "]";
    mark(place, item);
    for (std::size_t i = 0; i < item.keys.size(); ++i) mark(place + "." + item.keys[i], item.items[i]);
    FingerDescription finger;
    finger.joint = once(reader_.require(item, "joint"), word(item, "joint"), "joint");
    const TaskNode *actuator = item.find("actuator"), *stiffness = item.find("stiffness");
    if (actuator) finger.actuator = once(*actuator, word(item, "actuator"), "actuator");
    if (stiffness) {
      if (actuator) reader_.fail(*stiffness, "'stiffness' stands in place of 'actuator'");
      finger.stiffness = positive(item, "stiffness");
      finger.actuator = "drive_" + finger.joint;
    }
    finger.open = reader_.number(reader_.require(item, "open"), "open");
    finger.closed = reader_.number(reader_.require(item, "closed"), "closed");
    if (finger.open == finger.closed) reader_.fail(item, "'open' and 'closed' are the same");
    read_commands(item, actuator, finger);
    return finger;
  }
  void read_commands(const TaskNode& item, const TaskNode* actuator, FingerDescription& finger) const {
    const TaskNode *open = item.find("command_open"), *closed = item.find("command_closed");
    if (!open && !closed) return;
    const TaskNode& given = open ? *open : *closed;
    if (!actuator)
      reader_.fail(given, "a command is an input of the finger's 'actuator', which is not given");
    if (!open || !closed) reader_.fail(given, "'command_open' and 'command_closed' go together");
    finger.command_open = reader_.number(*open, "command_open");
    finger.command_closed = reader_.number(*closed, "command_closed");
    if (*finger.command_open == *finger.command_closed) {
      reader_.fail(given, "'command_open' and 'command_closed' are the same");
    }
  }

  TaskReader reader_;
  TaskNode root_;
  RobotDescription robot_;
  std::set<std::string> taken_;
};

}  // namespace

std::string RobotPlaces::of(std::string what) const {
  for (;;) {
    const auto found = marks.find(what);
    if (found != marks.end()) return file + found->second;
    const auto part = what.find_last_of(".[");
    if (part == std::string::npos) return file.empty() ? "" : file + ": ";
    what.erase(part);
  }
}

RobotDescription read_robot(const std::filesystem::path& file) {
  RobotDescription robot = RobotReader(file).read(read_text(file));
  robot.name = file.stem().string();
  return robot;
}

}  // namespace flowscope
