// One step of learning: what its loss is made of, and that neither threads nor processes change it.
#include "policy/learner.h"

#include <ATen/Parallel.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "policy/checkpoint.h"
#include "policy/learning_rate.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/thread_exchange.h"
#include "tests/support/toy_scenes.h"

namespace flowscope {
namespace {

/// A small policy with the demonstrations of two tasks.
struct Room {
  TrainRates rates = load_preset("nano").rates;
  Model model;
  TrainingSet data;
  std::unique_ptr<AdamW> optimizer;

  explicit Room(int scenes = 8, bool grounded = true) : model(make(grounded)) {
    rates.scenes = scenes;
    rates.draws = 2;
    optimizer = make_optimizer(model, rates);
    data.add(model, testing::toy_push_buttons(3), false);
    data.add(model, testing::toy_open_drawer(1), false);
    data.freeze(model);
  }
  static Model make(bool grounded) {
    NetworkShape shape = testing::toy_shape();
    shape.grounded = grounded;
    return make_model(shape, RadiusSchedule{}, "mamba", "cfm", 1);
  }
  StepLoss gradients(GradientExchange& exchange, std::uint64_t seed = 5) {
    Replicas replicas = make_replicas(model, rates, torch::kCPU);
    return add_gradients(model, replicas, *optimizer, data, rates, how(exchange, seed));
  }
  StepLoss learn(std::uint64_t seed = 5) {
    SingleProcess alone;
    Replicas replicas = make_replicas(model, rates, torch::kCPU);
    return learn_once(model, replicas, *optimizer, data, rates, how(alone, seed));
  }
  static LearnStep how(GradientExchange& exchange, std::uint64_t seed) {
    return {.learning_rate = 0.01, .augment = {}, .seed = seed, .device = torch::kCPU, .exchange = exchange};
  }
  std::vector<float> weights() const {
    std::vector<float> all;
    for (const torch::Tensor& w : model.network->parameters())
      all.insert(all.end(), w.data_ptr<float>(), w.data_ptr<float>() + w.numel());
    for (const auto& [name, t] : optimizer->state())
      all.insert(all.end(), t.data_ptr<float>(), t.data_ptr<float>() + t.numel());
    return all;
  }
};

double largest(const std::vector<float>& a) {
  double most = 0;
  for (const float v : a) most = std::max(most, std::abs(static_cast<double>(v)));
  return most;
}
double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return 1e30;
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return most;
}

TEST(Learner, TheLossIsTheSumOfItsParts) {
  for (const bool grounded : {true, false}) {
    Room room(4, grounded);
    SingleProcess alone;
    const StepLoss loss = room.gradients(alone);
    EXPECT_GT(loss.position, 0);
    EXPECT_GT(loss.rotation, 0);
    EXPECT_GT(loss.open, 0);
    EXPECT_NEAR(loss.flow, (3 * loss.position + 6 * loss.rotation) / 9, 1e-5 * loss.flow);
    const double parts = 100 * loss.flow + 10 * loss.open;
    if (grounded)
      EXPECT_GT(loss.total, parts);
    else
      EXPECT_NEAR(loss.total, parts, 1e-5 * parts);
  }
}

TEST(Learner, ThreadsChangeNothingAndPartsOnlyRounding) {
  SingleProcess alone;
  Room room(8);
  ASSERT_EQ(make_replicas(room.model, room.rates, torch::kCPU).count(), 2);
  at::set_num_threads(2);
  const StepLoss of_two = room.gradients(alone);
  const std::vector<float> two_threads = room.optimizer->gradients();
  at::set_num_threads(1);
  room.optimizer->clear_gradients();
  EXPECT_EQ(room.gradients(alone).total, of_two.total);
  EXPECT_EQ(room.optimizer->gradients(), two_threads);
  room.optimizer->clear_gradients();
  Replicas whole(room.model.network, room.model.shape, room.model.backbone, 1);
  const StepLoss at_once =
      add_gradients(room.model, whole, *room.optimizer, room.data, room.rates, Room::how(alone, 5));
  EXPECT_NEAR(at_once.total, of_two.total, 1e-5 * of_two.total);
  EXPECT_LT(largest_difference(room.optimizer->gradients(), two_threads), 1e-4 * largest(two_threads));
}

TEST(Learner, TwoProcessesHaveTheGradientsOfOneWithTwiceTheBatch) {
  SingleProcess alone;
  Room whole(8);
  const StepLoss wanted = whole.gradients(alone);
  const std::vector<float> gradients = whole.optimizer->gradients();
  std::vector<std::vector<float>> of_rank(2);
  // First weights come from torch's one generator, which processes have each to themselves and threads do
  // not.
  std::array<Room, 2> halves{Room(4), Room(4)};
  testing::run_ranks(2, [&](const std::shared_ptr<GradientExchange>& exchange) {
    Room& half = halves[static_cast<std::size_t>(exchange->rank())];
    const StepLoss loss = half.gradients(*exchange);
    EXPECT_NEAR(loss.total, wanted.total, 1e-5 * wanted.total);
    EXPECT_NEAR(loss.rotation, wanted.rotation, 1e-5 * wanted.rotation);
    of_rank[static_cast<std::size_t>(exchange->rank())] = half.optimizer->gradients();
  });
  EXPECT_EQ(of_rank[0], of_rank[1]) << "not bit-identical on both";
  EXPECT_LT(largest_difference(of_rank[0], gradients), 1e-4 * largest(gradients));
  Room other(8);
  other.gradients(alone, 6);
  EXPECT_GT(largest_difference(other.optimizer->gradients(), gradients), 1e-2 * largest(gradients))
      << "another seed must draw another batch";
}

TEST(Learner, ALossThatIsNotFiniteChangesNotOneBit) {
  Room room(4);
  room.learn();
  {
    const torch::NoGradGuard no_grad;
    room.model.network->named_parameters()["open.2.bias"].fill_(std::nan(""));
  }
  std::vector<float> before = room.weights();
  EXPECT_TRUE(room.learn(6).skipped);
  std::vector<float> after = room.weights();
  for (auto* all : {&before, &after})  // the planted number itself equals nothing
    std::replace_if(
        all->begin(), all->end(), [](float v) { return std::isnan(v); }, 1e9f);
  EXPECT_EQ(before, after);
  EXPECT_FALSE(Room(4).learn().skipped);
}

TEST(Learner, OneProcessWithANumberThatIsNotFiniteStopsAll) {
  std::atomic<int> skipped{0};
  testing::run_ranks(2, [&](const std::shared_ptr<GradientExchange>& exchange) {
    Room room(4);
    if (exchange->rank() == 1) {
      const torch::NoGradGuard no_grad;
      room.model.network->named_parameters()["open.2.bias"].fill_(std::nan(""));
    }
    Replicas replicas = make_replicas(room.model, room.rates, torch::kCPU);
    const StepLoss loss =
        learn_once(room.model, replicas, *room.optimizer, room.data, room.rates, Room::how(*exchange, 5));
    skipped += loss.skipped ? 1 : 0;
  });
  EXPECT_EQ(skipped, 2);
}

TEST(LearningRate, RisesOverTheWarmUpAndFallsToTheExpectedEnd) {
  const TrainRates rates{.learning_rate = 1, .warmup_steps = 10};
  TrainOptions open_end;
  const auto after = [&](const TrainOptions& options, std::int64_t step, double minutes = 0) {
    TrainStatus now;
    now.step = step;
    now.minutes = minutes;
    return learning_rate_at(rates, options, now);
  };
  EXPECT_NEAR(after(open_end, 0), 0.1, 1e-12);
  EXPECT_NEAR(after(open_end, 4), 0.5, 1e-12);
  EXPECT_NEAR(after(open_end, 9), 1, 1e-12);
  EXPECT_NEAR(after(open_end, 100000), 1, 1e-12);
  TrainOptions steps;
  steps.expected_steps = 1000;
  EXPECT_NEAR(after(steps, 500), 0.51, 1e-12);
  EXPECT_NEAR(after(steps, 1000), 0.02, 1e-12);
  EXPECT_NEAR(after(steps, 5000), 0.02, 1e-12);
  TrainOptions minutes = steps;
  minutes.expected_minutes = 10;
  EXPECT_NEAR(after(minutes, 1000, 5), 0.51, 1e-12) << "minutes come before steps";
}

}  // namespace
}  // namespace flowscope
