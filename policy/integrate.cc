#include "policy/integrate.h"

#include <chrono>
#include <stdexcept>

namespace flowscope {
namespace {

struct Evaluation {
  Vector9 velocity{};
  double open_probability = 0;
  Region region;
  std::vector<float> weights;
  std::vector<Eigen::Vector3f> weight_points;
};

std::vector<Eigen::Vector3f> rows_of(const torch::Tensor& points) {
  const torch::Tensor flat = points.contiguous().view({-1, 3});
  const auto* first = flat.data_ptr<float>();
  std::vector<Eigen::Vector3f> out;
  for (std::int64_t i = 0; i < flat.size(0); ++i)
    out.emplace_back(first[3 * i], first[3 * i + 1], first[3 * i + 2]);
  return out;
}

Evaluation evaluate(Model& model, const SceneMemory& memory, const SceneInput& input, const Draw& draw) {
  std::vector<RegionPoints> regions;
  const DrawBatch batch = make_draw_batch({&input}, {draw}, model.shape, model.scale, &regions);
  const NetworkOutput out = model.network->forward(memory, batch, model.scale);
  Evaluation e;
  Vector9 action;
  const torch::Tensor row = out.action.contiguous();
  for (std::size_t i = 0; i < action.size(); ++i) action[i] = static_cast<double>(row.data_ptr<float>()[i]);
  e.velocity = model.shape.grounded ? model.objective->velocity_to(action, draw.x, draw.t) : action;
  e.open_probability = torch::sigmoid(out.open_logit).item<double>();
  e.region.center = model.scale.denormalise(Eigen::Map<const Eigen::Vector3d>(draw.x.data()));
  e.region.radius_m = draw.radius_m;
  e.region.points = regions[0].points_inside;
  for (std::size_t i = 0; i < regions[0].index.size(); ++i)
    if (regions[0].inside[i])
      e.region.inside.push_back(input.scene->points[static_cast<std::size_t>(regions[0].index[i])].position);
  if (out.weights.defined()) {
    const torch::Tensor w = out.weights.contiguous();
    e.weights.assign(w.data_ptr<float>(), w.data_ptr<float>() + w.numel());
    e.weight_points =
        rows_of(torch::cat({batch.region_position, memory.image_position, memory.history_position}, 1));
  }
  return e;
}

void check_options(const PredictOptions& options) {
  if (options.flow_steps < 1 || options.flow_steps > 1000)
    throw std::invalid_argument("flow_steps must be from 1 to 1000, not " +
                                std::to_string(options.flow_steps));
  if (!options.branch) return;
  const auto& b = *options.branch;
  if (!b.from) throw std::invalid_argument("a branch needs the trace that it leaves");
  if (b.step < 0 || b.step >= static_cast<int>(b.from->steps.size()))
    throw std::invalid_argument("the trace has no step " + std::to_string(b.step));
  if (b.radius_m && !(*b.radius_m > 0)) throw std::invalid_argument("the radius must be positive, in metres");
}

}  // namespace

FlowTrace integrate_flow(Model& model, const SceneInput& input, const PredictOptions& options) {
  check_options(options);
  const torch::NoGradGuard no_grad;
  FlowTrace trace;
  trace.radius = model.radius;
  if (options.radius_kind) trace.radius.kind = *options.radius_kind;
  trace.radius.radius_m(0);  // refuses an unknown kind
  trace.seed = options.seed;
  trace.backbone = model.backbone;
  trace.objective = model.objective_name;

  // The time grid: n even steps; after a branch, its old start and the rest in even steps.
  const bool branches = options.branch.has_value();
  const int first = branches ? options.branch->step : 0;
  std::vector<double> times;
  Vector9 x{};
  if (branches) {
    const FlowTrace& from = *options.branch->from;
    trace.seed = from.seed;
    trace.steps.assign(from.steps.begin(), from.steps.begin() + first);
    for (const FlowStep& s : trace.steps) times.push_back(s.t);
    const FlowStep& at = from.steps[static_cast<std::size_t>(first)];
    x = at.x;
    if (options.branch->position)
      Eigen::Map<Eigen::Vector3d>(x.data()) = model.scale.normalise(*options.branch->position);
    if (options.branch->rotation)
      Eigen::Map<Eigen::Matrix<double, 6, 1>>(x.data() + 3) = rotation_to_6d(*options.branch->rotation);
    const int rest = std::max(first < from.flow_steps ? 1 : 0, options.flow_steps - first);
    for (int k = 0; k <= rest; ++k)
      times.push_back(k == rest ? 1.0 : at.t + (1 - at.t) * model.objective->grid(k, rest));
  } else {
    Random noise(options.seed);
    for (double& v : x) v = noise.normal();
    for (int k = 0; k <= options.flow_steps; ++k)
      times.push_back(model.objective->grid(k, options.flow_steps));
  }
  trace.flow_steps = static_cast<int>(times.size()) - 1;

  const SceneMemory memory = model.network->encode(make_scene_batch({&input}, model.shape, model.scale));
  for (std::size_t k = static_cast<std::size_t>(first); k < times.size(); ++k) {
    const auto start = std::chrono::steady_clock::now();
    const bool last = k + 1 == times.size();
    const double t = times[k];
    const double radius =
        branches && options.branch->radius_m ? *options.branch->radius_m : trace.radius.radius_m(t);
    Evaluation e = evaluate(model, memory, input, {x, t, radius, trace.radius.kind == "off"});
    FlowStep step;
    step.k = static_cast<int>(k);
    step.t = t;
    step.x = x;
    step.pose = decode_pose(x, model.scale);
    step.region = std::move(e.region);
    step.open_probability = e.open_probability;
    step.weights = std::move(e.weights);
    step.weight_points = std::move(e.weight_points);
    if (!last) {
      step.velocity = e.velocity;
      const double dt = times[k + 1] - t;
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = x[i] + step.velocity[i] * dt;
      step.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    }
    trace.steps.push_back(std::move(step));
  }
  trace.result.world_from_tool = trace.steps.back().pose;
  // The openness of the last evaluation on the way, where the pose is nearly there but was seen in training.
  trace.result.openness = trace.steps.back().open_probability;
  return trace;
}

}  // namespace flowscope
