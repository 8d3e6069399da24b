// The state that a backend leaves when method `exact` cannot go on.
#pragma once

#include <gtest/gtest.h>

#include "support/scene_support.hpp"

namespace pf::test {

// run: parcel_before_a_press(). The parcel then touches both wall and ball, so that they are of one moment.
inline void expect_whole_state_when_unresolvable(SceneRun& run) {
  constexpr double kDt_s = 0.01, kTolerance_m = 1e-3;
  const double start_m = run.ball.position_m.x;
  StepReport report;
  try {
    run.advance(1000, kDt_s);
    FAIL() << "no error";
  } catch (const UnresolvableError& error) {
    report = error.report;
  }
  EXPECT_GT(report.totals.num_steps, 0U);
  EXPECT_LT(report.totals.num_steps, 1000U);
  EXPECT_GT(report.totals.num_collisions + report.totals.num_ball_hits, 0U);
  BackendState state;
  run.backend->save(state);
  EXPECT_FALSE(state.exact.active);
  EXPECT_EQ(state.ball.position_m.x, report.ball.position_m.x);
  const double flown_s = (state.ball.position_m.x - start_m) / 1.0;
  EXPECT_GE(flown_s, static_cast<double>(report.totals.num_steps) * kDt_s - 1e-6);
  EXPECT_LE(flown_s, static_cast<double>(report.totals.num_steps + 1) * kDt_s + 1e-6);
  const double parcel_m = to_metres(run.physics.world, state.parcels.position[0]).x;
  EXPECT_NEAR(parcel_m - state.ball.position_m.x, 2.5, kTolerance_m);
  EXPECT_NEAR(to_metres(run.physics.world, run.physics.world.half).x - parcel_m, 0.5, kTolerance_m);
  run.settings.method = Method::impulse;
  EXPECT_EQ(run.advance(1, 1e-6).totals.num_steps, 1U);
}

}  // namespace pf::test
