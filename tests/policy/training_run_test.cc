// Whole runs: resumed from the file, over several processes, with older files, on other devices.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <thread>

#include "policy/checkpoint.h"
#include "policy/container.h"
#include "policy/trainer.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thread_exchange.h"

namespace flowscope {
namespace {

TrainOptions small() {
  TrainOptions options;
  options.preset = "nano";
  options.seed = 5;
  options.scenes = 2;
  return options;
}

void add_two_tasks(Trainer& trainer) {
  trainer.add(testing::toy_push_buttons(3));
  trainer.add(testing::toy_open_drawer(1));
}

std::string weights_of(const std::filesystem::path& file) {
  return weights_sha256(read_checkpoint(file).model);
}

TEST(TrainingRun, GoesOnFromTheFileWithTwoTasksAndCropsBitForBit) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp";
  TrainOptions options = small();
  options.augment.crop = true;
  options.times = "uniform";
  options.binding = false;
  const auto straight = Trainer::create(options);
  add_two_tasks(*straight);
  for (int i = 0; i < 3; ++i) straight->step();
  straight->save(file);
  const auto resumed = Trainer::resume(file);
  add_two_tasks(*resumed);
  for (int i = 0; i < 3; ++i) {
    const TrainStatus a = straight->step(), b = resumed->step();
    EXPECT_EQ(a.step, b.step);
    EXPECT_EQ(a.loss, b.loss);
    EXPECT_EQ(a.loss_position, b.loss_position);
    EXPECT_EQ(a.loss_rotation, b.loss_rotation);
    EXPECT_EQ(a.loss_open, b.loss_open);
  }
  const auto one = folder.path() / "one.fsp", two = folder.path() / "two.fsp";
  straight->save(one);
  resumed->save(two);
  EXPECT_EQ(weights_of(one), weights_of(two));
}

TEST(TrainingRun, AStepThatIsGivenUpHasNotTakenPlace) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp", one = folder.path() / "one.fsp", two = folder.path() / "two.fsp";
  const auto first = Trainer::create(small());
  add_two_tasks(*first);
  first->step();
  first->save(file);
  const auto straight = Trainer::resume(file), stopped = Trainer::resume(file);
  add_two_tasks(*straight);
  add_two_tasks(*stopped);
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(stopped->step(source.get_token()).step, 1);
  const Validation known = stopped->status().validation;
  EXPECT_EQ(stopped->validate(4, source.get_token()).position_mm, known.position_mm);
  stopped->save(two);
  EXPECT_EQ(weights_of(two), weights_of(file));
  EXPECT_EQ(straight->step().loss, stopped->step().loss);
  straight->save(one);
  stopped->save(two);
  EXPECT_EQ(weights_of(one), weights_of(two));
}

TEST(TrainingRun, AStepThatIsGivenUpAtAnyMomentLeavesNoTrace) {
  const testing::TemporaryFolder folder;
  const auto one = folder.path() / "one.fsp", two = folder.path() / "two.fsp";
  const auto straight = Trainer::create(small());
  add_two_tasks(*straight);
  straight->step();
  straight->save(one);
  const auto stopped = Trainer::resume(one);
  add_two_tasks(*stopped);
  int given_up = 0;
  for (int i = 0; i < 40; ++i) {
    std::stop_source source;
    std::jthread stopper([&source, i] {
      std::this_thread::sleep_for(std::chrono::microseconds(500 * i));
      source.request_stop();
    });
    const std::int64_t before = stopped->status().step;
    given_up += stopped->step(source.get_token()).step == before;
  }
  EXPECT_GT(given_up, 0);
  while (straight->status().step < stopped->status().step) straight->step();
  straight->save(one);
  stopped->save(two);
  EXPECT_EQ(weights_of(one), weights_of(two));
}

/// How far one step moves the weights of `file`, when training goes on for `minutes` more (0: as it was).
double one_step_from(const std::filesystem::path& file, double minutes) {
  const auto trainer = Trainer::resume(file);
  add_two_tasks(*trainer);
  if (minutes > 0) trainer->go_on_for(minutes);
  trainer->step();
  const auto after = file.parent_path() / "after.fsp";
  trainer->save(after);
  const LoadedCheckpoint before = read_checkpoint(file), then = read_checkpoint(after);
  const auto old = before.model.network->named_parameters();
  double moved = 0;
  for (const auto& item : then.model.network->named_parameters())
    moved += (item.value() - old[item.key()]).square().sum().item<double>();
  return std::sqrt(moved);
}

TEST(TrainingRun, MoreMinutesStretchAScheduleThatHasEnded) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp";
  TrainOptions options = small();
  options.expected_minutes = 1e-6;
  const auto trainer = Trainer::create(options);
  add_two_tasks(*trainer);
  for (int i = 0; i < 3; ++i) trainer->step();
  trainer->save(file);
  // 2 % of the rate where the schedule has ended, nearly all of it at the start of a long one.
  const double ended = one_step_from(file, 0), stretched = one_step_from(file, 1000);
  EXPECT_GT(ended, 0);
  EXPECT_NEAR(stretched / ended, 50, 5);
}

TEST(TrainingRun, CropsChangeWhatIsLearnt) {
  const auto loss = [](bool crop) {
    TrainOptions options = small();
    options.augment = Augmentation::none();
    options.augment.crop = crop;
    const auto trainer = Trainer::create(options);
    add_two_tasks(*trainer);
    return trainer->step().loss;
  };
  EXPECT_NE(loss(true), loss(false));
}

