// Integrators: order of accuracy, and what they do with a flow that points at an end; predictions of every
// objective with them.
#include "policy/integrate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "policy/integrator.h"
#include "tests/support/nano_model.h"

namespace flowscope {
namespace {

FlowState integrate(const std::string& integrator, const VelocityField& field, FlowState state, int steps) {
  for (int k = 0; k < steps; ++k) {
    const double t_next = static_cast<double>(k + 1) / steps;
    const Vector9 v = step_velocity(integrator, field, state, t_next);
    for (std::size_t i = 0; i < 9; ++i) state.x[i] += v[i] * (t_next - state.t);
    state.t = t_next;
  }
  return state;
}

TEST(Integrators, HaveTheirOrderOfAccuracy) {
  // dx/dt = x cos t: x(1) = x(0) exp(sin 1).
  const VelocityField field = [](const FlowState& at) {
    Vector9 v;
    for (std::size_t i = 0; i < 9; ++i) v[i] = at.x[i] * std::cos(at.t);
    return v;
  };
  FlowState start;
  start.x.fill(0.8);
  const double exact = 0.8 * std::exp(std::sin(1.0));
  struct Case {
    const char* name;
    double order;
  };
  for (const auto& [name, order] : {Case{"euler", 1}, Case{"midpoint", 2}, Case{"rk4", 4}}) {
    const double coarse = std::abs(integrate(name, field, start, 16).x[0] - exact),
                 fine = std::abs(integrate(name, field, start, 32).x[0] - exact);
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.15) << name;
  }
  EXPECT_THROW(integrate("leapfrog", field, start, 1), std::invalid_argument);
}

TEST(Integrators, CallTheFieldAtTheirStagesInOrder) {
  const FlowState start{{}, 0.1};
  for (const auto& [name, expected] : std::vector<std::pair<std::string, std::vector<double>>>{
           {"euler", {0.1}}, {"midpoint", {0.1, 0.1 + 0.5 * (0.7 - 0.1)}}, {"rk4", {0.1, 0.4, 0.4, 0.7}}}) {
    std::vector<double> times;
    step_velocity(
        name,
        [&times](const FlowState& at) {
          times.push_back(at.t);
          return Vector9{};
        },
        start, 0.7);
    ASSERT_EQ(times.size(), expected.size()) << name;
    for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], expected[i], 1e-12) << name;
  }
}

/// A grounded policy's field: it points at `end_point(t)` everywhere.
VelocityField towards(const Objective& cfm, double (*end_point)(double), const FlowState& start) {
  return [&cfm, end_point, start](const FlowState& at) {
    Vector9 told;
    told.fill(end_point(at.t));
    Random unused;
    return cfm.velocity({told, true}, at, start, 1, unused);
  };
}

TEST(Integrators, ReachAFixedEndPointInAnyNumberOfSteps) {
  const auto cfm = make_objective("cfm");
  for (const char* name : {"euler", "midpoint", "rk4"}) {
    for (const int steps : {1, 2, 5}) {
      FlowState state;
      state.x.fill(-1.3);
      for (int k = 0; k < steps; ++k) {
        const double t_next = cfm->grid(0, k + 1, steps);
        const VelocityField field = towards(
            *cfm, [](double) { return 0.4; }, state);
        const Vector9 v = step_velocity(name, field, state, t_next);
        for (std::size_t i = 0; i < 9; ++i) state.x[i] += v[i] * (t_next - state.t);
        state.t = t_next;
      }
      for (const double x : state.x) EXPECT_NEAR(x, 0.4, 1e-12) << name << ", " << steps << " steps";
    }
  }
}

TEST(Integrators, StayFiniteAndCloseWhereTheEndPointMoves) {
  const auto cfm = make_objective("cfm");
  const auto end_point = [](double t) { return 0.4 + 0.2 * std::sin(5 * t); };
  for (const char* name : {"midpoint", "rk4"}) {
    FlowState state;
    state.x.fill(-1.3);
    for (int k = 0; k < 4; ++k) {
      const double t_next = cfm->grid(0, k + 1, 4);
      const Vector9 v = step_velocity(name, towards(*cfm, end_point, state), state, t_next);
      for (std::size_t i = 0; i < 9; ++i) state.x[i] += v[i] * (t_next - state.t);
      state.t = t_next;
    }
    // The exact flow ends at end_point(1): no nearer than the end point moves within the last step.
    EXPECT_NEAR(state.x[0], end_point(1), 0.25) << name;
  }
}

using testing::nano_model;
using testing::nano_scene;

/// All but the wall times.
void expect_same(const FlowTrace& a, const FlowTrace& b) {
  EXPECT_EQ(a.seed, b.seed);
  ASSERT_EQ(a.steps.size(), b.steps.size());
  for (std::size_t k = 0; k < a.steps.size(); ++k) {
    EXPECT_EQ(a.steps[k].t, b.steps[k].t) << k;
    EXPECT_EQ(a.steps[k].x, b.steps[k].x) << k;
    EXPECT_EQ(a.steps[k].velocity, b.steps[k].velocity) << k;
    EXPECT_EQ(a.steps[k].open_probability, b.steps[k].open_probability) << k;
    EXPECT_EQ(a.steps[k].weights, b.steps[k].weights) << k;
  }
}

