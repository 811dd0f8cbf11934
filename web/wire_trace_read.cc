// Flow traces back out of JSON. A file may come from anywhere: every number, name and count is checked.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "web/fields.h"
#include "web/wire.h"
#include "web/wire_values.h"

namespace flowscope::web::wire {

namespace {

constexpr int most_steps = 10'000, most_points = 1 << 30, most_variations = 1 << 20;
constexpr std::size_t most_weights = 4096, longest_name = 128;
constexpr double farthest_m = 1000, largest_radius_m = 1000;
constexpr double loose = 1e-6;  ///< of times and shares that were printed and read

double number_in(Fields& fields, const std::string& key, double low, double high, const std::string& range) {
  const double value = fields.number(key);
  if (value < low || value > high) fields.fail(key, "must lie in " + range);
  return value;
}

double share(Fields& fields, const std::string& key) {
  return number_in(fields, key, -loose, 1 + loose, "0 to 1");
}

int whole(Fields& fields, const std::string& key, int low, int high) {
  return static_cast<int>(fields.integer(key, low, high));
}

/// Ids and task names become file names: no dots, no slashes.
std::string plain_name(Fields& fields, const std::string& key) {
  std::string name = fields.text(key, longest_name);
  const bool plain = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-';
  });
  if (!plain) fields.fail(key, "must be a plain name (letters, digits, _ and -)");
  return name;
}

std::string printable(Fields& fields, const std::string& key, std::size_t longest) {
  std::string text = fields.text(key, longest);
  if (std::ranges::any_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    fields.fail(key, "must not hold control characters");
  return text;
}

/// Empty where the program that wrote it had none.
std::string sha256(Fields& fields, const std::string& key) {
  std::string text = fields.text(key);
  const bool hex =
      std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (!hex || (!text.empty() && text.size() != 64)) fields.fail(key, "must be a SHA-256 of 64 hex digits");
  return text;
}

std::string date(Fields& fields, const std::string& key) {
  std::string text = fields.text(key, 40);
  const bool plain =
      text.size() >= 10 && std::ranges::all_of(text, [](char c) {
        return (c >= '0' && c <= '9') || c == '-' || c == ':' || c == '.' || c == '+' || c == 'T' || c == 'Z';
      });
  if (!plain) fields.fail(key, "must be a date such as 2026-12-01T08:30:00Z");
  return text;
}

Eigen::Vector3d place_of(Fields& fields, const std::string& key) {
  const Eigen::Vector3d at = fields.vector3(key);
  if (at.cwiseAbs().maxCoeff() > farthest_m) fields.fail(key, "must lie within 1000 m of the origin");
  return at;
}

Vector9 vector9(Fields& fields, const std::string& key) {
  const auto numbers = fields.numbers(key, 9);
  Vector9 v{};
  std::copy(numbers.begin(), numbers.end(), v.begin());
  return v;
}

Pose read_pose(Fields& fields) { return {place_of(fields, "position"), fields.quaternion("quaternion")}; }

GripperAction read_action(Fields fields) {
  GripperAction action;
  action.world_from_tool = read_pose(fields);
  const bool open = fields.boolean("open");
  action.openness = fields.has("openness") ? share(fields, "openness") : (open ? 1 : 0);
  if (action.open() != open) fields.fail("open", "must agree with openness, which is open above 0.5");
  return action;
}

void read_weights(Fields& fields, FlowStep& step) {
  if (!fields.has("weights")) return;
  const Json& weights = fields.at("weights");
  if (!weights.is_array() || weights.size() > most_weights)
    fields.fail("weights", "must be a list of at most " + std::to_string(most_weights) + " points");
  for (std::size_t i = 0; i < weights.size(); ++i) {
    Fields entry(weights[i], fields.place("weights") + "[" + std::to_string(i) + "]");
    step.weight_points.push_back(place_of(entry, "position").cast<float>());
    step.weights.push_back(static_cast<float>(share(entry, "weight")));
  }
}

FlowStep read_step(Fields fields, int index) {
  FlowStep step;
  step.k = whole(fields, "k", 0, most_steps);
  if (step.k != index) fields.fail("k", "must be " + std::to_string(index) + ", its place in the list");
  step.t = share(fields, "t");
  step.x = vector9(fields, "x");
  step.velocity = vector9(fields, "velocity");
  Fields pose_fields = fields.object("pose");
  step.pose = read_pose(pose_fields);
  Fields region = fields.object("region");
  step.region.center = place_of(region, "center");
  step.region.radius_m = number_in(region, "radius", 0, largest_radius_m, "0 to 1000 m");
  step.region.points = whole(region, "points", 0, most_points);
  step.open_probability = share(fields, "open_probability");
  step.ms = number_in(fields, "ms", 0, 1e9, "0 to 1e9");
  read_weights(fields, step);
  return step;
}

/// Time runs from noise at 0 to the action at 1, and every step takes some.
void read_steps(Fields& fields, FlowTrace& trace) {
  const Json& steps = fields.at("steps");
  const std::size_t wanted = static_cast<std::size_t>(trace.flow_steps) + 1;
  if (!steps.is_array()) fields.fail("steps", "must be a list of flow steps");
  if (steps.size() != wanted)
    fields.fail("steps", "must hold flow_steps + 1 = " + std::to_string(wanted) + " states, not " +
                             std::to_string(steps.size()));
  for (std::size_t k = 0; k < steps.size(); ++k) {
    Fields step(steps[k], fields.place("steps") + "[" + std::to_string(k) + "]");
    trace.steps.push_back(read_step(step, static_cast<int>(k)));
    const double t = trace.steps.back().t;
    if (k == 0 && t > loose) step.fail("t", "must be 0 in the first state");
    if (k > 0 && t <= trace.steps[k - 1].t) step.fail("t", "must rise from state to state");
    if (k + 1 == wanted && t < 1 - loose) step.fail("t", "must be 1 in the last state");
  }
}

TraceScene read_scene(Fields fields) {
  TraceScene scene;
  scene.task = plain_name(fields, "task");
  scene.variation = whole(fields, "variation", 0, most_variations);
  scene.seed = fields.seed("seed");
  if (fields.has("demo")) scene.demo = plain_name(fields, "demo");
  if (fields.has("keyframe")) scene.keyframe = whole(fields, "keyframe", 0, most_steps);
  scene.state_sha256 = sha256(fields, "state_sha256");
  return scene;
}

void read_policy(Fields policy, FlowTrace& trace) {
  trace.policy_file = printable(policy, "file", 4096);
  trace.weights_sha256 = sha256(policy, "weights_sha256");
  trace.generation = policy.seed("generation");
  trace.backbone = policy.one_of("backbone", {"mamba", "transformer"});
  trace.objective = policy.one_of("objective", {"cfm", "ddim", "ddpm"});
}

RadiusSchedule read_radius(Fields radius) {
  RadiusSchedule schedule{radius.one_of("kind", {"linear", "cosine", "off"}), radius.number("r_0"),
                          radius.number("r_min")};
  if (!(schedule.r_0 > 0 && schedule.r_0 <= largest_radius_m)) radius.fail("r_0", "must lie in (0, 1000] m");
  if (!(schedule.r_min > 0 && schedule.r_min <= schedule.r_0)) radius.fail("r_min", "must lie in (0, r_0]");
  return schedule;
}

}  // namespace

