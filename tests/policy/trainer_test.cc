// Training, its exact continuation, and the trace of a prediction.
#include "policy/trainer.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <memory>

#include "policy/rotation6.h"
#include "policy/sample.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

std::unique_ptr<Trainer> small_trainer(bool grounded = true) {
  TrainOptions options;
  options.preset = "nano";
  options.seed = 5;
  options.grounded = grounded;
  return Trainer::create(options);
}

const Demo& demo() {
  static const Demo made = testing::toy_push_buttons(3);
  return made;
}
const Demo& other_demo() {
  static const Demo made = testing::toy_push_buttons(8);
  return made;
}

std::unique_ptr<Trainer> trained(int steps, bool grounded = true) {
  auto trainer = small_trainer(grounded);
  trainer->add(demo());
  for (int i = 0; i < steps; ++i) trainer->step();
  return trainer;
}

void expect_same_numbers(const FlowTrace& a, const FlowTrace& b) {
  ASSERT_EQ(a.steps.size(), b.steps.size());
  for (std::size_t k = 0; k < a.steps.size(); ++k) {
    EXPECT_EQ(a.steps[k].x, b.steps[k].x) << k;
    EXPECT_EQ(a.steps[k].velocity, b.steps[k].velocity) << k;
    EXPECT_EQ(a.steps[k].open_probability, b.steps[k].open_probability) << k;
  }
}

TEST(FlowTraceOfAPolicy, IntegratesExactlyWhatItShows) {
  for (const bool grounded : {true, false}) {
    const auto trainer = trained(3, grounded);
    PredictOptions options;
    options.flow_steps = 5;
    options.seed = 42;
    const FlowTrace trace = trainer->predict(input_of_keyframe(demo(), 0), options);
    ASSERT_EQ(trace.steps.size(), 6u);
    EXPECT_EQ(trace.steps.front().t, 0);
    EXPECT_EQ(trace.steps.back().t, 1);
    const auto scale = PositionScale::from_bounds(demo().bounds);
    for (std::size_t k = 0; k < trace.steps.size(); ++k) {
      const FlowStep& s = trace.steps[k];
      EXPECT_DOUBLE_EQ(s.region.radius_m, trace.radius.radius_m(s.t));
      const Eigen::Vector3d center = scale.denormalise(Eigen::Map<const Eigen::Vector3d>(s.x.data()));
      EXPECT_LT((s.region.center - center).norm(), 1e-12);
      EXPECT_LT((s.pose.position - center).norm(), 1e-12);
      for (const auto& p : s.region.inside)
        EXPECT_LE((p.cast<double>() - center).norm(), s.region.radius_m + 1e-6);
      if (grounded) {
        ASSERT_EQ(s.weights.size(), s.weight_points.size());
        float sum = 0;
        for (const float w : s.weights) sum += w;
        EXPECT_NEAR(sum, 1, 1e-4);
      } else {
        EXPECT_TRUE(s.weights.empty());
      }
      if (k + 1 == trace.steps.size()) break;
      const double dt = trace.steps[k + 1].t - s.t;
      for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(trace.steps[k + 1].x[i], s.x[i] + s.velocity[i] * dt);
    }
  }
}

TEST(FlowTraceOfAPolicy, IsTheSameAgainAndOtherForAnotherSeed) {
  const auto trainer = trained(3);
  PredictOptions options;
  options.seed = 9;
  const PolicyInput input = input_of_keyframe(demo(), 1);
  const FlowTrace first = trainer->predict(input, options);
  expect_same_numbers(first, trainer->predict(input, options));
  options.seed = 10;
  EXPECT_NE(first.steps[0].x, trainer->predict(input, options).steps[0].x);
}

TEST(FlowTraceOfAPolicy, BranchesRunOnFromAnEditedState) {
  const auto trainer = trained(3);
  PredictOptions options;
  const PolicyInput input = input_of_keyframe(demo(), 0);
  const FlowTrace whole = trainer->predict(input, options);
  options.branch = PredictOptions::Branch{&whole, 2, std::nullopt, std::nullopt, std::nullopt};
  const FlowTrace same = trainer->predict(input, options);
  ASSERT_EQ(same.steps.size(), whole.steps.size());
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(same.steps[4].x[i], whole.steps[4].x[i], 1e-6);
  options.branch->position = Eigen::Vector3d(0.2, 0.1, 0.8);
  options.branch->radius_m = 0.15;
  const FlowTrace edited = trainer->predict(input, options);
  EXPECT_EQ(edited.steps[1].x, whole.steps[1].x);
  EXPECT_LT((edited.steps[2].pose.position - Eigen::Vector3d(0.2, 0.1, 0.8)).norm(), 1e-12);
  EXPECT_EQ(edited.steps[3].region.radius_m, 0.15);
  options.branch->step = 17;
  EXPECT_THROW(trainer->predict(input, options), std::invalid_argument);
}

