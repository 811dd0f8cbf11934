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

/// Its old steps, then the rest in even steps; returns the state where it leaves them.
Vector9 start_branch(const Model& model, const PredictOptions& options, FlowTrace& trace,
                     std::vector<double>& times) {
  const PredictOptions::Branch& branch = *options.branch;
  const FlowTrace& from = *branch.from;
  trace.seed = from.seed;
  trace.steps.assign(from.steps.begin(), from.steps.begin() + branch.step);
  for (const FlowStep& s : trace.steps) times.push_back(s.t);
  const FlowStep& at = from.steps[static_cast<std::size_t>(branch.step)];
  Vector9 x = at.x;
  if (branch.position) Eigen::Map<Eigen::Vector3d>(x.data()) = model.scale.normalise(*branch.position);
  if (branch.rotation)
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(x.data() + 3) = rotation_to_6d(*branch.rotation);
  const int rest = std::max(branch.step < from.flow_steps ? 1 : 0, options.flow_steps - branch.step);
  for (int k = 0; k <= rest; ++k) times.push_back(rest == 0 ? 1.0 : model.objective->grid(at.t, k, rest));
  return x;
}

}  // namespace

FlowRun::FlowRun(const Model& model, const PredictOptions& options, std::uint64_t seed) : options_(options) {
  trace_.seed = seed;
  if (options.branch) {
    x_ = start_branch(model, options, trace_, times_);
  } else {
    Random noise(seed);
    for (double& v : x_) v = noise.normal();
    for (int k = 0; k <= options.flow_steps; ++k)
      times_.push_back(model.objective->grid(0, k, options.flow_steps));
  }
  trace_.radius = model.radius;
  if (options.radius_kind) trace_.radius.kind = *options.radius_kind;
  trace_.backbone = model.backbone;
  trace_.objective = model.objective_name;
  trace_.integrator = options.integrator;
  trace_.flow_steps = static_cast<int>(times_.size()) - 1;
}

bool FlowRun::step(const EncodedScene& scene) {
  const auto radius_at = [&](double t) {
    return options_.branch && options_.branch->radius_m ? *options_.branch->radius_m
                                                        : trace_.radius.radius_m(t);
  };
  const auto evaluate_at = [&](const FlowState& at) {
    return evaluate(scene, {at.x, at.t, radius_at(at.t), trace_.radius.kind == "off"});
  };
  const std::size_t k = trace_.steps.size();
  const auto began = std::chrono::steady_clock::now();
  const FlowState here{x_, times_[k]};
  Evaluation e = evaluate_at(here);
  FlowStep step;
  step.k = static_cast<int>(k);
  step.t = here.t;
  step.x = x_;
  step.pose = decode_pose(x_, scene.model.scale);
  step.region = std::move(e.region);
  step.open_probability = e.open_probability;
  step.weights = std::move(e.weights);
  step.weight_points = std::move(e.weight_points);
  const bool last = k + 1 == times_.size();
  if (!last) {
    const double t_next = times_[k + 1];
    Random noise = noise_of_step(trace_.seed, k);
    bool first = true;
    const auto field = [&](const FlowState& at) {
      const Answer answer = first ? e.answer : evaluate_at(at).answer;
      first = false;
      return scene.model.objective->velocity(answer, at, here, t_next, noise);
    };
    step.velocity = step_velocity(options_.integrator, field, here, t_next);
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = x_[i] + step.velocity[i] * (t_next - here.t);
    step.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
  }
  trace_.steps.push_back(std::move(step));
  if (last) {
    trace_.result.world_from_tool = trace_.steps.back().pose;
    // The openness of the last evaluation on the way, where the pose is nearly there but was seen in
    // training.
    trace_.result.openness = trace_.steps.back().open_probability;
  }
  return !last;
}

FlowPrediction::FlowPrediction(Model& model, SceneInput input, const PredictOptions& options, int count,
                               const FlowTrace& origin)
    : model_(model), input_(std::move(input)) {
  check_options(model, options, count);
  RadiusSchedule radius = model.radius;
  if (options.radius_kind) radius.kind = *options.radius_kind;
  radius.radius_m(0);  // refuses an unknown kind
  for (int i = 0; i < count; ++i) {
    FlowTrace& trace =
        runs_.emplace_back(model, options, options.seed + static_cast<std::uint64_t>(i)).trace();
    trace.instruction = origin.instruction;
    trace.policy_file = origin.policy_file;
    trace.generation = origin.generation;
    trace.weights_sha256 = origin.weights_sha256;
  }
}

bool FlowPrediction::advance(std::chrono::milliseconds slice) {
  const auto end = std::chrono::steady_clock::now() + slice;
  const torch::NoGradGuard no_grad;
  if (!scene_)
    scene_.emplace(EncodedScene{
        model_, input_, model_.network->encode(make_scene_batch({&input_}, model_.shape, model_.scale))});
  while (current_ < runs_.size()) {
    if (!runs_[current_].step(*scene_)) ++current_;
    if (std::chrono::steady_clock::now() >= end) break;
  }
  return current_ < runs_.size();
}

std::size_t FlowPrediction::left() const {
  std::size_t steps = 0;
  for (const FlowRun& run : runs_) steps += run.left();
  return steps;
}

std::vector<FlowTrace> FlowPrediction::take() {
  std::vector<FlowTrace> traces;
  for (FlowRun& run : runs_) traces.push_back(std::move(run.trace()));
  return traces;
}

std::vector<FlowTrace> integrate_samples(Model& model, const SceneInput& input, const PredictOptions& options,
                                         int count) {
  FlowPrediction prediction(model, input, options, count);
  while (prediction.advance(std::chrono::hours(1))) {
  }
  return prediction.take();
}

FlowTrace integrate_flow(Model& model, const SceneInput& input, const PredictOptions& options) {
  return std::move(integrate_samples(model, input, options, 1).front());
}

}  // namespace flowscope
