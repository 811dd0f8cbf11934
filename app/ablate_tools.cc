#include "app/ablate_tools.h"

#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>

#include "app/evaluate.h"
#include "app/training_set.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

TrainedPolicy train_cell(const AblationBudget& budget, const std::filesystem::path& data,
                         const AblationVariant& variant, int seed, const std::filesystem::path& file) {
  const std::unique_ptr<Trainer> trainer = Trainer::create(train_options_of(variant, budget, seed));
  const DemoStore store(data);
  TrainingIntake intake(store);
  for (const std::string& id : demonstrations_of(store, budget.tasks)) {
    if (const std::string problem = intake.add(*trainer, id); !problem.empty())
      std::fprintf(stderr, "left out: %s\n", problem.c_str());
  }
  TrainStatus now = trainer->status();
  while (budget.steps > 0 ? now.step < budget.steps : now.minutes < budget.minutes) now = trainer->step();
  trainer->save(file);
  return {now.step, now.minutes, now.loss};
}

AblationMeasure measure_cell(const TaskLibrary& tasks, const AblationBudget& budget, int workers,
                             const std::filesystem::path& policy, int seed, int flow_steps) {
  EvalOptions options;
  options.policy = policy;
  options.tasks = budget.tasks;
  options.episodes = budget.episodes;
  options.seeds = 1;
  options.first_seed = budget.first_seed + seed;
  options.flow_steps = flow_steps;
  options.workers = workers;
  AblationMeasure measure;
  for (const EvalRow& row : evaluate(tasks, options, [](int, int) {})) {
    measure.tasks.push_back({row.task, row.successes, row.episodes, row.first_attempts, row.position_mm});
    measure.ms += row.ms / static_cast<double>(budget.tasks.size());
  }
  return measure;
}

}  // namespace

TrainOptions train_options_of(const AblationVariant& variant, const AblationBudget& budget, int seed) {
  TrainOptions options;
  options.preset = budget.preset;
  options.expected_minutes = budget.steps > 0 ? 0 : budget.minutes;
  options.expected_steps = budget.steps;
  options.seed = static_cast<std::uint64_t>(seed);
  options.backbone = variant.backbone;
  options.radius = variant.radius;
  options.point_encoder = variant.point_encoder;
  options.objective = variant.objective;
  options.grounded = variant.grounded;
  options.binding = variant.binding;
  options.part_middles = variant.part_middles;
  options.augment.move = variant.move;
  options.augment.recolor = variant.recolor;
  options.augment.repaint = variant.repaint;
  options.augment.shuffle = variant.shuffle;
  options.augment.crop = variant.crop;
  return options;
}

std::vector<std::string> demonstrations_of(const DemoStore& store, const std::vector<std::string>& tasks) {
  std::map<std::string, int> count;
  for (const std::string& task : tasks) count[task] = 0;
  std::vector<std::string> ids;
  for (const auto& info : choose_training(store.list(), tasks, false).demos) {
    ++count[info.task];
    ids.push_back(info.id);
  }
  for (const auto& [task, demos] : count)
    if (demos == 0) throw std::invalid_argument("no demonstrations of " + task);
  return ids;
}

std::string sha256_of(const std::vector<std::string>& ids) {
  std::string text;
  for (const std::string& id : ids) text += id + "\n";
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

AblationTools real_tools(const AblationBudget& budget, const std::filesystem::path& data,
                         const std::filesystem::path& assets, int workers) {
  const auto tasks = std::make_shared<const TaskLibrary>(assets);
  return {[=](const AblationVariant& variant, int seed, const std::filesystem::path& policy) {
            return train_cell(budget, data, variant, seed, policy);
          },
          [=](const std::filesystem::path& policy, int seed, int flow_steps) {
            return measure_cell(*tasks, budget, workers, policy, seed, flow_steps);
          }};
}

}  // namespace flowscope