FlowTrace trace_from_json(const Json& json, const std::string& place) {
  Fields fields(json, place);
  if (fields.text("format") != trace_format) fields.fail("format", std::string("must be ") + trace_format);
  FlowTrace trace;
  trace.id = plain_name(fields, "id");
  trace.created = date(fields, "created");
  read_policy(fields.object("policy"), trace);
  trace.radius = read_radius(fields.object("radius"));
  trace.flow_steps = whole(fields, "flow_steps", 1, most_steps);
  trace.seed = fields.seed("seed");
  trace.integrator = fields.one_of("integrator", {"euler", "midpoint", "rk4"});
  trace.scene = read_scene(fields.object("scene"));
  trace.instruction = printable(fields, "instruction", 4096);
  read_steps(fields, trace);
  trace.result = read_action(fields.object("result"));
  if (fields.has("expert")) trace.expert = read_action(fields.object("expert"));
  if (fields.has("error")) {
    if (!trace.expert) fields.fail("error", "is the distance to an expert, and the trace has none");
    Fields error = fields.object("error");
    trace.error = {number_in(error, "position_m", 0, 4 * farthest_m, "0 to 4000 m"),
                   number_in(error, "rotation_deg", 0, 180.001, "0 to 180 degrees"),
                   error.boolean("open_correct")};
  }
  if (fields.has("parent")) {
    Fields parent = fields.object("parent");
    trace.parent = {plain_name(parent, "trace"), whole(parent, "step", 0, most_steps)};
  }
  return trace;
}

}  // namespace flowscope::web::wire
