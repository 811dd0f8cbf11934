#include "policy/bench_infer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "policy/bench_timer.h"
#include "policy/integrate.h"
#include "policy/matrix_products.h"
#include "policy/random.h"
#include "policy/torch_parts.h"

namespace flowscope {
namespace {

/// Points on a table with waves; coloured in stripes. Nothing is to be learnt from it.
SceneInput wavy_scene(const Model& model) {
  Random random(11);
  auto scene = std::make_shared<PreparedScene>();
  for (int i = 0; i < model.shape.scene_points; ++i) {
    ScenePoint point;
    const auto x = static_cast<float>(random.uniform(0, 0.5)),
               y = static_cast<float>(random.uniform(-0.3, 0.3));
    point.position = {x, y, 0.75f + 0.05f * std::sin(20 * x) * std::cos(17 * y)};
    point.color = Eigen::Vector3f::Constant(0.5f + 0.4f * std::sin(40 * y));
    point.normal = Eigen::Vector3f::UnitZ();
    point.around.middle = point.position;
    scene->points.push_back(point);
  }
  scene->patches.resize(static_cast<std::size_t>(model.shape.image_tokens));
  for (Patch& patch : scene->patches) patch.fill(static_cast<float>(random.uniform(0, 1)));
  scene->thing.assign(scene->points.size(), 0);
  scene->part.assign(scene->points.size(), 0);
  scene->plane_z = 0.75f;
  SceneInput input;
  input.scene = scene;
  input.words = model.vocabulary.encode("push the red button", model.shape.words);
  for (RobotState& state : input.history) state.world_from_tool.position = {0.25, 0, 1.0};
  return input;
}

Model random_model(const std::string& preset_name) {
  const Preset preset = load_preset(preset_name);
  Model model = make_model(preset.shape, preset.radius, "mamba", "cfm", 1);
  model.bounds = {{0.05, -0.25, 0.75}, {0.45, 0.25, 1.1}};
  model.scale = PositionScale::from_bounds(model.bounds);
  model.vocabulary.learn("push the red button");
  return model;
}

/// The network's part of a prediction, with what goes into it made beforehand.
class NetworkRun {
 public:
  NetworkRun(Model& model, const SceneInput& input, int steps)
      : model_(model), scene_(make_scene_batch({&input}, model.shape, model.scale)) {
    Random noise(5);
    for (int k = 0; k < steps; ++k) {
      Draw draw;
      for (double& v : draw.x) v = 0.3 * noise.normal();
      draw.t = static_cast<double>(k) / steps;
      draw.radius_m = model.radius.radius_m(draw.t);
      steps_.push_back(make_draw_batch({&input}, {draw}, model.shape, model.scale));
    }
    memory_ = model.network->encode(scene_);
  }
  void encode() { memory_ = model_.network->encode(scene_); }
  void one_step() { model_.network->forward(memory_, steps_.front(), model_.scale); }
  void all_steps() {
    for (const DrawBatch& step : steps_) model_.network->forward(memory_, step, model_.scale);
  }
  void prediction() {
    encode();
    all_steps();
  }

 private:
  Model& model_;
  SceneBatch scene_;
  std::vector<DrawBatch> steps_;
  SceneMemory memory_;
};

/// Every size by itself, so that none waits for memory that another has pushed out; shared evenly among
/// torch's threads.
double alone_ms(const std::vector<MatrixProduct>& products, int repeats) {
  using Layout = std::vector<std::vector<std::int64_t>>;
  std::map<Layout, std::pair<MatrixProduct, int>> kinds;
  for (const MatrixProduct& p : products) {
    auto& kind = kinds[{p.left_size, p.left_stride, p.right_size, p.right_stride}];
    kind.first = p;
    ++kind.second;
  }
  const int threads = at::get_num_threads(), copies = 2 * threads;
  double sum = 0;
  for (const auto& [layout, kind] : kinds) {
    const std::vector<MatrixProduct> some(static_cast<std::size_t>(copies), kind.first);
    sum += kind.second * products_ms(some, repeats, threads) / copies;
  }
  return sum;
}

}  // namespace

std::vector<BenchResult> bench_infer(const InferBenchOptions& o) {
  const torch::NoGradGuard no_grad;
  Model model = random_model(o.preset);
  const SceneInput input = wavy_scene(model);
  NetworkRun run(model, input, o.flow_steps);
  const std::string steps = std::to_string(o.flow_steps);

  const double fast = fastest_run_ms(o.repeats, [&] { run.prediction(); });
  const double further = fastest_run_ms(o.repeats, [&] { run.one_step(); });
  const double full = fastest_run_ms(o.repeats, [&] {
    run.encode();
    run.one_step();
  });
  PredictOptions predict;
  predict.flow_steps = o.flow_steps;
  double next = std::numeric_limits<double>::infinity();
  const double whole = fastest_run_ms(o.repeats, [&] {
    const FlowTrace trace = integrate_flow(model, input, predict);
    for (int k = 1; k < o.flow_steps; ++k) next = std::min(next, trace.steps[static_cast<std::size_t>(k)].ms);
  });
  predict.flow_steps = 1;
  const double first = fastest_run_ms(o.repeats, [&] { integrate_flow(model, input, predict); });

  model.network->compute_by(ScanPath::operators, false);
  const double products = alone_ms(record_products([&] { run.prediction(); }), 4 * o.repeats);
  model.network->compute_by(ScanPath::operators, true);
  const double operators = fastest_run_ms(1, [&] { run.all_steps(); });

  std::vector<BenchResult> results{
      {"infer_threads", static_cast<double>(at::get_num_threads()), "threads", {}, {}},
      {"infer_" + steps + "_steps", fast, "ms", operators / fast, "LibTorch with our scan, no stored prefix"},
      {"infer_products", products, "ms", {}, {}},
      {"infer_over_products", fast / products, "x", products / fast, "the network's matrix products alone"},
      {"infer_operators", operators, "ms", {}, {}},
      {"infer_full_evaluation", full, "ms", {}, {}},
      {"infer_further_step", further, "ms", full / further, "a full evaluation"},
      {"predict_" + steps + "_steps", whole, "ms", {}, {}},
      {"predict_1_step", first, "ms", {}, {}},
      {"predict_further_step", next, "ms", first / next,
       "a prediction of one step, choice of points included"}};
  if (!o.plain_scan) return results;
  model.network->compute_by(ScanPath::plain, true);
  const auto start = std::chrono::steady_clock::now();
  run.all_steps();
  const std::chrono::duration<double, std::milli> plain = std::chrono::steady_clock::now() - start;
  results.push_back(
      {"infer_over_plain", plain.count() / fast, "x", plain.count() / fast, "LibTorch with the plain scan"});
  results.push_back({"infer_plain", plain.count(), "ms", {}, {}});
  return results;
}

}  // namespace flowscope