TEST(Trainer, GoesOnExactlyWhereItStopped) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp";
  auto straight = trained(4);
  straight->save(file);
  auto resumed = Trainer::resume(file);
  resumed->add(demo());
  EXPECT_EQ(resumed->status().step, 4);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(straight->step().loss, resumed->step().loss);
  PredictOptions options;
  const FlowTrace a = straight->predict(input_of_keyframe(demo(), 0), options);
  const FlowTrace b = resumed->predict(input_of_keyframe(demo(), 0), options);
  expect_same_numbers(a, b);
  EXPECT_EQ(a.weights_sha256, b.weights_sha256);
  EXPECT_EQ(a.generation, 7u);
}

TEST(Trainer, SavedPolicyPredictsTheSame) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp";
  const auto trainer = trained(4);
  trainer->save(file);
  const auto policy = load_policy(file);
  PredictOptions options;
  const FlowTrace a = trainer->predict(input_of_keyframe(demo(), 0), options);
  const FlowTrace b = policy->predict(input_of_keyframe(demo(), 0), options);
  expect_same_numbers(a, b);
  EXPECT_EQ(a.weights_sha256, b.weights_sha256);
  EXPECT_EQ(b.policy_file, file.string());
}

TEST(Trainer, RefusesADamagedFile) {
  const testing::TemporaryFolder folder;
  const auto file = folder.path() / "a.fsp";
  trained(1)->save(file);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_THROW(Trainer::resume(file), BadCheckpoint);
  EXPECT_THROW(load_policy(folder.path() / "none.fsp"), BadCheckpoint);
}

TEST(Trainer, TakesDemonstrationsInAndOut) {
  auto trainer = trained(2);
  trainer->add(other_demo());
  EXPECT_EQ(trainer->status().demos, 2);
  trainer->add(other_demo());
  EXPECT_EQ(trainer->step().demos, 2);
  trainer->remove(demo().info.id);
  EXPECT_EQ(trainer->step().demos, 1);
  trainer->remove(other_demo().info.id);
  EXPECT_THROW(trainer->step(), std::invalid_argument);
}

TEST(Trainer, ValidatesOnWhatIsHeldOut) {
  auto trainer = small_trainer();
  trainer->add(demo());
  EXPECT_EQ(trainer->validate().keyframes, 0);
  trainer->add(other_demo(), true);
  const Validation v = trainer->validate();
  EXPECT_EQ(v.keyframes, other_demo().info.keyframes);
  EXPECT_GT(v.position_mm, 0);
}

TEST(Trainer, SaysWhatItCannotDo) {
  EXPECT_THROW(small_trainer()->step(), std::invalid_argument);
  for (const auto& edit : std::vector<std::function<void(TrainOptions&)>>{
           [](TrainOptions& o) { o.preset = "../etc/passwd"; }, [](TrainOptions& o) { o.preset = "huge"; },
           [](TrainOptions& o) { o.objective = "gan"; }, [](TrainOptions& o) { o.backbone = "lstm"; },
           [](TrainOptions& o) { o.radius = "square"; }}) {
    TrainOptions options;
    edit(options);
    EXPECT_THROW(Trainer::create(options), std::invalid_argument);
  }
}

TEST(Trainer, OverfitsOneDemonstration) {
  TrainOptions options;
  options.preset = "nano";
  options.augment = Augmentation::none();
  options.expected_steps = 2400;
  auto trainer = Trainer::create(options);
  trainer->add(demo());
  for (int i = 0; i < options.expected_steps; ++i) trainer->step();
  for (int keyframe = 0; keyframe < demo().info.keyframes; ++keyframe) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      PredictOptions four_steps;
      four_steps.flow_steps = 4;
      four_steps.seed = seed;
      FlowTrace trace = trainer->predict(input_of_keyframe(demo(), keyframe), four_steps);
      compare_with_expert(trace, demo().keyframes[static_cast<std::size_t>(keyframe)].action);
      EXPECT_LT(trace.error->position_m, 0.002) << "keyframe " << keyframe << ", seed " << seed;
      EXPECT_LT(trace.error->rotation_deg, 1) << "keyframe " << keyframe << ", seed " << seed;
      EXPECT_TRUE(trace.error->open_correct) << "keyframe " << keyframe << ", seed " << seed;
    }
  }
}

}  // namespace
}  // namespace flowscope
