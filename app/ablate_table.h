// The tables of an ablation in the layouts of the publication (FlowRAM, CVPR 2025), as Markdown.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/ablate_store.h"

namespace flowscope {

/// One cell over all its training seeds.
struct CellSummary {
  int successes = 0, first_attempts = 0, episodes = 0;
  double low = 0, high = 1;      ///< 95 % Wilson interval of successes / episodes
  std::vector<double> by_seed;   ///< fraction per training seed
  double ms = 0;                 ///< per prediction, mean over the seeds
  std::vector<TaskScore> tasks;  ///< summed over the seeds; position_mm is their mean
};

/// Over the seeds measured so far; nothing when there is none.
std::optional<CellSummary> summarise(const std::vector<AblationRun>& runs, const AblationCell& cell);

struct AblationTable {
  std::string name;
  std::vector<AblationCell> cells;  ///< what must be measured to fill it
  /// Cells without a result print as "-".
  std::function<std::string(const std::vector<AblationRun>&)> markdown;
};

struct TableChoice {
  std::vector<std::string> names;  ///< 3, 4, C, precise, ours
  /// Of Tables 4, C and precise, the last of them of Table 3, the first of ours; empty: as published (50 for
  /// Table 3, 2 to 32 for the others) and 4 for ours. DDPM always takes its 100.
  std::vector<int> flow_steps;
  bool paper_form = false;         ///< Tables 3, 4, C and precise on the paper's own parameterisation
  std::vector<std::string> tasks;  ///< columns of the precise tasks' figure
};

/// 3: architecture, DRS, point encoder and objective. 4: steps, DDIM against CFM. C: steps, with and without
/// DRS. precise: tasks by objective and steps (the publication's bar chart). ours: what this implementation
/// adds, each taken out. Throws std::invalid_argument for another name.
std::vector<AblationTable> make_tables(const TableChoice& choice);

/// One row per cell, each once: a grid, or what the layouts above leave out.
AblationTable make_cell_table(const std::string& title, const std::vector<AblationCell>& cells);

}  // namespace flowscope
