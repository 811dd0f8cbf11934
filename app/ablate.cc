#include "app/ablate.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>

namespace flowscope {
namespace {

using Kind = CellState::Kind;

/// Means of what has been seen so far, for the estimate of what is left.
class Pace {
 public:
  void trained(double minutes) { add(training_, minutes); }
  void measured(int flow_steps, double minutes) { add(measuring_[flow_steps], minutes); }
  /// For a kind of work that was not seen yet, the mean of what is nearest to it.
  double training() const { return mean(training_); }
  double measuring(int flow_steps) const {
    const auto seen = measuring_.find(flow_steps);
    if (seen != measuring_.end()) return mean(seen->second);
    double all = 0;
    for (const auto& [steps, sum] : measuring_) all += mean(sum) / static_cast<double>(measuring_.size());
    return all;
  }

 private:
  struct Sum {
    double minutes = 0;
    int count = 0;
  };
  static void add(Sum& sum, double minutes) {
    sum.minutes += minutes;
    ++sum.count;
  }
  static double mean(const Sum& sum) { return sum.count ? sum.minutes / sum.count : 0; }
  Sum training_;
  std::map<int, Sum> measuring_;
};

std::string label(const CellState& state) {
  return key_of(state.cell.variant) + " seed " + std::to_string(state.seed);
}

std::string success_of(const AblationMeasure& measure) {
  int successes = 0, episodes = 0;
  for (const TaskScore& task : measure.tasks) {
    successes += task.successes;
    episodes += task.episodes;
  }
  return std::to_string(successes) + " of " + std::to_string(episodes);
}

AblationRun run_for(const AblationStore& store, const CellState& state) {
  const AblationRun* known = store.find(state.cell.variant, state.seed);
  if (known) return *known;
  AblationRun run;
  run.variant = state.cell.variant;
  run.seed = state.seed;
  return run;
}

class Runner {
 public:
  Runner(AblationStore& store, std::vector<CellState> todo, const AblationTools& tools,
         const std::function<void(const std::string&)>& tell, const std::function<void()>& saved)
      : store_(store), todo_(std::move(todo)), tools_(tools), tell_(tell), saved_(saved) {
    for (const AblationRun& run : store_.runs()) {
      if (!run.policy.empty()) pace_.trained(run.minutes);
      for (const AblationMeasure& m : run.measures)
        if (m.failure.empty()) pace_.measured(m.flow_steps, m.seconds / 60);
    }
  }

  void run() {
    for (at_ = 0; at_ < todo_.size(); ++at_) {
      const CellState& state = todo_[at_];
      AblationRun run = run_for(store_, state);
      if (run.policy.empty() && !failed_now(state)) train(state, run);
      if (!run.policy.empty()) measure(state, run);
    }
  }

 private:
  using Clock = std::chrono::steady_clock;

  static double minutes_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count() / 60;
  }

  /// A training that failed is not tried again for each of its cells.
  bool failed_now(const CellState& state) const {
    return std::ranges::any_of(failed_, [&state](const CellState& f) {
      return f.cell.variant == state.cell.variant && f.seed == state.seed;
    });
  }

  void keep(const AblationRun& run) {
    store_.put(run);
    if (saved_) saved_();
  }

  void train(const CellState& state, AblationRun& run) {
    tell("training " + label(state), at_);
    const std::string name = key_of(state.cell.variant) + ",seed=" + std::to_string(state.seed) + ".policy";
    const auto start = Clock::now();
    try {
      const TrainedPolicy trained = tools_.train(state.cell.variant, state.seed, store_.file(name));
      run.policy = name;
      run.steps = trained.steps;
      run.minutes = trained.minutes;
      run.loss = trained.loss;
      run.failure.clear();
      pace_.trained(minutes_since(start));
    } catch (const std::exception& error) {
      run.failure = error.what();
      failed_.push_back(state);
      tell("cannot train " + label(state) + ": " + error.what(), at_ + 1);
    }
    keep(run);
  }

