#include "policy/checkpoint.h"
#include "policy/integrate.h"

namespace flowscope {
namespace {

class LoadedPolicy : public Policy {
 public:
  LoadedPolicy(LoadedCheckpoint loaded, const std::filesystem::path& file)
      : model_(std::move(loaded.model)), file_(file.string()), generation_(loaded.progress.status.step) {
    loaded.optimizer->swap_mean();
    sha256_ = weights_sha256(model_);
  }
  FlowTrace predict(const PolicyInput& input, const PredictOptions& options) override {
    FlowTrace trace =
        integrate_flow(model_, prepare_input(input, model_.bounds, model_.shape, model_.vocabulary), options);
    trace.instruction = input.instruction;
    trace.policy_file = file_;
    trace.generation = generation();
    trace.weights_sha256 = sha256_;
    return trace;
  }
  std::uint64_t generation() const override { return static_cast<std::uint64_t>(generation_); }

 private:
  Model model_;
  std::string file_, sha256_;
  std::int64_t generation_;
};

}  // namespace

std::unique_ptr<Policy> load_policy(const std::filesystem::path& file) {
  return std::make_unique<LoadedPolicy>(read_checkpoint(file), file);
}

}  // namespace flowscope
