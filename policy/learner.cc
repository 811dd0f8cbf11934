#include "policy/learner.h"

#include <atomic>
#include <cmath>
#include <exception>

#include "policy/data_parallel.h"
#include "policy/on_device.h"

namespace flowscope {
namespace {

constexpr double flow_weight = 100, open_weight = 10, precise_weight = 20;
constexpr int scenes_per_part = 4;  // fewer keep a core busy with overhead

class StepStopped : public std::exception {};

/// Throws StepStopped when somebody asked for it: a part of a large network's step takes many seconds.
class StopPoint {
 public:
  explicit StopPoint(std::stop_token stop) : stop_(std::move(stop)) {}
  void operator()() const {
    if (stop_.stop_requested()) throw StepStopped();
  }
  /// The same when the gradient comes by here on its way back; the gradient stays as it is.
  void on_way_back(const torch::Tensor& tensor) const {
    if (!stop_.stop_possible() || !tensor.defined() || !tensor.requires_grad()) return;
    tensor.register_hook([here = *this](const torch::Tensor&) { here(); });
  }

 private:
  std::stop_token stop_;
};

struct Targets {
  torch::Tensor action;  ///< [B, 9] end point when grounded, else the objective's target
  torch::Tensor weight;  ///< [B, 1]
  torch::Tensor open;    ///< [B]
};

/// Some scenes of a batch with their noisy poses, as tensors on the CPU.
struct Part {
  SceneBatch scenes;
  DrawBatch draws;
  Targets targets;
};

void put_row(torch::Tensor& rows, std::size_t at, const Vector9& v) {
  float* row = rows.data_ptr<float>() + at * v.size();
  for (std::size_t i = 0; i < v.size(); ++i) row[i] = static_cast<float>(v[i]);
}

/// A stream that has nothing to do with that of another index, though their seeds are neighbours.
Random stream_of_scene(std::uint64_t seed, std::int64_t index) {
  return Random(Random(seed ^ (static_cast<std::uint64_t>(index + 1) * 0xD1B54A32D192ED03ull)).bits());
}

Sample drawn_sample(const Model& model, const TrainingSet& data, const TrainRates& rates,
                    const Augmentation& kinds, Random& random) {
  const Sample& drawn = data.draw(random);
  if (!kinds.any()) return drawn;
  if (!kinds.crop) return augment(drawn, rates, model.scale.center, random, kinds);
  return augment(with_cropped_pictures(drawn, model.bounds, model.shape, random), rates, model.scale.center,
                 random, kinds);
}

/// Scenes first … last - 1 of the whole batch.
Part make_part(const Model& model, const TrainingSet& data, const TrainRates& rates, const LearnStep& how,
               std::int64_t first, std::int64_t last) {
  const std::int64_t count = (last - first) * rates.draws;
  Targets targets{torch::empty({count, 9}), torch::empty({count, 1}), torch::empty({count})};
  std::vector<Sample> samples;
  std::vector<Draw> draws;
  const StopPoint stop_point(how.stop);
  for (std::int64_t index = first; index < last; ++index) {
    stop_point();
    Random random = stream_of_scene(how.seed, index);
    const Sample& s = samples.emplace_back(drawn_sample(model, data, rates, how.augment, random));
    const Vector9 x1 = encode_pose(s.target.world_from_tool, model.scale);
    for (int d = 0; d < rates.draws; ++d) {
      Vector9 x0;
      for (double& v : x0) v = random.normal();
      const double t = model.objective->draw_time(random);
      const Vector9 x = model.objective->noisy(x0, x1, t);
      put_row(targets.action, draws.size(), model.shape.grounded ? x1 : model.objective->target(x0, x1));
      targets.weight.data_ptr<float>()[draws.size()] =
          static_cast<float>(model.shape.grounded ? model.objective->end_point_weight(t) : 1.0);
      targets.open.data_ptr<float>()[draws.size()] = s.target.open() ? 1.f : 0.f;
      draws.push_back({x, t, model.radius.radius_m(t), model.radius.kind == "off"});
    }
  }
  std::vector<const SceneInput*> scenes;
  for (const Sample& s : samples) scenes.push_back(&s.input);
  return {make_scene_batch(scenes, model.shape, model.scale),
          make_draw_batch(scenes, draws, model.shape, model.scale), targets};
}

/// [total, flow, position, rotation, open] of one part; the first is differentiable.
struct PartLoss {
  torch::Tensor total, parts;
};

PartLoss loss_of(FlowRamNetwork& network, const Model& model, Part part, const torch::Device& device,
                 const StopPoint& stop_point) {
  stop_point();
  const SceneMemory memory = network->encode(on_device(std::move(part.scenes), device));
  stop_point();
  for (const torch::Tensor* t : {&memory.words, &memory.image, &memory.image_raw, &memory.history})
    stop_point.on_way_back(*t);
  const NetworkOutput out = network->forward(memory, on_device(std::move(part.draws), device), model.scale);
  stop_point();
  stop_point.on_way_back(out.action);
  const torch::Tensor weight = part.targets.weight.to(device), open_target = part.targets.open.to(device);
  const torch::Tensor error = out.action - part.targets.action.to(device);
  const torch::Tensor squared = error.square() * weight;
  const torch::Tensor flow = squared.mean();
  const torch::Tensor open = torch::binary_cross_entropy_with_logits(out.open_logit, open_target);
  torch::Tensor total = flow_weight * flow + open_weight * open;
  if (model.shape.grounded) total = total + precise_weight * (error.abs() * weight.sqrt()).mean();
  const torch::Tensor mean_of_number = squared.detach().mean(0);
  return {total, torch::stack({total.detach(), flow.detach(), mean_of_number.narrow(0, 0, 3).mean(),
                               mean_of_number.narrow(0, 3, 6).mean(), open.detach()})
                     .to(torch::kCPU, torch::kFloat64)};
}

}  // namespace

Replicas make_replicas(const Model& model, const TrainRates& rates, const torch::Device& device) {
  const int parts = device.is_cpu() ? (rates.scenes + scenes_per_part - 1) / scenes_per_part : 1;
  return Replicas(model.network, model.shape, model.backbone, parts);
}

StepLoss add_gradients(const Model& model, Replicas& replicas, AdamW& optimizer, const TrainingSet& data,
                       const TrainRates& rates, const LearnStep& how) {
  const std::int64_t before = static_cast<std::int64_t>(how.exchange.rank()) * rates.scenes;
  const int parts = replicas.count();
  torch::Tensor losses = torch::zeros({parts, 5}, torch::kFloat64);
  std::atomic<bool> stopped{false};
  const StopPoint stop_point(how.stop);
  replicas.run(at::get_num_threads(), [&](int part, FlowRamNetwork& network) {
    try {
      const std::int64_t first = static_cast<std::int64_t>(rates.scenes) * part / parts,
                         last = static_cast<std::int64_t>(rates.scenes) * (part + 1) / parts;
      const double share = static_cast<double>(last - first) / rates.scenes;
      const PartLoss loss =
          loss_of(network, model, make_part(model, data, rates, how, before + first, before + last),
                  how.device, stop_point);
      losses[part].copy_(loss.parts * share);
      (loss.total * share).backward();
    } catch (const StepStopped&) {
      stopped = true;
    }
  });
  if (stopped) {
    optimizer.clear_gradients();
    return {.stopped = true};
  }
  const torch::Tensor sum = losses.sum(0);
  const double* s = sum.data_ptr<double>();
  StepLoss loss{s[0], s[1], s[2], s[3], s[4]};
  average_over_ranks(optimizer, loss, how.exchange);
  return loss;
}

StepLoss learn_once(const Model& model, Replicas& replicas, AdamW& optimizer, const TrainingSet& data,
                    const TrainRates& rates, const LearnStep& how) {
  StepLoss loss = add_gradients(model, replicas, optimizer, data, rates, how);
  if (loss.stopped) return loss;
  loss.skipped = !std::isfinite(loss.total);
  if (loss.skipped)
    optimizer.clear_gradients();
  else
    loss.skipped = !std::isfinite(optimizer.step(how.learning_rate));
  return loss;
}

}  // namespace flowscope
