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
  FlowTrace predict(const PolicyInput& input, const PredictOptions& options) override {
    return std::move(predict_samples(input, options, 1).front());
  }
  std::vector<FlowTrace> predict_samples(const PolicyInput& input, const PredictOptions& options,
                                         int count) override {
    require_same_robot(robot_, input.robot);
    const SceneInput scene = prepare_input(input, model_.bounds, model_.shape, model_.vocabulary);
    std::vector<FlowTrace> traces = integrate_samples(model_, scene, options, count);
    for (FlowTrace& trace : traces) {
      trace.instruction = input.instruction;
      trace.policy_file = file_;
      trace.generation = generation();
      trace.weights_sha256 = sha256_;
    }
    return traces;
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

std::unique_ptr<Policy> load_policy(const std::filesystem::path& file) {
  return std::make_unique<LoadedPolicy>(read_checkpoint(file), file);
}

}  // namespace flowscope
