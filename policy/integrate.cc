#include "policy/integrate.h"

#include <chrono>
#include <stdexcept>

#include "policy/integrator.h"

namespace flowscope {
namespace {

struct Evaluation {
  Answer answer;
  double open_probability = 0;
  Region region;
  std::vector<float> weights;
  std::vector<Eigen::Vector3f> weight_points;
};

/// A scene as the network keeps it along the flow.
struct EncodedScene {
  Model& model;
  const SceneInput& input;
  SceneMemory memory;
};

std::vector<Eigen::Vector3f> rows_of(const torch::Tensor& points) {
  const torch::Tensor flat = points.contiguous().view({-1, 3});
  const auto* first = flat.data_ptr<float>();
  std::vector<Eigen::Vector3f> out;
  for (std::int64_t i = 0; i < flat.size(0); ++i)
    out.emplace_back(first[3 * i], first[3 * i + 1], first[3 * i + 2]);
  return out;
}

Evaluation evaluate(const EncodedScene& scene, const Draw& draw) {
  Model& model = scene.model;
  std::vector<RegionPoints> regions;
  const DrawBatch batch = make_draw_batch({&scene.input}, {draw}, model.shape, model.scale, &regions);
  const NetworkOutput out = model.network->forward(scene.memory, batch, model.scale);
  Evaluation e;
  const torch::Tensor row = out.action.contiguous();
  for (std::size_t i = 0; i < e.answer.value.size(); ++i)
    e.answer.value[i] = static_cast<double>(row.data_ptr<float>()[i]);
  e.answer.end_point = model.shape.grounded;
  e.open_probability = torch::sigmoid(out.open_logit).item<double>();
  e.region.center = model.scale.denormalise(Eigen::Map<const Eigen::Vector3d>(draw.x.data()));
  e.region.radius_m = draw.radius_m;
  e.region.points = regions[0].points_inside;
  for (std::size_t i = 0; i < regions[0].index.size(); ++i)
    if (regions[0].inside[i])
      e.region.inside.push_back(
          scene.input.scene->points[static_cast<std::size_t>(regions[0].index[i])].position);
  if (out.weights.defined()) {
    const torch::Tensor w = out.weights.contiguous();
    e.weights.assign(w.data_ptr<float>(), w.data_ptr<float>() + w.numel());
    e.weight_points = rows_of(out.weight_position);
  }
  return e;
}

void check_options(const Model& model, const PredictOptions& options, int count) {
  if (options.flow_steps < 1 || options.flow_steps > 1000)
    throw std::invalid_argument("flow_steps must be from 1 to 1000, not " +
                                std::to_string(options.flow_steps));
  if (count < 1) throw std::invalid_argument("there must be at least one sample");
  if (options.integrator != "euler" && !model.objective->is_flow())
    throw std::invalid_argument("the integrator '" + options.integrator + "' needs a flow; the objective " +
                                model.objective_name + " takes steps of its own");
  if (!options.branch) return;
  const auto& b = *options.branch;
  if (!b.from) throw std::invalid_argument("a branch needs the trace that it leaves");
  if (count > 1)
    throw std::invalid_argument("a branch has the noise of the trace that it leaves: one sample");
  if (b.step < 0 || b.step >= static_cast<int>(b.from->steps.size()))
    throw std::invalid_argument("the trace has no step " + std::to_string(b.step));
  if (b.radius_m && !(*b.radius_m > 0)) throw std::invalid_argument("the radius must be positive, in metres");
}

/// Noise of step k alone, so that a branch meets the noise that its parent met there.
Random noise_of_step(std::uint64_t seed, std::size_t k) { return Random(Random(seed).bits() + k); }

/// Where a trace starts to be computed: what is copied, the first state, and the time grid.
struct Start {
  FlowTrace trace;
  std::vector<double> times;
  Vector9 x{};
};

Start from_noise(const Model& model, const PredictOptions& options, std::uint64_t seed) {
  Start start;
  start.trace.seed = seed;
  Random noise(seed);
  for (double& v : start.x) v = noise.normal();
  for (int k = 0; k <= options.flow_steps; ++k)
    start.times.push_back(model.objective->grid(0, k, options.flow_steps));
  return start;
}

/// Its old steps, then the rest in even steps.
Start from_branch(const Model& model, const PredictOptions& options) {
  const PredictOptions::Branch& branch = *options.branch;
  const FlowTrace& from = *branch.from;
  Start start;
  start.trace.seed = from.seed;
  start.trace.steps.assign(from.steps.begin(), from.steps.begin() + branch.step);
  for (const FlowStep& s : start.trace.steps) start.times.push_back(s.t);
  const FlowStep& at = from.steps[static_cast<std::size_t>(branch.step)];
  start.x = at.x;
  if (branch.position) Eigen::Map<Eigen::Vector3d>(start.x.data()) = model.scale.normalise(*branch.position);
  if (branch.rotation)
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(start.x.data() + 3) = rotation_to_6d(*branch.rotation);
  const int rest = std::max(branch.step < from.flow_steps ? 1 : 0, options.flow_steps - branch.step);
  for (int k = 0; k <= rest; ++k)
    start.times.push_back(rest == 0 ? 1.0 : model.objective->grid(at.t, k, rest));
  return start;
}

FlowTrace integrate(const EncodedScene& scene, const PredictOptions& options, Start start) {
  const Model& model = scene.model;
  FlowTrace trace = std::move(start.trace);
  trace.radius = model.radius;
  if (options.radius_kind) trace.radius.kind = *options.radius_kind;
  trace.backbone = model.backbone;
  trace.objective = model.objective_name;
  trace.integrator = options.integrator;
  trace.flow_steps = static_cast<int>(start.times.size()) - 1;
  const auto radius_at = [&](double t) {
    return options.branch && options.branch->radius_m ? *options.branch->radius_m : trace.radius.radius_m(t);
  };
  const auto evaluate_at = [&](const FlowState& at) {
    return evaluate(scene, {at.x, at.t, radius_at(at.t), trace.radius.kind == "off"});
  };

  Vector9 x = start.x;
  for (std::size_t k = trace.steps.size(); k < start.times.size(); ++k) {
    const auto began = std::chrono::steady_clock::now();
    const FlowState here{x, start.times[k]};
    Evaluation e = evaluate_at(here);
    FlowStep step;
    step.k = static_cast<int>(k);
    step.t = here.t;
    step.x = x;
    step.pose = decode_pose(x, model.scale);
    step.region = std::move(e.region);
    step.open_probability = e.open_probability;
    step.weights = std::move(e.weights);
    step.weight_points = std::move(e.weight_points);
    if (k + 1 < start.times.size()) {
      const double t_next = start.times[k + 1];
      Random noise = noise_of_step(trace.seed, k);
      bool first = true;
      const auto field = [&](const FlowState& at) {
        const Answer answer = first ? e.answer : evaluate_at(at).answer;
        first = false;
        return model.objective->velocity(answer, at, here, t_next, noise);
      };
      step.velocity = step_velocity(options.integrator, field, here, t_next);
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = x[i] + step.velocity[i] * (t_next - here.t);
      step.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
    }
    trace.steps.push_back(std::move(step));
  }
  trace.result.world_from_tool = trace.steps.back().pose;
  // The openness of the last evaluation on the way, where the pose is nearly there but was seen in training.
  trace.result.openness = trace.steps.back().open_probability;
  return trace;
}

}  // namespace

std::vector<FlowTrace> integrate_samples(Model& model, const SceneInput& input, const PredictOptions& options,
                                         int count) {
  check_options(model, options, count);
  RadiusSchedule radius = model.radius;
  if (options.radius_kind) radius.kind = *options.radius_kind;
  radius.radius_m(0);  // refuses an unknown kind
  std::vector<Start> starts;
  for (int i = 0; i < count; ++i)
    starts.push_back(options.branch
                         ? from_branch(model, options)
                         : from_noise(model, options, options.seed + static_cast<std::uint64_t>(i)));

  const torch::NoGradGuard no_grad;
  const EncodedScene scene{model, input,
                           model.network->encode(make_scene_batch({&input}, model.shape, model.scale))};
  std::vector<FlowTrace> traces;
  // One after the other: in one batch the matrix products would round otherwise than for one sample.
  for (Start& start : starts) traces.push_back(integrate(scene, options, std::move(start)));
  return traces;
}

FlowTrace integrate_flow(Model& model, const SceneInput& input, const PredictOptions& options) {
  return std::move(integrate_samples(model, input, options, 1).front());
}

}  // namespace flowscope
