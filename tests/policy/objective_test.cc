// Flow matching and diffusion: path, target, times, grid, and where one step leads.
#include "policy/objective.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "policy/noise_schedule.h"

namespace flowscope {
namespace {

Vector9 some_noise(std::uint64_t seed = 1) {
  Random random(seed);
  Vector9 x;
  for (double& v : x) v = random.normal();
  return x;
}

Vector9 some_action() {
  Vector9 x;
  for (std::size_t i = 0; i < 9; ++i) x[i] = 0.7 - 0.15 * static_cast<double>(i);
  return x;
}

void expect_near(const Vector9& a, const Vector9& b, double limit) {
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a[i], b[i], limit) << "number " << i;
}

Vector9 euler(const Objective& objective, const Answer& answer, const FlowState& at, double t_next,
              std::uint64_t seed = 0) {
  Random noise(seed);
  const Vector9 v = objective.velocity(answer, at, at, t_next, noise);
  Vector9 x;
  for (std::size_t i = 0; i < 9; ++i) x[i] = at.x[i] + v[i] * (t_next - at.t);
  return x;
}

TEST(Objectives, AreKnownByName) {
  for (const char* name : {"cfm", "ddim", "ddpm"}) EXPECT_EQ(make_objective(name)->name(), name);
  EXPECT_THROW(make_objective("unknown"), std::invalid_argument);
  for (const char* name : {"cfm", "ddim"}) EXPECT_THROW(make_objective(name, "often"), std::invalid_argument);
}

TEST(Objectives, PathsLeadFromNoiseToAction) {
  for (const char* name : {"cfm", "ddim", "ddpm"}) {
    const auto objective = make_objective(name);
    expect_near(objective->noisy(some_noise(), some_action(), 0), some_noise(), 2e-3);
    expect_near(objective->noisy(some_noise(), some_action(), 1), some_action(), 1e-12);
  }
}

TEST(Objectives, GridsRunFromAnyOfTheirTimesToTheAction) {
  for (const char* name : {"cfm", "ddim", "ddpm"}) {
    const auto objective = make_objective(name);
    for (const int n : {1, 2, 4, 8, 16, 32, 50, 100}) {
      EXPECT_EQ(objective->grid(0, 0, n), 0) << name << n;
      EXPECT_EQ(objective->grid(0, n, n), 1) << name << n;
      for (int k = 1; k <= n; ++k) {
        EXPECT_GT(objective->grid(0, k, n), objective->grid(0, k - 1, n)) << name << n;
        EXPECT_NEAR(objective->grid(0, k, n), static_cast<double>(k) / n, 0.0051) << name << n;
      }
    }
    const double late = objective->grid(0, 5, 8);
    EXPECT_EQ(objective->grid(late, 0, 3), late) << name;
    EXPECT_EQ(objective->grid(late, 3, 3), 1) << name;
  }
  EXPECT_NO_THROW(make_objective("cfm")->grid(0, 7, 1000));
  EXPECT_THROW(make_objective("ddim")->grid(0, 7, 101), std::invalid_argument);
  EXPECT_THROW(make_objective("ddpm")->grid(0.5, 0, 51), std::invalid_argument);
}

TEST(Objectives, RightAnswersLeadToTheActionInBothForms) {
  const Vector9 noise = some_noise(), action = some_action();
  const NoiseSchedule schedule;
  for (const char* name : {"cfm", "ddim", "ddpm"}) {
    const auto objective = make_objective(name);
    for (const bool grounded : {true, false}) {
      for (const int steps : {1, 3, 10}) {
        FlowState state{noise, 0};
        for (int k = 0; k < steps; ++k) {
          const double t_next = objective->grid(0, k + 1, steps);
          Vector9 now = noise;  // a diffusion's target is the noise that is in the state now
          if (!objective->is_flow()) {
            const double s = schedule.signal(schedule.step_at(state.t));
            for (std::size_t i = 0; i < 9; ++i)
              now[i] = (state.x[i] - std::sqrt(s) * action[i]) / std::sqrt(1 - s);
          }
          const Answer answer{grounded ? action : objective->target(now, action), grounded};
          state = {euler(*objective, answer, state, t_next, static_cast<std::uint64_t>(k)), t_next};
        }
        expect_near(state.x, action, 1e-9);
      }
    }
  }
}

TEST(Objectives, EndPointWeightsStayBetween1And16AndRise) {
  for (const char* name : {"cfm", "ddim", "ddpm"}) {
    const auto objective = make_objective(name);
    EXPECT_EQ(objective->end_point_weight(0), 1) << name;
    EXPECT_EQ(objective->end_point_weight(0.99), 16) << name;
    for (int i = 1; i < 100; ++i)
      EXPECT_GE(objective->end_point_weight(i / 100.0), objective->end_point_weight((i - 1) / 100.0));
  }
  // Between the limits the weight turns the end point's error into the target's.
  const double t = 0.6;
  EXPECT_NEAR(make_objective("cfm")->end_point_weight(t), 1 / (0.4 * 0.4), 1e-12);
  const double s = NoiseSchedule().signal(40);
  EXPECT_NEAR(make_objective("ddim")->end_point_weight(t), s / (1 - s), 1e-12);
}

TEST(FlowMatching, VelocityAlongThePathIsItsTarget) {
  const auto cfm = make_objective("cfm");
  for (const double t : {0.0, 0.3, 0.9, 0.9999}) {
    const FlowState at{cfm->noisy(some_noise(), some_action(), t), t};
    Random unused;
    expect_near(cfm->velocity({some_action(), true}, at, at, 1, unused),
                cfm->target(some_noise(), some_action()), 1e-10);
  }
}

TEST(FlowMatching, TheVelocityAtTheEndIsTheStepsMeanAndFinite) {
  const auto cfm = make_objective("cfm");
  const FlowState start{some_noise(), 0.75}, end{some_noise(5), 1};
  Random unused;
  const Vector9 v = cfm->velocity({some_action(), true}, end, start, 1, unused);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_DOUBLE_EQ(v[i], (some_action()[i] - start.x[i]) / 0.25);
}

/// Share of 4000 drawn times below a limit.
double share_below(const std::string& objective, const std::string& times, double limit) {
  const auto drawn = make_objective(objective, times);
  Random random(1);
  int below = 0;
  for (int i = 0; i < 4000; ++i) {
    const double t = drawn->draw_time(random);
    EXPECT_GE(t, 0);
    EXPECT_LT(t, 1);
    below += t < limit;
  }
  return below / 4000.0;
}

TEST(TrainingTimes, FollowTheirDistributions) {
  const double noise = 0.03;  // four deviations of a share of 4000
  EXPECT_NEAR(share_below("cfm", "logit_normal", 0.5), 0.5, noise);
  EXPECT_NEAR(share_below("cfm", "logit_normal_unit", 0.5), 0.5, noise);
  // t < 0.1 is n < ln(1/9) / deviation: Φ(-1.465) and Φ(-2.197).
  EXPECT_NEAR(share_below("cfm", "logit_normal", 0.1), 0.0715, noise);
  EXPECT_NEAR(share_below("cfm", "logit_normal_unit", 0.1), 0.0140, 0.01);
  EXPECT_NEAR(share_below("cfm", "uniform", 0.3), 0.3, noise);
  EXPECT_NEAR(share_below("cfm", "beta", 0.3), 1 - std::pow(0.7, 1.5), noise);
  EXPECT_NEAR(share_below("ddim", "beta", 0.3), 0.3, noise);
  EXPECT_NEAR(share_below("ddpm", "uniform", 0.3), 0.3, noise);
}

TEST(NoiseSchedule, IsTheSquaredCosine) {
  const NoiseSchedule schedule;
  ASSERT_EQ(schedule.steps(), 100);
  EXPECT_EQ(schedule.signal(0), 1);
  const auto f = [](double u) { return std::pow(std::cos((u + 0.008) / 1.008 * std::numbers::pi / 2), 2); };
  for (int s = 1; s < 100; ++s) {
    EXPECT_NEAR(schedule.signal(s), f(s / 100.0) / f(0), 1e-12) << s;
    EXPECT_EQ(schedule.step_at(schedule.time_of(s)), s);
  }
  EXPECT_NEAR(schedule.signal(100), schedule.signal(99) / 1000, 1e-15) << "the last step adds 0.999 at most";
  EXPECT_THROW(NoiseSchedule(0), std::invalid_argument);
  EXPECT_THROW(schedule.signal(101), std::out_of_range);
}

TEST(Diffusion, DdimKeepsTheNoiseOfTheState) {
  const auto ddim = make_objective("ddim");
  const NoiseSchedule schedule;
  const FlowState at{ddim->noisy(some_noise(), some_action(), 0.3), 0.3};
  const Vector9 expected = ddim->noisy(some_noise(), some_action(), 0.6);
  expect_near(euler(*ddim, {some_action(), true}, at, 0.6), expected, 1e-12);
  expect_near(euler(*ddim, {some_noise(), false}, at, 0.6), expected, 1e-12);
}

TEST(Diffusion, DdpmStepsAreThePosterior) {
  const auto ddpm = make_objective("ddpm");
  const NoiseSchedule schedule;
  const FlowState at{ddpm->noisy(some_noise(), some_action(), 0.4), 0.4};
  for (const int there : {59, 40}) {
    const double a = schedule.signal(60), b = schedule.signal(there), alpha = a / b;
    Vector9 mean{}, square{};
    constexpr int draws = 4000;
    for (int d = 0; d < draws; ++d) {
      const Vector9 x =
          euler(*ddpm, {some_action(), true}, at, schedule.time_of(there), static_cast<std::uint64_t>(d));
      for (std::size_t i = 0; i < 9; ++i) mean[i] += x[i] / draws, square[i] += x[i] * x[i] / draws;
    }
    const double variance = (1 - b) / (1 - a) * (1 - alpha);  // arXiv 2006.11239, eq. 7
    for (std::size_t i = 0; i < 9; ++i) {
      const double posterior = std::sqrt(b) * (1 - alpha) / (1 - a) * some_action()[i] +
                               std::sqrt(alpha) * (1 - b) / (1 - a) * at.x[i];
      EXPECT_NEAR(mean[i], posterior, 5 * std::sqrt(variance / draws)) << there;
      EXPECT_NEAR(square[i] - mean[i] * mean[i], variance, 0.12 * variance) << there;
    }
  }
}

TEST(Diffusion, NoiseComesFromTheGeneratorGiven) {
  const FlowState at{some_noise(), 0.2};
  const auto ddpm = make_objective("ddpm"), ddim = make_objective("ddim");
  const Answer answer{some_action(), true};
  EXPECT_EQ(euler(*ddpm, answer, at, 0.5, 1), euler(*ddpm, answer, at, 0.5, 1));
  EXPECT_NE(euler(*ddpm, answer, at, 0.5, 1), euler(*ddpm, answer, at, 0.5, 2));
  EXPECT_EQ(euler(*ddim, answer, at, 0.5, 1), euler(*ddim, answer, at, 0.5, 2));
  expect_near(euler(*ddpm, answer, at, 1, 1), some_action(), 1e-12);  // the last step adds none
}

TEST(Diffusion, HoldsTheEndPointOfAWrongNoiseInTheWorkspace) {
  const auto ddim = make_objective("ddim");
  const FlowState noise{some_noise(), 0};
  Vector9 wrong = some_noise();
  for (double& v : wrong) v += 0.5;
  for (const double x : euler(*ddim, {wrong, false}, noise, 1)) EXPECT_NEAR(std::abs(x), 1, 1e-12);
  EXPECT_THROW(euler(*ddim, {wrong, false}, noise, 0), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
