// Method `exact` of the CUDA backend: the same bits as on the CPU, and what its reports hold.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/error.hpp"
#include "gpu/gpu_scenes.hpp"
#include "model/exact/step_plan.hpp"
#include "support/snapshot_checks.hpp"
#include "support/unresolvable.hpp"

namespace pf::test {
namespace {

// Requests of random budgets, each of which goes on where the last one stopped.
StepReport advance_in_pieces(SceneRun& run, std::uint32_t num_steps, double dt_s, std::mt19937_64& random,
                             int& num_mid_step) {
  StepRequest request = step_request(run.settings, run.physics, num_steps, dt_s);
  StepReport sum;
  bool mid_step = false;
  while (sum.totals.num_steps < num_steps || mid_step) {
    request.num_done = static_cast<std::uint32_t>(sum.totals.num_steps);
    request.num_steps = num_steps - request.num_done;
    request.budget_ms = 1e-6 * std::pow(10.0, std::uniform_real_distribution<double>(0.0, 6.0)(random));
    const StepReport report = run.backend->advance(request);
    sum.totals += report.totals;
    sum.ball = report.ball;
    mid_step = report.mid_step;
    num_mid_step += mid_step ? 1 : 0;
  }
  return sum;
}

TEST_F(Gpu, ABudgetDoesNotChangeTheBitsOfExact) {
  std::mt19937_64 random(1);
  int num_mid_step = 0;
  for (const Settings& scene : scenes(20000)) {
    Settings s = scene;
    s.method = Method::exact;
    s.restitution = 0.6;
    s.area_fraction = 0.4;
    SceneRun whole(s, make_cuda_backend(0)), pieces(s, make_cuda_backend(0));
    const double dt_s = plan_frame(s, whole.physics, whole.ball).dt_s;
    const StepReport at_once = whole.advance(300, dt_s);
    const StepReport cut = advance_in_pieces(pieces, 300, dt_s, random, num_mid_step);
    EXPECT_EQ(pieces.backend->state_hash(), whole.backend->state_hash()) << s.name;
    EXPECT_EQ(cut.totals.event_hash, at_once.totals.event_hash) << s.name;
    EXPECT_EQ(cut.totals.num_collisions, at_once.totals.num_collisions) << s.name;
    EXPECT_EQ(cut.ball, at_once.ball) << s.name;
  }
  EXPECT_GT(num_mid_step, 0);
}

// The layer that a fast ball pushes up, as parcels lose their relative motion in it: steps are cut into
// windows.
TEST_F(Gpu, ExactSameBitsInTheLayerBeforeAFastBall) {
  struct Layer {
    double restitution, area_fraction, ball_mps, contact_clock_s;
  };
  for (const Layer& layer :
       {Layer{0.9, 0.4, 15.0, 0.0}, Layer{0.5, 0.1, 15.0, 0.0}, Layer{0.5, 0.4, 40.0, 0.0},
        Layer{0.3, 0.6, 15.0, 1e-6}, Layer{0.0, 0.2, 40.0, 1e-6}}) {
    Settings s = court(20000, Boundary::open);
    s.method = Method::exact;
    s.restitution = layer.restitution;
    s.area_fraction = layer.area_fraction;
    s.ball_vx_mps = layer.ball_mps;
    s.contact_clock_s = layer.contact_clock_s;
    expect_same_hashes(s, 1000);
  }
}

// A ball that each hit turns: it meets parcels that its straight path does not.
TEST_F(Gpu, ExactSameBitsOfALightBallInACrowd) {
  for (const double ball_kg : {1e-3, 1e-4, 1e-5, 3e-6}) {
    for (const double restitution : {1.0, 0.5}) {
      Settings s = court(20000, Boundary::walls);
      s.method = Method::exact;
      s.restitution = restitution;
      s.area_fraction = 0.5;
      s.ball_mass_kg = ball_kg;
      expect_same_hashes(s, 2000);
      s.num_parcels = 300'000;  // the ball is six parcels wide
      expect_same_hashes(s, 300);
    }
  }
}

// Largest mass of a ball that participates in a step, kg.
double heaviest_participant_kg(Physics physics, const BallState& ball, double dt_s) {
  double low_kg = 1e-6, high_kg = 1e12;
  while (high_kg > low_kg * (1.0 + 1e-9)) {
    const double middle_kg = std::sqrt(low_kg * high_kg);
    physics.ball.mass_kg = middle_kg;
    (ball_role(physics, ball, dt_s) == BallRole::participant ? low_kg : high_kg) = middle_kg;
  }
  return low_kg;
}

// A ball so heavy that its role changes as it slows, from one chord to the next within steps taken together.
TEST_F(Gpu, ExactSameBitsOfABallWhoseRoleChanges) {
  for (const bool magnus : {false, true}) {
    Settings s = court(20000);
    s.method = Method::exact;
    s.magnus = magnus;
    const SceneRun light(s, make_cpu_backend(0));
    const double dt_s = plan_frame(s, light.physics, light.ball).dt_s;
    s.ball_mass_kg = heaviest_participant_kg(light.physics, light.ball, dt_s) * (1.0 - 1e-5);
    SceneRun heavy(s, make_cuda_backend(0));
    EXPECT_EQ(ball_role(heavy.physics, heavy.ball, dt_s), BallRole::participant);
    EXPECT_EQ(ball_role(heavy.physics, heavy.advance(200).ball, dt_s), BallRole::frozen);
    expect_same_hashes(s, 200);
    s.ball_held = true;
    expect_same_hashes(s, 100);
  }
}

// Parcels that a fast ball has hit spread while it is away, when no bounds on speeds of regions are kept.
TEST_F(Gpu, ExactSameBitsWhenABallComesAndGoes) {
  const auto hashes = [](std::unique_ptr<Backend> backend) {
    Settings s = court(20000, Boundary::walls);
    s.method = Method::exact;
    s.area_fraction = 0.4;
    s.ball_vx_mps = 40.0;
    SceneRun run(s, std::move(backend));
    std::vector<std::uint64_t> list;
    for (int turn = 0; turn < 20; ++turn) {
      run.physics.ball.exists = turn % 2 == 0;
      run.backend->set_physics(run.physics);
      list.push_back(run.advance(run.physics.ball.exists ? 8 : 20).totals.event_hash);
    }
    list.push_back(run.backend->state_hash());
    return list;
  };
  EXPECT_EQ(hashes(make_cuda_backend(0)), hashes(make_cpu_backend(0)));
}

TEST_F(Gpu, ExactTimesItsStages) {
  Settings s = gas(200'000);
  s.method = Method::exact;
  SceneRun run(s, make_cuda_backend(0));
  run.advance(10);
  for (const std::uint32_t steps : {1U, 100U}) {
    const auto start = Clock::now();
    const PhaseTimes times = run.advance(steps).times;
    const double wall_ms = milliseconds_since(start);
    for (const Phase stage : {Phase::predict, Phase::solve, Phase::commit})
      EXPECT_GT(times[stage], 0.0) << kPhaseNames[static_cast<std::size_t>(stage)] << ", " << steps;
    if (steps > 1) {  // in a single step it may be below the resolution of the device's clock
      EXPECT_GT(times[Phase::reconcile], 0.0);
    }
    EXPECT_EQ(times[Phase::collide_integrate], 0.0);
    EXPECT_EQ(times[Phase::ball], 0.0);
    EXPECT_LT(times.total(), 1.01 * wall_ms) << steps;
  }
}

TEST_F(Gpu, ExactTimesARequestWithoutSteps) {
  Settings s = gas(1000);
  s.method = Method::exact;
  SceneRun run(s, make_cuda_backend(0));
  run.advance(1);
  const PhaseTimes times = run.advance(1, 1e-12).times;  // shorter than a tick
  EXPECT_GT(times[Phase::commit], 0.0);
  EXPECT_EQ(times[Phase::predict] + times[Phase::solve] + times[Phase::reconcile], 0.0);
}

TEST_F(Gpu, ExactFliesABallThroughAVacuum) {
  const auto ball = [](std::unique_ptr<Backend> backend) {
    Settings s = court(1000);
    s.air = Air::vacuum;
    s.method = Method::exact;
    SceneRun run(s, std::move(backend));
    const BallState flown = run.advance(20, 1e-3).ball;
    run.settings.method = Method::impulse;
    return std::pair(flown, run.advance(20, 1e-3).ball);
  };
  EXPECT_EQ(ball(make_cuda_backend(0)), ball(make_cpu_backend(0)));
}

TEST_F(Gpu, ExactRejectsACrowdThatCannotBeResolved) {
  SceneRun run = parcel_in_a_vice(make_cuda_backend(0));
  EXPECT_THROW(run.advance(1, 0.1), UserError);
}

TEST_F(Gpu, ExactLeavesTheStateOfTheMomentThatCannotBeResolved) {
  SceneRun run = parcel_before_a_press(make_cuda_backend(0));
  expect_whole_state_when_unresolvable(run);
}

TEST_F(Gpu, ExactSameBitsAsTheCpuForEverySceneAndBoundary) {
  for (const std::int64_t n : {1, 2, 1000, 100000}) {
    for (Settings s : scenes(n)) {
      s.method = Method::exact;
      for (const std::uint32_t steps : {1U, 100U}) expect_same_hashes(s, steps);
    }
  }
}

TEST_F(Gpu, ExactSameBitsAfterTwoThousandSteps) {
  for (const std::int64_t n : {1, 2, 1000, 100000}) {
    for (Settings s : scenes(n)) {
      s.method = Method::exact;
      expect_same_hashes(s, 2000);
    }
  }
}

TEST_F(Gpu, ExactSameEventsForAnyStepLengthWithAContactDuration) {
  Settings s = gas(5000, 0.6, Boundary::periodic);
  s.method = Method::exact;
  s.restitution = 0.7;
  s.contact_clock_s = 1e-4;
  expect_same_hashes(s, 40);
  const auto events = [&](double dt_s, std::uint32_t steps) {
    SceneRun run(s, make_cuda_backend(0));
    return run.advance(steps, dt_s).totals.event_hash;
  };
  EXPECT_EQ(events(0.01, 80), events(0.04, 20));
  EXPECT_EQ(events(0.01, 80), events(0.08, 10));
}

// Ticks become longer while a gas cools. The steps of one request for the whole time are so long that parcels
// are sorted within them.
TEST_F(Gpu, ExactSameBitsWhileAGasCools) {
  Settings cooling = gas(500, 0.25, Boundary::periodic);
  cooling.method = Method::exact;
  cooling.restitution = 0.6;
  for (const double clock_s : {0.0, 0.02}) {
    cooling.contact_clock_s = clock_s;
    for (const std::uint32_t steps : {1U, 300U}) {
      SceneRun cpu(cooling, make_cpu_backend(0)), gpu(cooling, make_cuda_backend(0));
      const StepTotals on_cpu = cpu.advance(steps, 1e4 / steps).totals;
      const StepTotals on_gpu = gpu.advance(steps, 1e4 / steps).totals;
      EXPECT_LT(gpu.backend->measure().parcel_energy_j / 500.0, 1e-4);
      EXPECT_EQ(on_gpu.event_hash, on_cpu.event_hash) << clock_s << ", " << steps;
      EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash()) << clock_s << ", " << steps;
    }
  }
}

TEST_F(Gpu, ExactSameBitsOfABallSetInMotionInAColdGas) {
  const auto hashes = [](std::unique_ptr<Backend> backend) {
    Settings s = court(500, Boundary::periodic);
    s.method = Method::exact;
    s.restitution = 0.6;
    s.ball_vx_mps = s.ball_spin_radps = 0.0;
    s.magnus = false;
    SceneRun run(s, std::move(backend));
    run.advance(50, 20.0);
    BallState ball = run.ball;
    ball.velocity_mps = {5.0, 1.0};
    run.backend->set_ball(ball);
    const StepTotals totals = run.advance(40, 0.01).totals;
    return std::pair(run.backend->state_hash(), totals.event_hash);
  };
  EXPECT_EQ(hashes(make_cuda_backend(0)), hashes(make_cpu_backend(0)));
}

TEST_F(Gpu, ExactSameBitsAfterOtherMethods) {
  const auto hash = [](std::unique_ptr<Backend> backend) {
    SceneRun run(gas(4000, 0.5), std::move(backend));
    for (const Method method : {Method::impulse, Method::exact, Method::impulse, Method::exact}) {
      run.settings.method = method;
      run.advance(30, 0.02);
    }
    return run.backend->state_hash();
  };
  EXPECT_EQ(hash(make_cuda_backend(0)), hash(make_cpu_backend(0)));
}

TEST_F(Gpu, ExactRepeatsAtTenMillion) {
  Settings s = gas(10'000'000);
  s.method = Method::exact;
  const auto hash = [&] {
    SceneRun run(s, make_cuda_backend(0));
    const StepReport report = run.advance(30);
    EXPECT_GT(report.totals.num_collisions, 1'000'000U);
    return run.backend->state_hash();
  };
  EXPECT_EQ(hash(), hash());
}

// With a ball, and with the ticks of last contacts of inelastic parcels, which need the most.
TEST_F(Gpu, ExactNeedsAtMost125BytesAParcel) {
  Settings s = court(10'000'000);
  s.method = Method::exact;
  s.restitution = 0.9;
  SceneRun run(s, make_cuda_backend(0));
  run.advance(1);
  const std::uint64_t bytes = run.backend->memory_bytes();
  RecordProperty("bytes", std::to_string(bytes));
  EXPECT_LE(bytes, 125U * 10'000'000U);
}

}  // namespace
}  // namespace pf::test
