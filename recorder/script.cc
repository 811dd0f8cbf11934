#include "recorder/script.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

#include "recorder/script_bounds.h"

namespace flowscope {
namespace {

constexpr std::size_t kMaxBytes = 256 * 1024;
constexpr std::size_t kMaxSteps = 10'000;
constexpr int kMaxDepth = 16;  ///< the grammar itself needs 5
constexpr int kMaxYawSymmetry = 360;

/// Says "<file>:<line>:<column>: message" for a place in the text; the marks of yaml-cpp count from zero.
class Reporter {
 public:
  explicit Reporter(std::string file) : file_(std::move(file)) {}
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& message) const {
    std::ostringstream out;
    out << file_ << ':' << std::max(mark.line, 0) + 1 << ':' << std::max(mark.column, 0) + 1 << ": "
        << message;
    throw BadScript(out.str());
  }

 private:
  std::string file_;
};

/// First pass over the text, before any tree is built: refuses what a small text could use to make a huge or
/// a deep tree.
class Screening : public YAML::EventHandler {
 public:
  explicit Screening(const Reporter& reporter) : reporter_(reporter) {}
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    reporter_.fail(mark, "aliases are not part of the script grammar");
  }
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void enter(const YAML::Mark& mark) {
    if (++depth_ > kMaxDepth) reporter_.fail(mark, "nested too deeply");
  }
  const Reporter& reporter_;
  int depth_ = 0;
};

/// Turns the tree into typed steps.
class Reader {
 public:
  explicit Reader(const Reporter& reporter) : reporter_(reporter) {}

  Script script(const YAML::Node& root) const {
    check_keys(root, "script", {"task", "steps"});
    Script result;
    if (const auto task = root["task"]) {
      result.task = text(task, "task");
      result.task_place = place(task);
    }
    const auto steps = root["steps"];
    if (!steps) reporter_.fail(root.Mark(), "script has no 'steps'");
    if (!steps.IsSequence()) reporter_.fail(steps.Mark(), "'steps' must be a list");
    if (steps.size() == 0) reporter_.fail(steps.Mark(), "'steps' is empty");
    if (steps.size() > kMaxSteps) {
      reporter_.fail(steps.Mark(), "more than " + std::to_string(kMaxSteps) + " steps");
    }
    for (const auto& node : steps) result.steps.push_back(step(node));
    return result;
  }