TEST(Predictions, OfEveryKindIntegrateExactlyWhatTheyShow) {
  for (const char* objective : {"cfm", "ddim", "ddpm"}) {
    for (const bool grounded : {true, false}) {
      Model model = nano_model({.objective = objective, .grounded = grounded});
      for (const char* integrator : {"euler", "midpoint", "rk4"}) {
        PredictOptions options;
        options.flow_steps = 3;
        options.integrator = integrator;
        if (!model.objective->is_flow() && options.integrator != "euler") {
          EXPECT_THROW(integrate_flow(model, nano_scene(), options), std::invalid_argument);
          continue;
        }
        const FlowTrace trace = integrate_flow(model, nano_scene(), options);
        EXPECT_EQ(trace.integrator, integrator);
        EXPECT_EQ(trace.objective, objective);
        ASSERT_EQ(trace.steps.size(), 4u);
        EXPECT_EQ(trace.steps.front().t, 0);
        EXPECT_EQ(trace.steps.back().t, 1);
        for (std::size_t k = 0; k + 1 < trace.steps.size(); ++k) {
          const double dt = trace.steps[k + 1].t - trace.steps[k].t;
          for (std::size_t i = 0; i < 9; ++i) {
            EXPECT_EQ(trace.steps[k + 1].x[i], trace.steps[k].x[i] + trace.steps[k].velocity[i] * dt);
            EXPECT_TRUE(std::isfinite(trace.steps[k].velocity[i])) << objective << ", " << integrator;
          }
        }
      }
    }
  }
}

TEST(Predictions, IntegratorsDifferAndAgreeInTheLimit) {
  Model model = nano_model({.grounded = false});
  const auto end = [&model](const char* integrator, int steps) {
    PredictOptions options;
    options.flow_steps = steps;
    options.integrator = integrator;
    return integrate_flow(model, nano_scene(), options).steps.back().x;
  };
  const auto distance = [](const Vector9& a, const Vector9& b) {
    double sum = 0;
    for (std::size_t i = 0; i < 9; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return std::sqrt(sum);
  };
  const Vector9 fine = end("rk4", 40);
  const double euler = distance(end("euler", 2), fine);
  EXPECT_GT(euler, 1e-6);
  EXPECT_LT(distance(end("euler", 40), fine), 0.5 * euler);
}

TEST(Predictions, SamplesAreThePredictionsOfTheirSeeds) {
  for (const char* backbone : {"mamba", "transformer"}) {
    for (const char* objective : {"cfm", "ddpm"}) {
      Model model = nano_model({backbone, objective, testing::TokenOrder::stored, true});
      PredictOptions options;
      options.seed = 20;
      const auto samples = integrate_samples(model, nano_scene(), options, 3);
      ASSERT_EQ(samples.size(), 3u);
      for (const FlowTrace& sample : samples) {
        expect_same(sample, integrate_flow(model, nano_scene(), options));
        ++options.seed;
      }
      EXPECT_NE(samples[0].steps[0].x, samples[1].steps[0].x);
    }
  }
}

TEST(Predictions, SlicesAndWhatGoesOnInBetweenChangeNoBit) {
  Model model = nano_model({});
  PredictOptions options;
  options.flow_steps = 5;
  options.seed = 7;
  const SceneInput scene = nano_scene();
  const auto whole = integrate_samples(model, scene, options, 2);
  FlowPrediction sliced(model, scene, options, 2), other(model, scene, options, 1);
  EXPECT_EQ(sliced.left(), 12u);
  int slices = 1;
  while (sliced.advance(std::chrono::milliseconds(0))) {
    other.advance(std::chrono::milliseconds(0));
    EXPECT_EQ(sliced.left(), static_cast<std::size_t>(12 - slices++));
  }
  EXPECT_EQ(slices, 12) << "one flow step a slice";
  const auto traces = sliced.take();
  ASSERT_EQ(traces.size(), whole.size());
  for (std::size_t i = 0; i < traces.size(); ++i) expect_same(traces[i], whole[i]);
}

TEST(Predictions, ABranchMeetsTheNoiseOfItsParent) {
  Model model = nano_model({.objective = "ddpm"});
  PredictOptions options;
  options.flow_steps = 5;
  options.seed = 3;
  const FlowTrace whole = integrate_flow(model, nano_scene(), options);
  options.seed = 99;  // the parent's counts
  options.branch = PredictOptions::Branch{&whole, 2, std::nullopt, std::nullopt, std::nullopt};
  expect_same(integrate_flow(model, nano_scene(), options), whole);
}

TEST(Predictions, RefuseWhatDoesNotFit) {
  Model cfm = nano_model({}), ddim = nano_model({.objective = "ddim"});
  PredictOptions options;
  EXPECT_THROW(integrate_samples(cfm, nano_scene(), options, 0), std::invalid_argument);
  options.flow_steps = 101;
  EXPECT_THROW(integrate_flow(ddim, nano_scene(), options), std::invalid_argument);
  options.flow_steps = 2;
  options.integrator = "leapfrog";
  EXPECT_THROW(integrate_flow(cfm, nano_scene(), options), std::invalid_argument);
  options.integrator = "euler";
  const FlowTrace trace = integrate_flow(cfm, nano_scene(), options);
  options.branch = PredictOptions::Branch{&trace, 1, std::nullopt, std::nullopt, std::nullopt};
  EXPECT_THROW(integrate_samples(cfm, nano_scene(), options, 2), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
