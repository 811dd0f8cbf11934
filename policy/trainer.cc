#include "policy/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "policy/checkpoint.h"
#include "policy/integrate.h"
#include "policy/learner.h"

namespace flowscope {
namespace {

/// While alive the network holds the running mean of its weights.
class MeanWeights {
 public:
  explicit MeanWeights(AdamW& optimizer) : optimizer_(optimizer) { optimizer_.swap_mean(); }
  ~MeanWeights() { optimizer_.swap_mean(); }
  MeanWeights(const MeanWeights&) = delete;
  MeanWeights& operator=(const MeanWeights&) = delete;

 private:
  AdamW& optimizer_;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class FlowRamTrainer : public Trainer {
 public:
  FlowRamTrainer(Model model, std::unique_ptr<AdamW> optimizer, TrainProgress progress)
      : model_(std::move(model)),
        optimizer_(std::move(optimizer)),
        progress_(std::move(progress)),
        random_(progress_.random_state) {
    if (progress_.status.step > 0) data_.set_frozen();
  }

  void add(const Demo& demo, bool held_out) override {
    data_.add(model_, demo, held_out);
    progress_.status.demos = data_.demos();
  }
  void remove(const std::string& id) override {
    data_.remove(id);
    progress_.status.demos = data_.demos();
  }

  TrainStatus step() override {
    data_.freeze(model_);
    const auto start = std::chrono::steady_clock::now();
    const StepLoss loss = learn_once(model_, *optimizer_, data_, progress_.rates, progress_.options.augment,
                                     learning_rate(), random_);
    skipped_in_row_ = loss.skipped ? skipped_in_row_ + 1 : 0;
    if (skipped_in_row_ >= 3)
      throw std::runtime_error(
          "three optimiser steps in a row gave a loss or gradient that is not finite (step " +
          std::to_string(progress_.status.step) + ")");
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    TrainStatus& s = progress_.status;
    ++s.step;
    s.minutes += seconds / 60;
    s.loss = loss.total;
    s.loss_flow = loss.flow;
    s.loss_open = loss.open;
    const double rate = progress_.rates.scenes * progress_.rates.draws / seconds;
    s.samples_per_s = s.samples_per_s == 0 ? rate : 0.95 * s.samples_per_s + 0.05 * rate;
    return s;
  }
  TrainStatus status() const override { return progress_.status; }
  void go_on_for(double minutes) override {
    progress_.options.expected_minutes = minutes > 0 ? progress_.status.minutes + minutes : 0;
    progress_.options.expected_steps = 0;
  }
  std::uint64_t generation() const override { return static_cast<std::uint64_t>(progress_.status.step); }

  Validation validate(int flow_steps) override {
    data_.freeze(model_);
    const MeanWeights mean(*optimizer_);
    std::vector<double> position_mm, rotation_deg;
    for (const Sample* sample : data_.held_out()) {
      PredictOptions options;
      options.flow_steps = flow_steps;
      options.seed = position_mm.size();
      FlowTrace trace = integrate_flow(model_, sample->input, options);
      compare_with_expert(trace, sample->target);
      position_mm.push_back(trace.error->position_m * 1000);
      rotation_deg.push_back(trace.error->rotation_deg);
    }
    Validation v;
    v.keyframes = static_cast<int>(position_mm.size());
    if (v.keyframes > 0) {
      v.position_mm = median(position_mm);
      v.rotation_deg = median(rotation_deg);
    }
    return progress_.status.validation = v;
  }

  FlowTrace predict(const PolicyInput& input, const PredictOptions& options) override {
    data_.freeze(model_);
    const MeanWeights mean(*optimizer_);
    FlowTrace trace =
        integrate_flow(model_, prepare_input(input, model_.bounds, model_.shape, model_.vocabulary), options);
    trace.instruction = input.instruction;
    trace.generation = generation();
    trace.weights_sha256 = weights_sha256(model_);
    return trace;
  }

  void save(const std::filesystem::path& file) const override {
    TrainProgress now = progress_;
    now.random_state = random_.state();
    now.optimizer_steps = optimizer_->steps;
    write_checkpoint(file, model_, *optimizer_, now);
  }

 private:
  /// Warm-up, then level; with an expected end, a half cosine down to 2 %.
  double learning_rate() const {
    const TrainRates& r = progress_.rates;
    const double warm =
        std::min(1.0, (static_cast<double>(progress_.status.step) + 1) / std::max(1, r.warmup_steps));
    const TrainOptions& o = progress_.options;
    double done = 0;
    if (o.expected_minutes > 0)
      done = progress_.status.minutes / o.expected_minutes;
    else if (o.expected_steps > 0)
      done = static_cast<double>(progress_.status.step) / static_cast<double>(o.expected_steps);
    const double fall = 0.02 + 0.98 * 0.5 * (1 + std::cos(std::numbers::pi * std::clamp(done, 0.0, 1.0)));
    return r.learning_rate * warm * fall;
  }

  Model model_;
  std::unique_ptr<AdamW> optimizer_;
  TrainProgress progress_;
  Random random_;
  TrainingSet data_;
  int skipped_in_row_ = 0;
};

}  // namespace

std::unique_ptr<Trainer> Trainer::create(const TrainOptions& options) {
  Preset preset = load_preset(options.preset);
  preset.shape.grounded = options.grounded;
  preset.shape.point_encoder = options.point_encoder;
  preset.radius.kind = options.radius;
  Model model = make_model(preset.shape, preset.radius, options.backbone, options.objective, options.seed);
  auto optimizer = make_optimizer(model, preset.rates);
  TrainProgress progress;
  progress.options = options;
  progress.rates = preset.rates;
  progress.random_state = options.seed;
  return std::make_unique<FlowRamTrainer>(std::move(model), std::move(optimizer), std::move(progress));
}

std::unique_ptr<Trainer> Trainer::resume(const std::filesystem::path& file) {
  LoadedCheckpoint loaded = read_checkpoint(file);
  return std::make_unique<FlowRamTrainer>(std::move(loaded.model), std::move(loaded.optimizer),
                                          std::move(loaded.progress));
}

}  // namespace flowscope
