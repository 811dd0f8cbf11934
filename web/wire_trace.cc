#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "web/fields.h"
#include "web/wire.h"
#include "web/wire_values.h"

namespace flowscope::web::wire {

namespace {

constexpr const char* format_name = "flowscope-trace/1";
constexpr std::size_t most_weights = 64;
constexpr std::size_t most_steps = 10000;

Json heaviest(const FlowStep& step) {
  const std::size_t size = std::min(step.weights.size(), step.weight_points.size());
  std::vector<std::size_t> order(size);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto kept = static_cast<std::ptrdiff_t>(std::min(size, most_weights));
  std::partial_sort(order.begin(), order.begin() + kept, order.end(),
                    [&](std::size_t a, std::size_t b) { return step.weights[a] > step.weights[b]; });
  Json list = Json::array();
  for (auto i = order.begin(); i != order.begin() + kept; ++i)
    list.push_back({{"position", vector(step.weight_points[*i])}, {"weight", step.weights[*i]}});
  return list;
}

Json step_json(const FlowStep& step, bool with_weights) {
  Json json{{"k", step.k},
            {"t", step.t},
            {"x", step.x},
            {"velocity", step.velocity},
            {"pose", pose(step.pose)},
            {"region",
             {{"center", vector(step.region.center)},
              {"radius", step.region.radius_m},
              {"points", step.region.points}}},
            {"open_probability", step.open_probability},
            {"ms", step.ms}};
  if (with_weights) json["weights"] = heaviest(step);
  return json;
}

Json scene_json(const TraceScene& scene) {
  Json json{{"task", scene.task}, {"variation", scene.variation}, {"seed", scene.seed}};
  if (scene.demo) json["demo"] = *scene.demo;
  if (scene.keyframe) json["keyframe"] = *scene.keyframe;
  json["state_sha256"] = scene.state_sha256;
  return json;
}

Vector9 vector9(Fields& fields, const std::string& key) {
  const auto numbers = fields.numbers(key, 9);
  Vector9 v{};
  std::copy(numbers.begin(), numbers.end(), v.begin());
  return v;
}

Pose read_pose(Fields& fields) { return {fields.vector3("position"), fields.quaternion("quaternion")}; }

GripperAction read_action(Fields fields) {
  GripperAction action;
  action.world_from_tool = read_pose(fields);
  action.openness = fields.boolean("open") ? 1 : 0;
  if (fields.has("openness")) action.openness = fields.number("openness");
  return action;
}

constexpr std::int64_t most = std::int64_t{1} << 31;

int whole(Fields& fields, const std::string& key, std::int64_t high = most - 1) {
  return static_cast<int>(fields.integer(key, 0, high));
}

FlowStep read_step(Fields fields) {
  FlowStep step;
  step.k = whole(fields, "k");
  step.t = fields.number("t");
  step.x = vector9(fields, "x");
  step.velocity = vector9(fields, "velocity");
  Fields pose_fields = fields.object("pose");
  step.pose = read_pose(pose_fields);
  Fields region = fields.object("region");
  step.region.center = region.vector3("center");
  step.region.radius_m = region.number("radius");
  step.region.points = whole(region, "points");
  step.open_probability = fields.number("open_probability");
  step.ms = fields.number("ms");
  if (const Json* weights = fields.find("weights"); weights && weights->is_array()) {
    for (const Json& item : *weights) {
      Fields entry(item, fields.place("weights"));
      step.weight_points.push_back(entry.vector3("position").cast<float>());
      step.weights.push_back(static_cast<float>(entry.number("weight")));
    }
  }
  return step;
}

TraceScene read_scene(Fields fields) {
  TraceScene scene;
  scene.task = fields.text("task");
  scene.variation = whole(fields, "variation");
  scene.seed = fields.seed("seed");
  if (fields.has("demo")) scene.demo = fields.text("demo");
  if (fields.has("keyframe")) scene.keyframe = whole(fields, "keyframe");
  scene.state_sha256 = fields.text("state_sha256");
  return scene;
}

}  // namespace

Json to_json(const FlowTrace& trace, bool with_weights) {
  Json steps = Json::array();
  for (const FlowStep& step : trace.steps) steps.push_back(step_json(step, with_weights));
  return {
      {"format", format_name},
      {"id", trace.id},
      {"created", trace.created},
      {"policy",
       {{"file", trace.policy_file},
        {"weights_sha256", trace.weights_sha256},
        {"generation", trace.generation},
        {"backbone", trace.backbone},
        {"objective", trace.objective}}},
      {"radius", {{"kind", trace.radius.kind}, {"r_0", trace.radius.r_0}, {"r_min", trace.radius.r_min}}},
      {"flow_steps", trace.flow_steps},
      {"seed", trace.seed},
      {"integrator", trace.integrator},
      {"scene", scene_json(trace.scene)},
      {"instruction", trace.instruction},
      {"steps", std::move(steps)},
      {"result", action(trace.result)},
      {"expert", trace.expert ? action(*trace.expert) : Json()},
      {"error", trace.error ? pose_error(*trace.error) : Json()},
      {"parent", trace.parent ? Json{{"trace", trace.parent->trace}, {"step", trace.parent->step}} : Json()}};
}

FlowTrace trace_from_json(const Json& json) {
  Fields fields(json);
  if (fields.text("format") != format_name) fields.fail("format", std::string("must be ") + format_name);
  FlowTrace trace;
  trace.id = fields.text("id");
  trace.created = fields.text("created");
  Fields policy = fields.object("policy");
  trace.policy_file = policy.text("file", 4096);
  trace.weights_sha256 = policy.text("weights_sha256");
  trace.generation = policy.seed("generation");
  trace.backbone = policy.text("backbone");
  trace.objective = policy.text("objective");
  Fields radius = fields.object("radius");
  trace.radius = {radius.one_of("kind", {"linear", "cosine", "off"}), radius.number("r_0"),
                  radius.number("r_min")};
  trace.flow_steps = whole(fields, "flow_steps", static_cast<std::int64_t>(most_steps));
  trace.seed = fields.seed("seed");
  trace.integrator = fields.text("integrator");
  trace.scene = read_scene(fields.object("scene"));
  trace.instruction = fields.text("instruction", 4096);
  const Json& steps = fields.at("steps");
  if (!steps.is_array() || steps.size() > most_steps + 1)
    fields.fail("steps", "must be a list of flow steps");
  for (std::size_t k = 0; k < steps.size(); ++k)
    trace.steps.push_back(read_step(Fields(steps[k], "steps[" + std::to_string(k) + "]")));
  trace.result = read_action(fields.object("result"));
  if (fields.has("expert")) trace.expert = read_action(fields.object("expert"));
  if (fields.has("error")) {
    Fields error = fields.object("error");
    trace.error = {error.number("position_m"), error.number("rotation_deg"), error.boolean("open_correct")};
  }
  if (fields.has("parent")) {
    Fields parent = fields.object("parent");
    trace.parent = {parent.text("trace"), whole(parent, "step")};
  }
  return trace;
}

}  // namespace flowscope::web::wire
