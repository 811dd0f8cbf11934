#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "web/wire.h"
#include "web/wire_values.h"

namespace flowscope::web::wire {

namespace {

constexpr std::size_t most_weights = 64;

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

}  // namespace

Json to_json(const FlowTrace& trace, bool with_weights) {
  Json steps = Json::array();
  for (const FlowStep& step : trace.steps) steps.push_back(step_json(step, with_weights));
  return {
      {"format", trace_format},
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

}  // namespace flowscope::web::wire
