#include "policy/checkpoint.h"
#include "policy/integrate.h"
#include "policy/one_robot.h"

namespace flowscope {
namespace {

class LoadedPolicy : public Policy {
 public:
  LoadedPolicy(LoadedCheckpoint loaded, const std::filesystem::path& file)
      : model_(std::move(loaded.model)),
        file_(file.string()),
        generation_(loaded.progress.status.step),
        robot_(loaded.progress.options.robot) {
    loaded.optimizer->swap_mean();
    sha256_ = weights_sha256(model_);
  }
  std::unique_ptr<Prediction> begin(const PolicyInput& input, const PredictOptions& options,
                                    int count) override {
    require_same_robot(robot_, input.robot);
    SceneInput scene = prepare_input(input, model_.bounds, model_.shape, model_.vocabulary);
    FlowTrace origin;
    origin.instruction = input.instruction;
    origin.policy_file = file_;
    origin.generation = generation();
    origin.weights_sha256 = sha256_;
    return std::make_unique<FlowPrediction>(model_, std::move(scene), options, count, std::move(origin));
  }
  std::uint64_t generation() const override { return static_cast<std::uint64_t>(generation_); }
  std::string robot() const override { return robot_; }

 private:
  Model model_;
  std::string file_, sha256_;
  std::int64_t generation_;
  std::string robot_;
};

}  // namespace

std::vector<FlowTrace> Policy::predict_samples(const PolicyInput& input, const PredictOptions& options,
                                               int count) {
  const auto prediction = begin(input, options, count);
  while (prediction->advance(std::chrono::hours(1))) {
  }
  return prediction->take();
}

FlowTrace Policy::predict(const PolicyInput& input, const PredictOptions& options) {
  return std::move(predict_samples(input, options, 1).front());
}

std::unique_ptr<Policy> load_policy(const std::filesystem::path& file) {
  return std::make_unique<LoadedPolicy>(read_checkpoint(file), file);
}

}  // namespace flowscope
