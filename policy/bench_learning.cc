#include "policy/bench_learning.h"

#include <ATen/Parallel.h>
#include <malloc.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>

#include "policy/bench_timer.h"
#include "policy/checkpoint.h"
#include "policy/learner.h"
#include "policy/matrix_products.h"

namespace flowscope {
namespace {

/// Everything that one step of learning needs.
class LearningRoom {
 public:
  LearningRoom(const std::vector<Demo>& demos, const std::string& name)
      : preset_(load_preset(name)),
        model_(make_model(preset_.shape, preset_.radius, "mamba", "cfm", 0)),
        optimizer_(make_optimizer(model_, preset_.rates)),
        replicas_(make_replicas(model_, preset_.rates, torch::kCPU)) {
    for (const Demo& demo : demos) data_.add(model_, demo, false);
    data_.freeze(model_);
  }
  int samples() const { return preset_.rates.scenes * preset_.rates.draws; }
  void step() {
    const LearnStep how{
        .learning_rate = 1e-4, .augment = {}, .seed = ++steps_, .device = torch::kCPU, .exchange = alone_};
    if (learn_once(model_, replicas_, *optimizer_, data_, preset_.rates, how).skipped)
      throw std::runtime_error("bench: a step gave a loss that is not finite");
  }
  void run_by(ScanPath path) {
    replicas_.run(1, [path](int, FlowRamNetwork& network) {
      for (const auto& module : network->modules())
        if (auto* stack = dynamic_cast<BackboneImpl*>(module.get())) stack->run_by(path);
    });
  }

 private:
  Preset preset_;
  Model model_;
  std::unique_ptr<AdamW> optimizer_;
  Replicas replicas_;
  TrainingSet data_;
  SingleProcess alone_;
  std::uint64_t steps_ = 0;
};

/// The products of one step come in the order of its parts, so equal shares are what the threads had.
std::vector<MatrixProduct> products_of_step(LearningRoom& room) {
  const int threads = at::get_num_threads();
  at::set_num_threads(1);  // the callback hears this thread alone
  std::vector<MatrixProduct> products = record_products([&] { room.step(); });
  at::set_num_threads(threads);
  return products;
}

/// A line of /proc/self/status, MiB.
double status_mib(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kib = 0;
    if (word == key + ":" && status >> kib) return kib / 1024;
  }
  return 0;
}

/// Growth of the resident memory during `work`, at its highest; nothing where the kernel does not tell.
std::optional<double> peak_mib(const std::function<void()>& work) {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;  // the peak starts again from here
  const double before = status_mib("VmRSS");
  if (before == 0 || status_mib("VmHWM") > before * 1.02 + 1) return std::nullopt;
  work();
  return status_mib("VmHWM") - before;
}

}  // namespace

std::vector<BenchResult> bench_learning(const std::vector<Demo>& demos, const LearnBenchOptions& o) {
  LearningRoom room(demos, o.preset);
  room.step();  // gradients and moments lie in memory from here on
  const std::optional<double> memory = peak_mib([&] { room.step(); });
  const std::vector<MatrixProduct> multiplied = products_of_step(room);
  double step = std::numeric_limits<double>::infinity(), products = step;
  for (int i = 0; i < o.steps; ++i) {  // in turn, so that a busy machine is as busy for both
    step = std::min(step, fastest_run_ms(1, [&] { room.step(); }));
    products = std::min(products, products_ms(multiplied, 1, at::get_num_threads()));
  }
  std::vector<BenchResult> results{
      {"train_" + o.preset, room.samples() / step * 1000, "samples/s", {}, {}},
      {"train_step_" + o.preset, step, "ms", products / step, "its matrix products alone"},
      {"train_products_" + o.preset, products, "ms", {}, {}}};
  if (memory) results.push_back({"train_memory_" + o.preset, *memory / room.samples(), "MiB/sample", {}, {}});
  if (o.plain_steps > 0) {
    room.run_by(ScanPath::plain);
    const double plain = fastest_run_ms(o.plain_steps, [&] { room.step(); });
    results.push_back({"train_step_plain_" + o.preset, plain, "ms", {}, {}});
    results.push_back({"train_step_" + o.preset, step, "ms", plain / step, "torch's operators, plain scan"});
  }
  return results;
}

}  // namespace flowscope
