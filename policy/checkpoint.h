// A policy on disk: JSON header and raw tensors in one checked container. No pickled code, ever.
#pragma once

#include <filesystem>
#include <optional>

#include "policy/adamw.h"
#include "policy/model.h"
#include "policy/trainer.h"

namespace flowscope {

/// What training needs beyond the model to go on exactly where it stopped.
struct TrainProgress {
  TrainOptions options;
  TrainRates rates;
  TrainStatus status;
  std::uint64_t random_state = 0;
  std::int64_t optimizer_steps = 0;
};

/// The network's weights are written as they are now; their running mean, which predicts, comes from the
/// optimiser.
void write_checkpoint(const std::filesystem::path& file, const Model& model, const AdamW& optimizer,
                      const TrainProgress& progress);

struct LoadedCheckpoint {
  Model model;
  std::unique_ptr<AdamW> optimizer;
  TrainProgress progress;
};
/// Network and optimiser on `device`. Throws BadCheckpoint naming file and place.
LoadedCheckpoint read_checkpoint(const std::filesystem::path& file,
                                 const torch::Device& device = torch::kCPU);

/// An optimiser over the model's weights with zero moments.
std::unique_ptr<AdamW> make_optimizer(const Model& model, const TrainRates& rates);

/// SHA-256 of the weights in the network now, names and shapes included.
std::string weights_sha256(const Model& model);

}  // namespace flowscope
