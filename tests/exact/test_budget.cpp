// A request with a time budget stops early and is continued. The results are those of one request without it.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "exact/exact_support.hpp"

namespace pf::test {
namespace {

struct BudgetCase {
  const char* name;
  Settings settings;
  std::uint32_t num_steps;
  double dt_s;
};
void PrintTo(const BudgetCase& c, std::ostream* out) { *out << c.name; }

struct SlicedRun {
  std::uint64_t state = 0, events = 0, num_steps = 0, num_collisions = 0, num_sorts = 0;
  int num_requests = 0, num_mid_step = 0, num_mid_path = 0;
};

// budget_ms: of each request.
template <class Budget>
SlicedRun run_in_slices(const BudgetCase& c, unsigned threads, const Budget& budget_ms) {
  SceneRun scene(c.settings, threads);
  SlicedRun run;
  BallState ball = scene.ball;
  bool mid_step = false;
  while (run.num_steps < c.num_steps || mid_step) {
    const std::uint32_t num_left = c.num_steps - static_cast<std::uint32_t>(run.num_steps);
    StepRequest request = step_request(c.settings, scene.physics, num_left, c.dt_s);
    request.num_done = static_cast<std::uint32_t>(run.num_steps);
    request.budget_ms = budget_ms();
    const StepReport report = scene.backend->advance(request);
    run.num_steps += report.totals.num_steps;
    run.num_collisions += report.totals.num_collisions;
    run.events += report.totals.event_hash;
    run.num_sorts += report.totals.num_sorts;
    mid_step = report.mid_step;
    ++run.num_requests;
    run.num_mid_step += mid_step ? 1 : 0;
    run.num_mid_path += mid_step && report.ball.position_m != ball.position_m ? 1 : 0;
    ball = report.ball;
  }
  run.state = scene.backend->state_hash();
  return run;
}

Settings with_curved_ball(Settings s, double mass_kg) {
  s.ball_present = true;
  s.ball_radius_m = 2.5;
  s.ball_mass_kg = mass_kg;
  s.ball_x_m = s.ball_y_m = 0.0;
  s.ball_vx_mps = 2.0;
  s.ball_spin_radps = 1.0;
  s.friction = 0.3;
  s.magnus = true;
  s.k_magnus = 0.05 * mass_kg;
  return s;
}

Settings of_method(Settings s, Method method) {
  s.method = method;
  return s;
}

constexpr double kMin_ms = 1e-6;  // spent at once

class Budget : public testing::TestWithParam<BudgetCase> {};

TEST_P(Budget, DoesNotChangeTheResult) {
  const BudgetCase& c = GetParam();
  const SlicedRun whole = run_in_slices(c, 1, [] { return 0.0; });
  EXPECT_EQ(whole.num_requests, 1);
  EXPECT_GT(whole.num_collisions, 20U);
  for (int seed = 1; seed <= 4 * test_scale(); ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    const auto drawn_ms = [&random] {
      return kMin_ms * std::pow(10.0, std::uniform_real_distribution<double>(0.0, 6.5)(random));
    };
    const SlicedRun sliced = run_in_slices(c, 1 + static_cast<unsigned>(seed) % 3, drawn_ms);
    EXPECT_EQ(sliced.state, whole.state) << "seed " << seed;
    EXPECT_EQ(sliced.events, whole.events) << "seed " << seed;
    EXPECT_EQ(sliced.num_collisions, whole.num_collisions) << "seed " << seed;
    EXPECT_EQ(sliced.num_steps, whole.num_steps) << "seed " << seed;
  }
}

// Every request gets further by a step, or by a window of one.
TEST_P(Budget, CutsARequest) {
  const BudgetCase& c = GetParam();
  const SlicedRun least = run_in_slices(c, 1, [] { return kMin_ms; });
  EXPECT_GE(least.num_requests, static_cast<int>(c.num_steps));
  if (c.settings.method != Method::exact) {
    EXPECT_EQ(least.num_requests, static_cast<int>(c.num_steps));
    EXPECT_EQ(least.num_mid_step, 0);
    return;
  }
  EXPECT_GT(least.num_mid_step, 0);
  const auto num_requests = static_cast<std::uint64_t>(least.num_requests);
  EXPECT_GT(num_requests, least.num_sorts + least.num_steps) << "an epoch has several windows";
  if (!c.settings.ball_present) return;
  EXPECT_GT(least.num_mid_path, 0) << "the ball moves within a step, too";
}

INSTANTIATE_TEST_SUITE_P(
    Exact, Budget,
    testing::Values(BudgetCase{"impulse", of_method(court(500), Method::impulse), 40, 2e-3},
                    BudgetCase{"spring", of_method(court(2000), Method::spring), 60, 1e-3},
                    BudgetCase{"gas", exact(gas(2000, 0.3, kPeriodic)), 8, 0.1},
                    BudgetCase{"court", exact(court(3000)), 40, 4e-4},
                    BudgetCase{"curved_ball", with_curved_ball(exact(gas(1000, 0.3, kWalls)), 20.0), 20, 0.3},
                    BudgetCase{"curved_ball_in_a_crowd",
                               with_curved_ball(exact(gas(1000, 0.6, kPeriodic)), 1.0), 12, 0.1},
                    BudgetCase{"frozen_ball", with_curved_ball(exact(gas(500, 0.2, kPeriodic)), 1e9), 20,
                               0.2}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

}  // namespace
}  // namespace pf::test
