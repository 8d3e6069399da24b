// Drag and hits on a held ball against free-molecular flow, while a run flies.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "app/run_state.hpp"
#include "app/simulation.hpp"
#include "model/free_flow.hpp"
#include "scene/scene_file.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

Settings tunnel(std::int64_t num_parcels) {
  Settings settings = load_scene("tunnel");
  settings.num_parcels = num_parcels;
  return settings;
}

struct TunnelRun {
  Simulation simulation;

  explicit TunnelRun(const Settings& settings) : simulation(settings, make_cpu_backend(1)) {}

  std::optional<FreeFlowFigures> frames(int num, const Commands& first = {}) {
    for (int i = 0; i < num; ++i) simulation.advance_frame(i == 0 ? first : Commands{}, nullptr);
    return simulation.view().free_flow;
  }
  std::optional<FreeFlowFigures> frames_with(const Settings& settings, int num) {
    Commands commands;
    commands.settings = settings;
    return frames(num, commands);
  }
};

void expect_theory(const std::optional<FreeFlowFigures>& figures, double max_error, const std::string& what) {
  ASSERT_TRUE(figures) << what;
  EXPECT_NEAR(figures->drag_over_theory, 1.0, 3.0 * figures->drag_error) << what;
  EXPECT_NEAR(figures->hits_over_theory, 1.0, 3.0 * figures->hits_error) << what;
  EXPECT_GT(figures->drag_error, figures->hits_error) << what;
  EXPECT_LT(figures->drag_error, max_error) << what;
}

// 600,000 parcels at speed ratio 2 for 0.5 s, in which some 6,300 hit the ball. The large ball leaves a tenth
// less room for them.
TEST(FreeFlow, DragAndHitsAreThoseOfTheory) {
  for (const double restitution : {1.0, 0.4}) {
    Settings settings = tunnel(600'000);
    settings.restitution = restitution;
    expect_theory(TunnelRun(settings).frames(120), 0.016, "restitution " + std::to_string(restitution));
  }
  Settings large = tunnel(600'000);
  large.ball_radius_m = 2.0;
  expect_theory(TunnelRun(large).frames(60), 0.012, "large ball");
}

TEST(FreeFlow, IsComparedOnlyWhereTheoryHolds) {
  EXPECT_TRUE(TunnelRun(tunnel(5'000)).frames(20)) << "unchanged";
  using Change = void (*)(Settings&);
  const std::pair<const char*, Change> changes[] = {
      {"rough", [](Settings& s) { s.friction = 0.3; }},
      {"contacts", [](Settings& s) { s.contacts = true; }},
      {"no stream", [](Settings& s) { s.flow_x_mps = 0.0; }},
      {"a hot disc", [](Settings& s) { s.hot_radius_m = 1.0; }},
      {"free", [](Settings& s) { s.ball_held = false; }},
      {"open", [](Settings& s) { s.boundary = Boundary::open; }}};
  for (const auto& [what, change] : changes) {
    Settings settings = tunnel(5'000);
    change(settings);
    EXPECT_FALSE(TunnelRun(settings).frames(20)) << what;
  }
}

// A frame is 1/240 s. After 1.09 s, in frame 262, parcels that have hit the ball may be back.
TEST(FreeFlow, FiguresStayWhenItHasLasted) {
  TunnelRun run(tunnel(20'000));
  const FreeFlowFigures before = run.frames(240).value();
  const FreeFlowFigures last = run.frames(24).value();
  const FreeFlowFigures later = run.frames(40).value();
  EXPECT_NE(before.hits_over_theory, last.hits_over_theory);
  EXPECT_EQ(last.hits_over_theory, later.hits_over_theory);
  EXPECT_EQ(last.drag_over_theory, later.drag_over_theory);
}

// Method and step do not matter. What changes the flow does, also after it has been changed back: the air is
// not what it was until it is spawned anew.
TEST(FreeFlow, IsComparedAsLongAsNothingDisturbsIt) {
  TunnelRun run(tunnel(5'000));
  run.frames(20);
  Settings other = run.simulation.settings();
  other.method = Method::exact;
  other.dt_s *= 0.5;
  EXPECT_TRUE(run.frames_with(other, 10));
  Settings disturbed = other;
  disturbed.contacts = true;
  EXPECT_FALSE(run.frames_with(disturbed, 2));
  EXPECT_FALSE(run.frames_with(other, 20));
  Commands restart;
  restart.restart = other;
  EXPECT_TRUE(run.frames(20, restart));
  Settings lossy = other;
  lossy.restitution = 0.5;
  EXPECT_FALSE(run.frames_with(lossy, 20));
}

TEST(FreeFlow, AirOfAFileIsOfUnknownAge) {
  TunnelRun run(tunnel(5'000));
  ASSERT_TRUE(run.frames(20));
  RunState state;
  run.simulation.save(state);
  Simulation resumed(state, make_cpu_backend(1));
  for (int i = 0; i < 20; ++i) resumed.advance_frame({}, nullptr);
  EXPECT_FALSE(resumed.view().free_flow);
}

// R = (9/4) <g (8/15 gx^2 + 2/15 gy^2)> <g> / <g gx>^2 over a Maxwellian of unit variance around sqrt(2) S.
TEST(FreeFlow, ErrorOfDragIsThatOfIndependentHits) {
  for (const double s : {0.3, 0.5, 0.8, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0}) {
    double squares = 0.0, speeds = 0.0, impulses = 0.0;
    constexpr double kStep = 0.04, kReach = 7.0;
    for (double u = -kReach; u < kReach; u += kStep) {
      for (double v = -kReach; v < kReach; v += kStep) {
        const double x = u + std::sqrt(2.0) * s, g = std::hypot(x, v);
        const double weight = std::exp(-0.5 * (u * u + v * v)) * kStep * kStep / (2.0 * kPi);
        squares += weight * g * (8.0 * x * x + 2.0 * v * v) / 15.0;
        speeds += weight * g;
        impulses += weight * g * x;
      }
    }
    const double r = 2.25 * squares * speeds / (impulses * impulses);
    EXPECT_NEAR(smooth_drag_error(s, 100.0) / std::sqrt(r / 100.0), 1.0, 0.006) << s;
  }
}

}  // namespace
}  // namespace pf::test
