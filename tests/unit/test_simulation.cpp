// The simulation loop: its figures before a step and of a frame, and failures: a failing device, NaN.
#include "app/simulation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "app/memory.hpp"
#include "core/error.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"
#include "support/losing_backend.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

class Fallback : public testing::TestWithParam<LosingBackend::At> {};

TEST_P(Fallback, ContinuesFromTheStartOfTheScene) {
  Simulation simulation(court(500), std::make_unique<LosingBackend>(GetParam(), 3));
  simulation.set_fallback([] { return make_cpu_backend(1); });
  Commands pause;
  pause.toggle_pause = GetParam() == LosingBackend::At::draw;  // a paused frame is drawn without a step
  struct NoTarget final : DrawTarget {
    DrawTargetKind kind() const override { return DrawTargetKind::host; }
    void reserve(std::size_t n) override { position.resize(n), speed.resize(n); }
    DrawBuffers map() override {
      ++num_mapped;
      return {position.data(), speed.data(), position.size(), false};
    }
    void unmap() override { --num_mapped; }
    int num_mapped = 0;
    std::vector<Vec2f> position;
    std::vector<float> speed;
  } target;
  for (int frame = 0; frame < 4; ++frame) simulation.advance_frame(frame == 0 ? pause : Commands{}, &target);
  EXPECT_EQ(target.num_mapped, 0) << "also where drawing failed";
  EXPECT_EQ(simulation.num_fallbacks(), 1);
  EXPECT_EQ(simulation.backend().name(), "cpu");
  EXPECT_NE(simulation.view().message.find("fell off the bus"), std::string::npos)
      << simulation.view().message;
  EXPECT_EQ(simulation.view().simulated_s, 0.0);

  Simulation fresh(court(500), make_cpu_backend(1));
  if (pause.toggle_pause)
    simulation.advance_frame(pause, nullptr);  // continue
  else
    simulation.advance_frame({}, nullptr);
  fresh.advance_frame({}, nullptr);
  EXPECT_EQ(simulation.backend().state_hash(), fresh.backend().state_hash());
}

INSTANTIATE_TEST_SUITE_P(EveryCall, Fallback,
                         testing::Values(LosingBackend::At::submit, LosingBackend::At::collect,
                                         LosingBackend::At::draw));

TEST(Simulation, AFallbackWithoutRoomSaysWhatFailedFirst) {
  Settings s = court(500);
  s.num_parcels_cpu = s.num_parcels = 500;
  Simulation simulation(s, std::make_unique<LosingBackend>(LosingBackend::At::submit, 0));
  simulation.set_fallback([]() -> std::unique_ptr<Backend> {
    auto refusing = std::make_unique<LosingBackend>(LosingBackend::At::reset, 0, true);
    return refusing;
  });
  try {
    simulation.advance_frame({}, nullptr);
    FAIL() << "it goes on";
  } catch (const DeviceError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("losing failed (the device fell off the bus)"), std::string::npos) << text;
    EXPECT_NE(text.find("cannot go on: refused"), std::string::npos) << text;
  }
}

