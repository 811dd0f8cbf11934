// The ablation runner with trainings and evaluations that are only pretended.
#include "app/ablate.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "app/ablate_table.h"
#include "app/ablate_tools.h"
#include "app/evaluate.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Kind = CellState::Kind;

AblationVariant with_objective(const std::string& objective) {
  AblationVariant v;
  v.objective = objective;
  return v;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

template <typename Call>
std::string complaint_of(Call&& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

class Ablation : public ::testing::Test {
 protected:
  AblationBudget budget() const {
    AblationBudget b;
    b.preset = "nano";
    b.tasks = {"push_buttons", "close_jar"};
    b.demonstrations = "abc";
    b.steps = 10;
    b.episodes = 4;
    return b;
  }
  AblationStore store() const { return {folder_.path() / "out", budget()}; }

  /// Seeds succeed 1, 2, 3, … times of 4 in the first task and never in the second.
  AblationTools tools() {
    return {[this](const AblationVariant& variant, int seed, const std::filesystem::path& policy) {
              events_.push_back("train " + key_of(variant) + " " + std::to_string(seed));
              if (variant.objective == "broken") throw std::invalid_argument("no such objective");
              std::ofstream(policy) << key_of(variant);
              return TrainedPolicy{10, 0.5, 0.1};
            },
            [this](const std::filesystem::path& policy, int seed, int flow_steps) {
              std::string key;
              std::ifstream(policy) >> key;
              events_.push_back("evaluate " + key + " " + std::to_string(seed) + " at " +
                                std::to_string(flow_steps));
              if (events_.size() == stop_at_) throw Killed();
              if (flow_steps == 1000) throw std::runtime_error("too many steps");
              AblationMeasure m;
              m.tasks = {{"push_buttons", seed + 1, 4, seed, 10.0 + seed}, {"close_jar", 0, 4, 0, 20.0}};
              m.ms = 5.0 * flow_steps;
              return m;
            }};
  }
  void run(AblationStore& store, const std::vector<AblationCell>& cells, int seeds) {
    run_ablation(store, cells, seeds, tools(), [this](const std::string& line) { lines_.push_back(line); });
  }

  struct Killed {};  // no std::exception: like the end of the program
  const testing::TemporaryFolder folder_;
  std::vector<std::string> events_, lines_;
  std::size_t stop_at_ = 0;
};

TEST_F(Ablation, TrainsEachVariantOncePerSeedAndMeasuresItAtAllItsSteps) {
  AblationStore results = store();
  run(results, {{with_objective("cfm"), 2}, {with_objective("ddim"), 2}, {with_objective("cfm"), 4}}, 2);
  EXPECT_EQ(events_, (std::vector<std::string>{"train full 0", "evaluate full 0 at 2", "evaluate full 0 at 4",
                                               "train objective=ddim 0", "evaluate objective=ddim 0 at 2",
                                               "train full 1", "evaluate full 1 at 2", "evaluate full 1 at 4",
                                               "train objective=ddim 1", "evaluate objective=ddim 1 at 2"}));
  const auto summary = summarise(results.runs(), {with_objective("cfm"), 4});
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->successes, 3);
  EXPECT_EQ(summary->episodes, 16);
  EXPECT_EQ(summary->first_attempts, 1);
  EXPECT_EQ(summary->by_seed, (std::vector<double>{1.0 / 8, 2.0 / 8}));
  EXPECT_DOUBLE_EQ(summary->ms, 20);
  EXPECT_DOUBLE_EQ(summary->tasks.at(0).position_mm, 10.5);
  EXPECT_EQ(std::pair(summary->low, summary->high), wilson_interval(3, 16));
}

TEST_F(Ablation, GoesOnWhereItWasKilled) {
  const std::vector<AblationCell> cells{{{}, 2}, {{}, 4}, {with_objective("ddim"), 2}};
  stop_at_ = 3;
  {
    AblationStore results = store();
    EXPECT_THROW(run(results, cells, 1), Killed);
  }
  AblationStore again = store();
  const auto states = cell_states(again, cells, 1);
  EXPECT_EQ(states.at(0).kind, Kind::measured);
  EXPECT_EQ(states.at(1).kind, Kind::trained);
  EXPECT_EQ(states.at(2).kind, Kind::open);
  stop_at_ = 0;
  events_.clear();
  run(again, cells, 1);
  EXPECT_EQ(events_, (std::vector<std::string>{"evaluate full 0 at 4", "train objective=ddim 0",
                                               "evaluate objective=ddim 0 at 2"}));
  events_.clear();
  AblationStore finished = store();
  run(finished, cells, 1);
  EXPECT_EQ(events_, std::vector<std::string>{});
  run(finished, cells, 2);
  EXPECT_EQ(events_.size(), 5u) << "one more seed is only its own work";
  EXPECT_EQ(finished.document(), store().document());
}

TEST_F(Ablation, RecordsWhyACellCannotRunAndGoesOn) {
  AblationStore results = store();
  const std::vector<AblationCell> cells{
      {with_objective("broken"), 2}, {with_objective("broken"), 4}, {{}, 1000}, {{}, 4}};
  run(results, cells, 1);
  EXPECT_EQ(std::count(events_.begin(), events_.end(), "train objective=broken 0"), 1);
  const auto states = cell_states(store(), cells, 1);
  EXPECT_EQ(states.at(0).kind, Kind::failed);
  EXPECT_EQ(states.at(1).reason, "no such objective");
  EXPECT_EQ(states.at(2).reason, "too many steps");
  EXPECT_EQ(states.at(3).kind, Kind::measured);
  EXPECT_FALSE(summarise(results.runs(), cells[2]));
  EXPECT_TRUE(contains(lines_.at(1), "cannot train objective=broken seed 0: no such objective"));
}

TEST_F(Ablation, TellsHowFarItIsAndWhatIsLeft) {
  AblationStore results = store();
  run(results, {{{}, 2}, {{}, 4}}, 1);
  ASSERT_EQ(lines_.size(), 3u);
  EXPECT_TRUE(contains(lines_[0], "[1/2] training full seed 0"));
  EXPECT_TRUE(contains(lines_[1], "[1/2] full seed 0 at 2 steps: 1 of 8"));
  EXPECT_TRUE(contains(lines_[2], "[2/2] full seed 0 at 4 steps: 1 of 8"));
  AblationRun slow;  // a training of half an hour lies behind
  slow.variant = with_objective("ddpm");
  slow.policy = "slow.policy";
  slow.minutes = 30;
  slow.measures = {{2, {}, 0, 600, ""}};
  AblationStore other(folder_.path() / "other", budget());
  other.put(slow);
  lines_.clear();
  run(other, {{{}, 2}}, 2);
  EXPECT_TRUE(contains(lines_.at(0), "about 80.0 min left")) << lines_.at(0);
}

TEST_F(Ablation, RefusesAFolderOfAnotherBudgetAndNamesTheDifference) {
  {
    AblationStore results = store();
    run(results, {{{}, 2}}, 1);
  }
  AblationBudget other = budget();
  other.episodes = 25;
  other.tasks = {"push_buttons"};
  const std::string text = complaint_of([&] { AblationStore(folder_.path() / "out", other); });
  EXPECT_TRUE(contains(text, "results.json")) << text;
  EXPECT_TRUE(contains(text, "episodes 4 and not 25")) << text;
  EXPECT_TRUE(contains(text, R"(tasks ["push_buttons","close_jar"] and not ["push_buttons"])")) << text;
  EXPECT_FALSE(contains(text, "preset")) << text;
}

TEST_F(Ablation, RefusesResultsThatAreNone) {
  std::string good;
  {
    AblationStore results = store();
    run(results, {{{}, 2}}, 1);
    good = results.document().dump();
  }
  const auto file = folder_.path() / "out" / "results.json";
  const auto complaint = [&](const std::string& text) {
    std::ofstream(file, std::ios::trunc) << text;
    return complaint_of([this] { store(); });
  };
  EXPECT_EQ(complaint(good), "");
  for (const std::string& bad :
       {std::string(""), std::string("[]"), std::string("{}"), good.substr(0, good.size() / 2)})
    EXPECT_TRUE(contains(complaint(bad), "results.json: ")) << bad;
  auto json = nlohmann::ordered_json::parse(good);
  json["runs"][0]["policy"] = "../elsewhere";
  EXPECT_TRUE(contains(complaint(json.dump()), "'../elsewhere' is not a file name"));
}

TEST_F(Ablation, TableFourHasThePublishedLayout) {
  AblationStore results = store();
  TableChoice choice;
  choice.names = {"4"};
  choice.flow_steps = {2, 4};
  const AblationTable table = make_tables(choice).at(0);
  EXPECT_EQ(table.cells.size(), 4u);
  run(results, {{{}, 4}}, 2);
  EXPECT_EQ(table.markdown(results.runs()),
            "### Table 4: impact of inference steps\n\n"
            "|  | i-steps | 2 | 4 |\n"
            "|---|---|---|---|\n"
            "| DDIM | Avg. success % | - | - |\n"
            "| CFM | Avg. success % | - | 18.8 [6.6–43.0] (12.5, 25.0) |\n"
            "| DDIM | Inference time ms | - | - |\n"
            "| CFM | Inference time ms | - | 20.0 |\n");
}

TEST_F(Ablation, EveryTableNamesTheCellsThatFillIt) {
  TableChoice choice;
  choice.names = {"3", "4", "C", "precise", "ours"};
  choice.flow_steps = {2, 4};
  choice.tasks = {"push_buttons", "close_jar"};
  for (const AblationTable& table : make_tables(choice)) {
    AblationStore results(folder_.path() / table.name, budget());
    EXPECT_TRUE(contains(table.markdown(results.runs()), "| - |")) << table.name;
    run(results, table.cells, 1);
    EXPECT_FALSE(contains(table.markdown(results.runs()), "| - |")) << table.markdown(results.runs());
  }
  EXPECT_EQ(make_tables({{"3"}, {}, false, {}}).at(0).cells.size(), 10u);
  EXPECT_EQ(make_tables({{"3"}, {}, false, {}}).at(0).cells.at(0).flow_steps, 50);
  EXPECT_EQ(make_tables({{"C"}, {}, true, {}}).at(0).cells.at(9).flow_steps, 32);
  EXPECT_FALSE(make_tables({{"C"}, {}, true, {}}).at(0).cells.at(0).variant.grounded);
  EXPECT_THROW(make_tables({{"5"}, {}, false, {}}), std::invalid_argument);
}

TEST_F(Ablation, ACellTableHasEachCellOnceWithItsFirstAttempts) {
  AblationStore results = store();
  run(results, {{{}, 4}}, 2);
  EXPECT_EQ(
      make_cell_table("Grid", {{{}, 4}, {{}, 2}, {{}, 4}}).markdown(results.runs()),
      "### Grid\n\n"
      "| Policy | i-steps | Avg. success % | First attempt % | Position error mm | Inference time ms |\n"
      "|---|---|---|---|---|---|\n"
      "| full | 4 | 18.8 [6.6–43.0] (12.5, 25.0) | 6.2 | 15.2 | 20.0 |\n"
      "| full | 2 | - | - | - | - |\n");
}

TEST_F(Ablation, ResultsOfAnotherMakeAreRefusedByTheirPlace) {
  AblationStore first = store();
  run(first, {{with_objective("cfm"), 4}}, 2);
  const auto file = first.file("results.json");
  const auto good = nlohmann::ordered_json::parse(std::ifstream(file));
  const auto complaint = [&](const std::string& pointer, const nlohmann::ordered_json& value) {
    auto bad = good;
    bad[nlohmann::ordered_json::json_pointer(pointer)] = value;
    std::ofstream(file) << bad;
    return complaint_of([&] { store(); });
  };
  EXPECT_TRUE(contains(complaint("/runs/1/seed", "x"), file.string() + ": runs[1]: "));
  EXPECT_TRUE(contains(complaint("/runs/0/policy", "../p.flow"), ": runs[0]: policy '../p.flow'"));
  EXPECT_TRUE(contains(complaint("/runs/1/measures/0/ms_per_prediction", {}), ": runs[1].measures[0]: "));
  EXPECT_TRUE(contains(complaint("/runs/1/measures/0/tasks/0/successes", 5), "more successes than episodes"));
  EXPECT_TRUE(contains(complaint("/runs/1/measures/0/flow_steps", 0), "flow_steps must be positive"));
  EXPECT_TRUE(contains(complaint("/runs", 7), ": runs: must be a list"));
  std::ofstream(file) << good;
  EXPECT_EQ(store().runs().size(), 2u);
}

class AblationGrid : public ::testing::Test {
 protected:
  std::vector<AblationCell> read(const std::string& text) const {
    std::ofstream(file_, std::ios::trunc) << text;
    return read_grid(file_);
  }
  std::string complaint(const std::string& text) const {
    return complaint_of([&] { read(text); });
  }
  const testing::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "grid.yaml";
};

TEST_F(AblationGrid, IsEveryCombination) {
  const auto cells = read("flow_steps: [2, 8]\nradius: [linear, off]\ncrop: [on, off]\n");
  ASSERT_EQ(cells.size(), 8u);
  EXPECT_EQ(key_of(cells[0].variant), "crop=on");
  EXPECT_EQ(cells[1].flow_steps, 8);
  EXPECT_EQ(key_of(cells[2].variant), "full");
  EXPECT_EQ(key_of(cells[4].variant), "radius=off,crop=on");
  EXPECT_EQ(read("radius: [off]").at(0), (AblationCell{cells[6].variant, 4}));
}

TEST_F(AblationGrid, NamesTheLineOfWhatIsWrong) {
  EXPECT_TRUE(contains(complaint("radius: [off]\nradii: [1]\n"), "grid.yaml:2: unknown key 'radii'"));
  EXPECT_TRUE(contains(complaint("\ngrounded: [maybe]\n"), "grid.yaml:2: 'maybe' is no value of 'grounded'"));
  EXPECT_TRUE(contains(complaint("radius: off\n"), "grid.yaml:1: 'radius' is not a list"));
  EXPECT_TRUE(contains(complaint("radius: [off, off]\n"), "grid.yaml:1: 'radius' names off twice"));
  EXPECT_TRUE(contains(complaint("flow_steps: [0]\n"), "flow_steps must lie in 1 to 1000"));
  EXPECT_TRUE(contains(complaint("flow_steps: [2000000000]\n"), "flow_steps must lie in 1 to 1000"));
  for (const char* none : {"", "7\n", "[1, 2]\n", "{}\n"})
    EXPECT_TRUE(contains(complaint(none), "grid.yaml:1: must name lists")) << none;
  EXPECT_TRUE(contains(complaint("radius: [off\n"), "grid.yaml: "));
}

TEST(AblationTools, EveryFieldOfAVariantReachesTraining) {
  AblationBudget budget;
  budget.steps = 7;
  const TrainOptions full = train_options_of({}, budget, 3);
  EXPECT_EQ(full.seed, 3u);
  EXPECT_EQ(full.expected_steps, 7);
  EXPECT_TRUE(full.binding);
  AblationVariant v;
  v.backbone = "transformer";
  v.radius = "off";
  v.point_encoder = v.grounded = false;
  v.objective = "ddim";
  v.binding = v.recolor = false;
  v.crop = true;
  const TrainOptions options = train_options_of(v, budget, 0);
  EXPECT_EQ(options.backbone, "transformer");
  EXPECT_EQ(options.radius, "off");
  EXPECT_FALSE(options.point_encoder);
  EXPECT_FALSE(options.grounded);
  EXPECT_EQ(options.objective, "ddim");
  EXPECT_FALSE(options.binding);
  EXPECT_EQ(names_of(options.augment), "move,repaint,shuffle,crop");
  EXPECT_EQ(full.augment, Augmentation());
}

}  // namespace
}  // namespace flowscope
