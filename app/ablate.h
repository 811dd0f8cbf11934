// Trains and measures the cells of an ablation, one after another, as far as they are not on disk already.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/ablate_store.h"

namespace flowscope {

struct TrainedPolicy {
  std::int64_t steps = 0;
  double minutes = 0, loss = 0;
};

/// How it is done; what these throw becomes the cell's reason and the rest goes on.
struct AblationTools {
  std::function<TrainedPolicy(const AblationVariant& variant, int seed, const std::filesystem::path& policy)>
      train;
  /// On the unseen scenes of this seed.
  std::function<AblationMeasure(const std::filesystem::path& policy, int seed, int flow_steps)> evaluate;
};

/// Where a cell stands with one training seed.
struct CellState {
  AblationCell cell;
  int seed = 0;
  enum class Kind { open, trained, measured, failed } kind = Kind::open;
  std::string reason;  ///< of a failure
};
std::string to_string(CellState::Kind kind);

/// Cells times seeds in the order of work: seed by seed, so that every comparison is complete early, and all
/// steps of a variant together. Cells that are named twice count once.
std::vector<CellState> cell_states(const AblationStore& store, const std::vector<AblationCell>& cells,
                                   int seeds);

/// What failed before is tried again. `tell` receives one plain line per event; `saved` is called after each
/// write of results.json.
void run_ablation(AblationStore& store, const std::vector<AblationCell>& cells, int seeds,
                  const AblationTools& tools, const std::function<void(const std::string& line)>& tell,
                  const std::function<void()>& saved = {});

}  // namespace flowscope