// Threads and parcels in one edit, without the memory for the latter.
TEST(Simulation, ARefusedEditChangesNothing) {
  if (available_memory_bytes() > 300'000'000'000) GTEST_SKIP() << "10^9 parcels have room here";
  Settings s = court(500);
  s.method = Method::exact;
  Simulation edited(s, make_cpu_backend(1)), plain(s, make_cpu_backend(1));
  for (Simulation* simulation : {&edited, &plain}) simulation->advance_frame({}, nullptr);
  Commands both;
  both.settings = edited.settings();
  both.settings->threads = 2;
  both.settings->num_parcels = 1'000'000'000;
  edited.advance_frame(both, nullptr);
  plain.advance_frame({}, nullptr);
  EXPECT_NE(edited.view().message, "");
  EXPECT_EQ(edited.settings().threads, s.threads);
  EXPECT_EQ(edited.backend().device(), plain.backend().device());
  EXPECT_EQ(edited.backend().state_hash(), plain.backend().state_hash());
}

TEST(Simulation, WithoutFallbackTheCallerGetsTheError) {
  Simulation simulation(court(500), std::make_unique<LosingBackend>(LosingBackend::At::collect, 0));
  EXPECT_THROW(simulation.advance_frame({}, nullptr), DeviceError);
}

// As a crowd that `exact` cannot resolve.
TEST(Simulation, StepsThatCannotBeDonePauseTheRun) {
  for (const LosingBackend::At at : {LosingBackend::At::submit, LosingBackend::At::collect}) {
    Simulation simulation(court(500), std::make_unique<LosingBackend>(at, 1, true));
    simulation.advance_frame({}, nullptr);
    EXPECT_FALSE(simulation.view().paused);
    simulation.advance_frame({}, nullptr);
    EXPECT_TRUE(simulation.view().paused);
    EXPECT_EQ(simulation.view().message, "refused");
    Commands reset;
    reset.reset = true;
    simulation.advance_frame(reset, nullptr);
    EXPECT_EQ(simulation.view().message, "");
  }
}

TEST(Simulation, ALaunchThatIsRefusedDoesNotEndTheFlight) {
  auto backend = std::make_unique<LosingBackend>(LosingBackend::At::submit, 1000);
  LosingBackend& used = *backend;
  Simulation simulation(court(200), std::move(backend));
  for (int frame = 0; frame < 3; ++frame) simulation.advance_frame({}, nullptr);
  used.refusal = "not now";
  Commands fly, compare;
  fly.fly = BallLaunch{{10.0, 0.0}, 0.0};
  compare.compare = Comparison::half_step;
  for (const Commands& refused : {fly, compare}) {
    simulation.advance_frame(refused, nullptr);
    EXPECT_EQ(simulation.view().message, "not now");
    EXPECT_FALSE(simulation.view().flight_record->end_energy_j);
  }
}

TEST(Simulation, NothingIsLaunchedWithoutABall) {
  Simulation simulation(load_scene("gas"), make_cpu_backend(1));
  simulation.keep_checkpoints();
  for (int frame = 0; frame < 10; ++frame) simulation.advance_frame({}, nullptr);
  Commands launch;
  launch.launch = true;
  simulation.advance_frame(launch, nullptr);
  EXPECT_EQ(simulation.view().history->latest(), 11);
}

// The settings that a jump would have kept are not those of a later one.
TEST(Simulation, AJumpThatFailedLeavesNoSettingsBehind) {
  constexpr int kFrames = 70;
  Simulation simulation(court(200),
                        std::make_unique<LosingBackend>(LosingBackend::At::submit, kFrames, true));
  simulation.keep_checkpoints();
  for (int frame = 0; frame < kFrames; ++frame) simulation.advance_frame({}, nullptr);
  Commands back;
  back.back = true;
  simulation.advance_frame(back, nullptr);
  ASSERT_EQ(simulation.view().message, "refused");
  ASSERT_FALSE(simulation.view().sought_s);
  Commands edit;
  edit.settings = simulation.settings();
  edit.settings->restitution = 0.5;
  simulation.advance_frame(edit, nullptr);
  simulation.advance_frame(back, nullptr);
  EXPECT_EQ(simulation.view().message, "");
  EXPECT_EQ(simulation.settings().restitution, 0.5);
}

TEST(Simulation, NanPausesTheRunWithCountStepAndFirstId) {
  Simulation simulation(court(500), make_cpu_backend(1));
  simulation.advance_frame({}, nullptr);
  const std::uint64_t steps_before = simulation.view().totals.num_steps;
  ParcelSnapshot broken = simulation.backend().snapshot();
  broken.velocity[77].x = std::numeric_limits<float>::quiet_NaN();
  broken.velocity[123].y = std::numeric_limits<float>::infinity();
  simulation.backend().restore(broken);
  simulation.advance_frame({}, nullptr);
  EXPECT_TRUE(simulation.view().paused);
  EXPECT_EQ(simulation.view().frame_totals.first_invalid_id, 77U);
  const std::string& message = simulation.view().message;
  EXPECT_NE(message.find("in step " + std::to_string(steps_before)), std::string::npos) << message;
  EXPECT_NE(message.find("id 77"), std::string::npos) << message;
  const double simulated_s = simulation.view().simulated_s;
  simulation.advance_frame({}, nullptr);
  EXPECT_EQ(simulation.view().simulated_s, simulated_s) << "paused";
}

void expect_planned(const FrameView& view) {
  const FramePlan plan = plan_frame(*view.settings, *view.physics, view.ball);
  EXPECT_EQ(view.dt_s, plan.dt_s);
  EXPECT_EQ(view.steps_per_frame, plan.num_steps);
  EXPECT_EQ(view.slow_motion, plan.slow_motion);
}

// Halving the time step needs this scene's derived values; those of an earlier scene would be wrong.
TEST(Simulation, BeforeAStepFiguresAreThoseOfTheNextFrame) {
  Simulation simulation(court(500), make_cpu_backend(1));
  expect_planned(simulation.view());
  for (int frame = 0; frame < 3; ++frame) simulation.advance_frame({}, nullptr);
  Commands slower;
  slower.toggle_pause = true;
  slower.time_scale_factor = 0.25;
  simulation.advance_frame(slower, nullptr);
  expect_planned(simulation.view());
  Commands other;
  other.restart = court(5000);
  simulation.advance_frame(other, nullptr);
  EXPECT_EQ(simulation.view().totals.num_steps, 0U);
  expect_planned(simulation.view());
}

// 2e8 collisions among 1e8 parcels in 1 s: 4 of each. Parcels times steps are 5e9, more than 2^32.
TEST(Simulation, TheMeasuredRateHoldsForManyParcelsAndSteps) {
  FramePlan plan;
  plan.num_steps = 50;
  plan.dt_s = 0.02;
  EXPECT_DOUBLE_EQ(measured_rate_per_s(200'000'000, 100'000'000, plan), 4.0);
  EXPECT_EQ(measured_rate_per_s(0, 0, plan), 0.0);
}

}  // namespace
}  // namespace pf::test