TEST(TrainingRun, ValidatesTaskByTask) {
  const auto trainer = Trainer::create(small());
  trainer->add(testing::toy_push_buttons(3));
  trainer->add(testing::toy_push_buttons(8), true);
  trainer->add(testing::toy_open_drawer(2), true);
  const Validation v = trainer->validate();
  ASSERT_EQ(v.tasks.size(), 2u);
  EXPECT_EQ(v.tasks[0].task, "open_drawer");
  EXPECT_EQ(v.tasks[0].keyframes, 3);
  EXPECT_EQ(v.tasks[1].task, "push_buttons");
  EXPECT_EQ(v.keyframes, v.tasks[0].keyframes + v.tasks[1].keyframes);
  EXPECT_GT(v.tasks[0].position_mm, 0);
  EXPECT_NE(v.tasks[0].position_mm, v.tasks[1].position_mm);
  EXPECT_EQ(trainer->status().validation.tasks.size(), 2u);
}

TEST(TrainingRun, TheFirstProcessGivesItsWeightsToAll) {
  const testing::TemporaryFolder folder;
  const auto file_of = [&](int rank) { return folder.path() / (std::to_string(rank) + ".fsp"); };
  testing::run_ranks(2, [&](const std::shared_ptr<GradientExchange>& exchange) {
    TrainOptions options = small();
    options.seed = 5 + static_cast<std::uint64_t>(exchange->rank());
    const auto trainer = Trainer::create(options, exchange);
    add_two_tasks(*trainer);
    trainer->require_agreement();
    trainer->save(file_of(exchange->rank()));
  });
  EXPECT_EQ(weights_of(file_of(0)), weights_of(file_of(1)));
}

TEST(TrainingRun, TwoProcessesStayTheSameAndLearnWhatOneWithTwiceTheBatchDoes) {
  const testing::TemporaryFolder folder;
  // Both begin from files: threads share the generator that draws first weights.
  const auto start_of = [&](int scenes) {
    TrainOptions options = small();
    options.scenes = scenes;
    const auto file = folder.path() / (std::to_string(scenes) + "-scenes.fsp");
    Trainer::create(options)->save(file);
    return file;
  };
  const auto half = start_of(2), whole = start_of(4);
  const auto alone = Trainer::resume(whole);
  add_two_tasks(*alone);
  std::vector<double> wanted;
  for (int i = 0; i < 3; ++i) wanted.push_back(alone->step().loss);
  const auto file_of = [&](int rank) { return folder.path() / (std::to_string(rank) + ".fsp"); };
  testing::run_ranks(2, [&](const std::shared_ptr<GradientExchange>& exchange) {
    const auto trainer = Trainer::resume(half, "cpu", exchange);
    add_two_tasks(*trainer);
    for (const double loss : wanted) EXPECT_NEAR(trainer->step().loss, loss, 1e-3 * loss);
    trainer->require_agreement();
    trainer->save(file_of(exchange->rank()));
  });
  EXPECT_EQ(weights_of(file_of(0)), weights_of(file_of(1)));
}

TEST(TrainingRun, ProcessesWithOtherDemonstrationsAreToldSo) {
  std::atomic<int> told{0};
  testing::run_ranks(2, [&](const std::shared_ptr<GradientExchange>& exchange) {
    const auto trainer = Trainer::create(small(), exchange);
    trainer->add(testing::toy_push_buttons(exchange->rank() == 0 ? 3 : 8));
    try {
      trainer->step();
    } catch (const std::runtime_error& error) {
      told += std::string(error.what()).find("demonstrations") != std::string::npos;
    }
  });
  EXPECT_EQ(told, 2);
}

TEST(TrainingRun, ReadsAFileFromBeforeThereWereKindsOfAugmentation) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp";
  const auto trainer = Trainer::create(small());
  add_two_tasks(*trainer);
  trainer->step();
  trainer->save(file);
  for (const bool before : {true, false}) {
    Container container = read_container(file);
    auto header = nlohmann::json::parse(container.text.at("policy"));
    for (const char* key : {"augment_move", "augment_recolor", "augment_repaint", "augment_shuffle",
                            "augment_crop", "times", "binding", "loss_position", "skipped"})
      header.erase(key);
    header["augment"] = before;
    container.text.at("policy") = header.dump();
    const auto old = folder.path() / "old.fsp";
    write_container(old, container);
    const TrainProgress progress = read_checkpoint(old).progress;
    EXPECT_EQ(progress.options.augment, before ? Augmentation{} : Augmentation::none());
    EXPECT_TRUE(progress.options.binding);
    EXPECT_EQ(Trainer::resume(old)->status().step, 1);
  }
}

TEST(TrainingRun, RefusesADeviceThatIsNotThere) {
  TrainOptions options = small();
  options.device = "tpu";
  EXPECT_THROW(Trainer::create(options), std::invalid_argument);
  options.device = "cuda:x";
  EXPECT_THROW(Trainer::create(options), std::invalid_argument);
  if (torch::cuda::is_available()) GTEST_SKIP() << "this LibTorch has CUDA";
  options.device = "cuda";
  try {
    Trainer::create(options);
    FAIL() << "no CUDA here, and none missed";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("CUDA"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flowscope
