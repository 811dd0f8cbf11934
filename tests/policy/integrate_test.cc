// Integrators: order of accuracy, and what they do with a flow that points at an end.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "policy/integrator.h"

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

}  // namespace
}  // namespace flowscope
