#include "policy/trainer.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "policy/checkpoint.h"
#include "policy/data_parallel.h"
#include "policy/integrate.h"
#include "policy/learner.h"
#include "policy/learning_rate.h"
#include "policy/on_device.h"
#include "policy/one_robot.h"

namespace flowscope {
namespace {

/// While alive the network holds the running mean of its weights, on the CPU: predictions run there.
class MeanWeights {
 public:
  MeanWeights(FlowRamNetwork network, AdamW& optimizer, const torch::Device& device)
      : network_(std::move(network)), optimizer_(optimizer), device_(device) {
    optimizer_.swap_mean();
    if (!device_.is_cpu()) network_->to(torch::kCPU);
  }
  ~MeanWeights() {
    if (!device_.is_cpu()) network_->to(device_);
    optimizer_.swap_mean();
  }
  MeanWeights(const MeanWeights&) = delete;
  MeanWeights& operator=(const MeanWeights&) = delete;

 private:
  FlowRamNetwork network_;  // a shared handle
  AdamW& optimizer_;
  torch::Device device_;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Errors {
  std::vector<double> position_mm, rotation_deg;

  void add(const PoseError& error) {
    position_mm.push_back(error.position_m * 1000);
    rotation_deg.push_back(error.rotation_deg);
  }
  TaskError medians(const std::string& task) const {
    if (position_mm.empty()) return {task, 0, 0, 0};
    return {task, median(position_mm), median(rotation_deg), static_cast<int>(position_mm.size())};
  }
};

class FlowRamTrainer : public Trainer {
 public:
  FlowRamTrainer(Model model, std::unique_ptr<AdamW> optimizer, TrainProgress progress,
                 const torch::Device& device, std::shared_ptr<GradientExchange> exchange)
      : model_(std::move(model)),
        optimizer_(std::move(optimizer)),
        progress_(std::move(progress)),
        random_(progress_.random_state),
        data_(progress_.options.augment.crop),
        device_(device),
        replicas_(make_replicas(model_, progress_.rates, device)),
        exchange_(exchange ? std::move(exchange) : std::make_shared<SingleProcess>()) {
    if (progress_.status.step > 0) data_.set_frozen();
    share_weights(model_, *optimizer_, *exchange_);
  }

  void add(const Demo& demo, bool held_out) override {
    std::string& robot = progress_.options.robot;
    require_same_robot(robot, demo.info.origin.robot);
    data_.add(model_, demo, held_out);
    if (robot.empty()) robot = demo.info.origin.robot;
    progress_.status.demos = data_.demos();
  }
  void remove(const std::string& id) override {
    data_.remove(id);
    progress_.status.demos = data_.demos();
  }

  TrainStatus step(std::stop_token stop) override {
    if (!agreed_) require_agreement();
    data_.freeze(model_);
    const auto start = std::chrono::steady_clock::now();
    const std::uint64_t random_before = random_.state();
    const LearnStep how{
        .learning_rate = learning_rate_at(progress_.rates, progress_.options, progress_.status),
        .augment = progress_.options.augment,
        .seed = random_.bits(),
        .device = device_,
        .exchange = *exchange_,
        .stop = std::move(stop)};
    const StepLoss loss = learn_once(model_, replicas_, *optimizer_, data_, progress_.rates, how);
    if (loss.stopped) {
      random_ = Random(random_before);
      return progress_.status;
    }
    double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    exchange_->broadcast(&seconds, sizeof(seconds));  // the schedule must be the same on all ranks
    tell(loss, seconds);
    return progress_.status;
  }
  TrainStatus status() const override { return progress_.status; }
  void go_on_for(double minutes, std::int64_t steps) override {
    progress_.options.expected_minutes = minutes > 0 ? progress_.status.minutes + minutes : 0;
    progress_.options.expected_steps = minutes <= 0 && steps > 0 ? progress_.status.step + steps : 0;
  }
  std::uint64_t generation() const override { return static_cast<std::uint64_t>(progress_.status.step); }
  std::string robot() const override { return progress_.options.robot; }

  Validation validate(int flow_steps, std::stop_token stop) override {
    data_.freeze(model_);
    const MeanWeights mean(model_.network, *optimizer_, device_);
    Validation v;
    Errors all;
    for (const auto& [task, samples] : data_.held_out()) {
      Errors of_task;
      for (const Sample* sample : samples) {
        if (stop.stop_requested()) return progress_.status.validation;
        PredictOptions options;
        options.flow_steps = flow_steps;
        options.seed = all.position_mm.size();
        FlowTrace trace = integrate_flow(model_, sample->input, options);
        compare_with_expert(trace, sample->target);
        all.add(*trace.error);
        of_task.add(*trace.error);
      }
      v.tasks.push_back(of_task.medians(task));
    }
    const TaskError over_all = all.medians("");
    v.position_mm = over_all.position_mm;
    v.rotation_deg = over_all.rotation_deg;
    v.keyframes = over_all.keyframes;
    return progress_.status.validation = v;
  }