  void measure(const CellState& state, AblationRun& run) {
    const int steps = state.cell.flow_steps;
    const std::string what = label(state) + " at " + std::to_string(steps) + " steps";
    const auto start = Clock::now();
    AblationMeasure measure;
    try {
      measure = tools_.evaluate(store_.file(run.policy), state.seed, steps);
      measure.seconds = 60 * minutes_since(start);
      pace_.measured(steps, measure.seconds / 60);
    } catch (const std::exception& error) {
      measure = {};
      measure.failure = error.what();
    }
    measure.flow_steps = steps;
    std::erase_if(run.measures, [steps](const AblationMeasure& m) { return m.flow_steps == steps; });
    run.measures.push_back(measure);
    keep(run);
    tell(measure.failure.empty() ? what + ": " + success_of(measure)
                                 : "cannot measure " + what + ": " + measure.failure,
         at_ + 1);
  }

  double minutes_left(std::size_t from) const {
    double minutes = 0;
    const CellState* training = nullptr;
    for (std::size_t i = from; i < todo_.size(); ++i) {
      const CellState& state = todo_[i];
      const bool same =
          training && training->cell.variant == state.cell.variant && training->seed == state.seed;
      const AblationRun* known = store_.find(state.cell.variant, state.seed);
      if (!same && (!known || known->policy.empty())) minutes += pace_.training();
      minutes += pace_.measuring(state.cell.flow_steps);
      training = &state;
    }
    return minutes;
  }

  void tell(const std::string& text, std::size_t next) const {
    char left[64] = "";
    const double minutes = minutes_left(next);
    if (minutes > 0) std::snprintf(left, sizeof left, "; about %.1f min left", minutes);
    tell_("[" + std::to_string(std::min(at_ + 1, todo_.size())) + "/" + std::to_string(todo_.size()) + "] " +
          text + left);
  }

  AblationStore& store_;
  const std::vector<CellState> todo_;
  const AblationTools& tools_;
  const std::function<void(const std::string&)>& tell_;
  const std::function<void()>& saved_;
  std::vector<CellState> failed_;
  std::size_t at_ = 0;
  Pace pace_;
};

}  // namespace

std::string to_string(Kind kind) {
  switch (kind) {
    case Kind::open:
      return "open";
    case Kind::trained:
      return "trained";
    case Kind::measured:
      return "measured";
    case Kind::failed:
      return "failed";
  }
  return "";
}

std::vector<CellState> cell_states(const AblationStore& store, const std::vector<AblationCell>& cells,
                                   int seeds) {
  std::vector<AblationCell> ordered;
  for (const AblationCell& cell : cells)
    if (std::ranges::find(ordered, cell) == ordered.end()) {
      // Behind the last cell of its variant: a policy is measured while it is at hand.
      const auto last = std::find_if(ordered.rbegin(), ordered.rend(),
                                     [&cell](const AblationCell& c) { return c.variant == cell.variant; });
      ordered.insert(last == ordered.rend() ? ordered.end() : last.base(), cell);
    }
  std::vector<CellState> states;
  for (int seed = 0; seed < seeds; ++seed) {
    for (const AblationCell& cell : ordered) {
      CellState state{cell, seed, Kind::open, ""};
      if (const AblationRun* run = store.find(cell.variant, seed)) {
        const AblationMeasure* measure = run->at(cell.flow_steps);
        state.reason = measure ? measure->failure : run->failure;
        if (!state.reason.empty())
          state.kind = Kind::failed;
        else if (measure)
          state.kind = Kind::measured;
        else if (!run->policy.empty())
          state.kind = Kind::trained;
      }
      states.push_back(state);
    }
  }
  return states;
}

void run_ablation(AblationStore& store, const std::vector<AblationCell>& cells, int seeds,
                  const AblationTools& tools, const std::function<void(const std::string&)>& tell,
                  const std::function<void()>& saved) {
  std::vector<CellState> todo = cell_states(store, cells, seeds);
  std::erase_if(todo, [](const CellState& state) { return state.kind == Kind::measured; });
  Runner(store, std::move(todo), tools, tell, saved).run();
}

}  // namespace flowscope
