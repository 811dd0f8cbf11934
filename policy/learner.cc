#include "policy/learner.h"

#include <cmath>

namespace flowscope {
namespace {

constexpr double flow_weight = 100, open_weight = 10, precise_weight = 20;

struct Targets {
  torch::Tensor action;  ///< [B, 9] end point when grounded, else the objective's target
  torch::Tensor weight;  ///< [B, 1]
  torch::Tensor open;    ///< [B]
};

void put_row(torch::Tensor& rows, std::size_t at, const Vector9& v) {
  float* row = rows.data_ptr<float>() + at * v.size();
  for (std::size_t i = 0; i < v.size(); ++i) row[i] = static_cast<float>(v[i]);
}

}  // namespace

StepLoss learn_once(Model& model, AdamW& optimizer, const TrainingSet& data, const TrainRates& rates,
                    bool augmented, double learning_rate, Random& random) {
  std::vector<Sample> samples;
  for (int s = 0; s < rates.scenes; ++s) {
    const Sample& drawn = data.draw(random);
    samples.push_back(augmented ? augment(drawn, rates, model.scale.center, random) : drawn);
  }
  const auto count = static_cast<std::int64_t>(rates.scenes) * rates.draws;
  Targets targets{torch::empty({count, 9}), torch::empty({count, 1}), torch::empty({count})};
  std::vector<const SceneInput*> scenes;
  std::vector<Draw> draws;
  for (const Sample& s : samples) {
    scenes.push_back(&s.input);
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

  const SceneMemory memory = model.network->encode(make_scene_batch(scenes, model.shape, model.scale));
  const NetworkOutput out =
      model.network->forward(memory, make_draw_batch(scenes, draws, model.shape, model.scale), model.scale);
  const torch::Tensor error = out.action - targets.action;
  const torch::Tensor flow = (error.square() * targets.weight).mean();
  const torch::Tensor open = torch::binary_cross_entropy_with_logits(out.open_logit, targets.open);
  torch::Tensor loss = flow_weight * flow + open_weight * open;
  if (model.shape.grounded) loss = loss + precise_weight * (error.abs() * targets.weight.sqrt()).mean();

  StepLoss result{loss.item<double>(), flow.item<double>(), open.item<double>(), false};
  result.skipped = !std::isfinite(result.total);
  if (!result.skipped) {
    loss.backward();
    result.skipped = !std::isfinite(optimizer.step(learning_rate));
  }
  return result;
}

}  // namespace flowscope