 private:
  void check_keys(const YAML::Node& node, const std::string& what,
                  const std::set<std::string>& allowed) const {
    if (!node.IsMap()) reporter_.fail(node.Mark(), what + " must be a map of keys and values");
    std::set<std::string> seen;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) reporter_.fail(entry.first.Mark(), "a key must be a word");
      const std::string& key = entry.first.Scalar();
      if (!allowed.contains(key)) {
        std::string known;
        for (const auto& name : allowed) known += (known.empty() ? "" : ", ") + name;
        reporter_.fail(entry.first.Mark(), what + " has no key '" + key + "' (known: " + known + ")");
      }
      if (!seen.insert(key).second) reporter_.fail(entry.first.Mark(), "'" + key + "' is given twice");
    }
  }

  static TextPlace place(const YAML::Node& node) { return {node.Mark().line + 1, node.Mark().column + 1}; }

  std::string text(const YAML::Node& node, const std::string& key) const {
    if (!node.IsScalar() || node.Scalar().empty())
      reporter_.fail(node.Mark(), "'" + key + "' must be a word");
    return node.Scalar();
  }

  double number(const YAML::Node& node, const std::string& key) const {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) {
      reporter_.fail(node.Mark(), "'" + key + "' needs a number here");
    }
    if (!std::isfinite(value)) reporter_.fail(node.Mark(), "'" + key + "' needs a finite number");
    return value;
  }

  bool boolean(const YAML::Node& node, const std::string& key) const {
    bool value = false;
    if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) {
      reporter_.fail(node.Mark(), "'" + key + "' must be true or false");
    }
    return value;
  }

  template <int N>
  Eigen::Matrix<double, N, 1> vector(const YAML::Node& node, const std::string& key) const {
    if (!node.IsSequence() || node.size() != N) {
      reporter_.fail(node.Mark(), "'" + key + "' must be a list of " + std::to_string(N) + " numbers");
    }
    Eigen::Matrix<double, N, 1> result;
    for (int i = 0; i < N; ++i) result[i] = number(node[i], key);
    return result;
  }

  Eigen::Quaterniond rotation(const YAML::Node& move) const {
    const auto rpy = move["rpy_deg"], quaternion = move["quaternion"];
    if (rpy && quaternion)
      reporter_.fail(quaternion.Mark(), "give either 'rpy_deg' or 'quaternion', not both");
    if (quaternion) {
      const auto wxyz = vector<4>(quaternion, "quaternion");
      if (std::abs(wxyz.norm() - 1) > 0.01) {
        reporter_.fail(quaternion.Mark(), "'quaternion' (w, x, y, z) must have length 1");
      }
      return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
    }
    if (!rpy) reporter_.fail(move.Mark(), "move needs 'rpy_deg' or 'quaternion'");
    const Eigen::Vector3d rad = vector<3>(rpy, "rpy_deg") * (std::numbers::pi / 180);
    const Eigen::AngleAxisd roll(rad.x(), Eigen::Vector3d::UnitX());
    const Eigen::AngleAxisd pitch(rad.y(), Eigen::Vector3d::UnitY());
    const Eigen::AngleAxisd yaw(rad.z(), Eigen::Vector3d::UnitZ());
    return Eigen::Quaterniond(yaw * pitch * roll).normalized();
  }

  MoveStep move(const YAML::Node& node) const {
    check_keys(node, "move",
               {"frame", "position", "rpy_deg", "quaternion", "path", "ignore_collisions", "yaw_symmetry"});
    MoveStep result;
    result.frame_place = place(node);
    if (const auto frame = node["frame"]) {
      result.frame = text(frame, "frame");
      result.frame_place = place(frame);
    }
    const auto position = node["position"];
    if (!position) reporter_.fail(node.Mark(), "move needs a 'position'");
    result.frame_from_tool.position = vector<3>(position, "position");
    result.frame_from_tool.rotation = rotation(node);
    if (const auto path = node["path"]) {
      const std::string kind = text(path, "path");
      if (kind != "linear" && kind != "planned") {
        reporter_.fail(path.Mark(), "'path' must be linear or planned, not '" + kind + "'");
      }
      result.linear = kind == "linear";
    }
    if (const auto ignore = node["ignore_collisions"]) {
      result.ignore_collisions = boolean(ignore, "ignore_collisions");
    }
    if (const auto fold = node["yaw_symmetry"]) {
      const double n = number(fold, "yaw_symmetry");
      if (n != std::floor(n) || n < 0 || n > kMaxYawSymmetry) {
        reporter_.fail(fold.Mark(), "'yaw_symmetry' must be a whole number from 0 (any yaw) to 360");
      }
      result.yaw_symmetry = static_cast<int>(n);
    }
    return result;
  }

  GripperStep gripper(const YAML::Node& node) const {
    if (node.IsScalar() && node.Scalar() == "open") return {1};
    if (node.IsScalar() && node.Scalar() == "close") return {0};
    double openness = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, openness) ||
        !(openness >= 0 && openness <= 1)) {
      reporter_.fail(node.Mark(), "'gripper' must be open, close or a number from 0 (closed) to 1 (open)");
    }
    return {openness};
  }

  Step step(const YAML::Node& node) const {
    check_keys(node, "step", {"move", "gripper"});
    if (node.size() != 1) reporter_.fail(node.Mark(), "a step is one 'move' or one 'gripper'");
    const int line = node.Mark().line + 1;
    if (const auto target = node["move"]) return {move(target), line};
    return {gripper(node["gripper"]), line};
  }

  const Reporter& reporter_;
};

}  // namespace

Script parse_script(const std::string& text, const std::string& file_name) {
  const Reporter reporter(file_name);
  if (text.size() > kMaxBytes) reporter.fail(YAML::Mark(), "larger than 256 KiB");
  if (const auto broken = broken_bound(text, kMaxSteps)) {
    YAML::Mark mark;
    mark.line = broken->line;
    mark.column = broken->column;
    reporter.fail(mark, broken->message);
  }
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    Screening screening(reporter);
    if (!parser.HandleNextDocument(screening)) reporter.fail(YAML::Mark(), "is empty");
    if (parser.HandleNextDocument(screening)) reporter.fail(YAML::Mark(), "holds more than one document");
    Script script = Reader(reporter).script(YAML::Load(text));
    script.file = file_name;
    return script;
  } catch (const YAML::Exception& error) {
    reporter.fail(error.mark, "is not YAML: " + error.msg);
  }
}

}  // namespace flowscope
