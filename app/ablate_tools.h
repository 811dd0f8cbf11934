// How an ablation's cells are trained and measured for real: with the trainer and the evaluation of this
// process.
#pragma once

#include "app/ablate.h"
#include "policy/trainer.h"
#include "recorder/demo_store.h"

namespace flowscope {

/// The training options of a variant.
TrainOptions train_options_of(const AblationVariant& variant, const AblationBudget& budget, int seed);

/// Ids of the demonstrations of these tasks, in the order of the store, and their SHA-256 for
/// AblationBudget::demonstrations. Unfinished ones are left out. Throws std::invalid_argument naming a task
/// that has none, or the robots where there are several.
std::vector<std::string> demonstrations_of(const DemoStore& store, const std::vector<std::string>& tasks);
std::string sha256_of(const std::vector<std::string>& ids);

/// `assets` with the tasks; `workers` run episodes side by side.
AblationTools real_tools(const AblationBudget& budget, const std::filesystem::path& data,
                         const std::filesystem::path& assets, int workers);

}  // namespace flowscope