  std::unique_ptr<Prediction> begin(const PolicyInput& input, const PredictOptions& options,
                                    int count) override {
    data_.freeze(model_);
    require_same_robot(progress_.options.robot, input.robot);
    SceneInput scene = prepare_input(input, model_.bounds, model_.shape, model_.vocabulary);
    FlowTrace origin;
    origin.instruction = input.instruction;
    origin.generation = generation();
    {
      const MeanWeights mean(model_.network, *optimizer_, device_);
      origin.weights_sha256 = weights_sha256(model_);
    }
    return std::make_unique<MeanPrediction>(*this, std::move(scene), options, count, origin);
  }

  void require_agreement() override {
    agreed_ = true;
    if (exchange_->size() == 1) return;
    if (!same_everywhere(*exchange_, data_.fingerprint()))
      throw std::runtime_error("the processes of this training do not have the same demonstrations");
    if (!same_everywhere(*exchange_, weights_sha256(model_)))
      throw std::runtime_error("the processes of this training no longer have the same weights");
  }

  void save(const std::filesystem::path& file) const override {
    TrainProgress now = progress_;
    now.random_state = random_.state();
    now.optimizer_steps = optimizer_->steps;
    write_checkpoint(file, model_, *optimizer_, now);
  }

 private:
  /// Predictions with the running mean of the weights, which is in its place only while they go on.
  class MeanPrediction : public Prediction {
   public:
    MeanPrediction(FlowRamTrainer& trainer, SceneInput scene, const PredictOptions& options, int count,
                   const FlowTrace& origin)
        : trainer_(trainer), inner_(trainer.model_, std::move(scene), options, count, origin) {}
    bool advance(std::chrono::milliseconds slice) override {
      const MeanWeights mean(trainer_.model_.network, *trainer_.optimizer_, trainer_.device_);
      return inner_.advance(slice);
    }
    std::size_t left() const override { return inner_.left(); }
    std::vector<FlowTrace> take() override { return inner_.take(); }

   private:
    FlowRamTrainer& trainer_;
    FlowPrediction inner_;
  };

  void tell(const StepLoss& loss, double seconds) {
    TrainStatus& s = progress_.status;
    skipped_in_row_ = loss.skipped ? skipped_in_row_ + 1 : 0;
    if (skipped_in_row_ >= 3)
      throw std::runtime_error(
          "three optimiser steps in a row gave a loss or gradient that is not finite (step " +
          std::to_string(s.step) + ")");
    ++s.step;
    s.minutes += seconds / 60;
    if (loss.skipped) {
      ++s.skipped;  // the losses stay the last finite ones
    } else {
      s.loss = loss.total;
      s.loss_flow = loss.flow;
      s.loss_position = loss.position;
      s.loss_rotation = loss.rotation;
      s.loss_open = loss.open;
    }
    const double rate = progress_.rates.scenes * progress_.rates.draws * exchange_->size() / seconds;
    s.samples_per_s = s.samples_per_s == 0 ? rate : 0.95 * s.samples_per_s + 0.05 * rate;
  }

  Model model_;
  std::unique_ptr<AdamW> optimizer_;
  TrainProgress progress_;
  Random random_;
  TrainingSet data_;
  torch::Device device_;
  Replicas replicas_;
  std::shared_ptr<GradientExchange> exchange_;
  int skipped_in_row_ = 0;
  bool agreed_ = false;
};

}  // namespace

std::unique_ptr<Trainer> Trainer::create(const TrainOptions& options,
                                         std::shared_ptr<GradientExchange> exchange) {
  Preset preset = load_preset(options.preset);
  preset.shape.grounded = options.grounded;
  preset.shape.point_encoder = options.point_encoder;
  preset.shape.binding = options.binding;
  preset.shape.part_middles = options.part_middles;
  preset.radius.kind = options.radius;
  if (!options.image_branch.empty()) preset.shape.image_branch = options.image_branch;
  if (!options.text_branch.empty()) preset.shape.text_branch = options.text_branch;
  if (!options.times.empty()) preset.rates.times = options.times;
  if (options.scenes < 0) throw std::invalid_argument("scenes: at least one per step");
  if (options.scenes > 0) preset.rates.scenes = options.scenes;
  const torch::Device device = device_of(options.device);
  Model model = make_model(preset.shape, preset.radius, options.backbone, options.objective, options.seed,
                           clip_for(preset.shape, options.clip));
  model.objective = make_objective(options.objective, preset.rates.times);
  model.network->to(device);
  auto optimizer = make_optimizer(model, preset.rates);
  TrainProgress progress;
  progress.options = options;
  progress.rates = preset.rates;
  progress.random_state = options.seed;
  return std::make_unique<FlowRamTrainer>(std::move(model), std::move(optimizer), std::move(progress), device,
                                          std::move(exchange));
}

std::unique_ptr<Trainer> Trainer::resume(const std::filesystem::path& file, const std::string& device_name,
                                         std::shared_ptr<GradientExchange> exchange) {
  const torch::Device device = device_of(device_name);
  LoadedCheckpoint loaded = read_checkpoint(file, device);
  loaded.progress.options.device = device_name;
  return std::make_unique<FlowRamTrainer>(std::move(loaded.model), std::move(loaded.optimizer),
                                          std::move(loaded.progress), device, std::move(exchange));
}

}  // namespace flowscope
