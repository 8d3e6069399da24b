// Method `exact`: results depend on neither windows nor epochs. Window lengths are drawn at random here, from
// a single tick to the longest possible, and windows are cut after a few events of a cluster.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "backend/exact/epoch_length.hpp"
#include "backend/exact/timeline.hpp"
#include "backend/exact/window_length.hpp"
#include "exact/exact_support.hpp"

namespace pf::test {
namespace {

struct Result {
  std::uint64_t events = 0, state = 0;
  std::uint64_t num_collisions = 0, num_ball_hits = 0;
  bool operator==(const Result&) const = default;
};

void PrintTo(const Result& r, std::ostream* out) {
  *out << r.num_collisions << " collisions, " << r.num_ball_hits << " hits, events " << r.events << ", state "
       << r.state;
}

// A timeline without a backend around it.
struct TimelineRun {
  SceneRun scene;
  SortedParcels parcels;
  ThreadTeam team;
  ExactTimeline timeline{team};
  BallState ball;
  StepTotals totals;

  TimelineRun(const Settings& settings, unsigned threads)
      : scene(settings, 1), team(threads), ball(scene.ball) {
    const ParcelSnapshot start = scene.backend->snapshot();
    parcels.resize(start.position.size());
    for (std::uint32_t i = 0; i < start.position.size(); ++i) {
      parcels.current.position[i] = start.position[i];
      parcels.current.velocity[i] = start.velocity[i];
      parcels.current.id[i] = i;
    }
    enter();
  }

  void enter() { timeline.enter(scene.physics, contact_clock_s(scene.settings, scene.physics), parcels); }

  // Makes one parcel in `period` 20 times as fast.
  void heat(std::size_t period) {
    for (std::size_t i = 0; i < parcels.size(); i += period)
      parcels.current.velocity[i] = parcels.current.velocity[i] * 20.0F;
    enter();
  }

  // Only parcels to the right of the middle stay, and each gets a mirror image to the left.
  void mirror() {
    const ParcelArrays all = parcels.current;
    parcels.resize(0);
    const auto radius =
        static_cast<std::int32_t>(scene.physics.parcels.radius_m / scene.physics.world.unit_m);
    for (std::size_t i = 0; i < all.id.size(); ++i) {
      const Vec2i x = all.position[i];
      const Vec2f v = all.velocity[i];
      if (x.x <= radius) continue;
      const std::size_t n = parcels.size();
      parcels.resize(n + 2);
      parcels.current.position[n] = x;
      parcels.current.velocity[n] = v;
      parcels.current.position[n + 1] = {-x.x, x.y};
      parcels.current.velocity[n + 1] = {-v.x, v.y};
    }
    for (std::uint32_t i = 0; i < parcels.size(); ++i) parcels.current.id[i] = i;
    enter();
  }

  // Window lengths from a tick to all that is possible; any power of two in between is as likely. Epochs of a
  // quarter of the preferred length to 16 times.
  void draw_lengths(std::uint64_t seed) {
    timeline.epoch_length().draw = [random = std::mt19937_64(seed)]() mutable {
      return std::exp2(std::uniform_real_distribution<double>(-2.0, 4.0)(random));
    };
    timeline.window_length().draw = [random = std::mt19937_64(seed)](std::uint32_t limit) mutable {
      const double exponent = std::uniform_real_distribution<double>(0.0, 1.0)(random);
      return static_cast<std::uint32_t>(
          std::pow(static_cast<double>(limit), 1.0 - 0.6 * exponent * exponent));
    };
  }

  void advance(std::uint32_t num_steps, double dt_s) {
    StepReport report;
    timeline.advance(scene.physics, step_request(scene.settings, scene.physics, num_steps, dt_s), parcels,
                     ball, report);
    totals += report.totals;
  }

  Result result() {
    Result r{totals.event_hash, ball_hash(ball), totals.num_collisions, totals.num_ball_hits};
    const std::vector<Vec2i>& position = timeline.positions(parcels);
    for (std::size_t i = 0; i < parcels.size(); ++i)
      r.state += parcel_hash(parcels.current.id[i], position[i], parcels.current.velocity[i]);
    return r;
  }
};

struct WindowCase {
  const char* name;
  Settings settings;
  std::uint32_t num_steps;
  double dt_s;
};
void PrintTo(const WindowCase& c, std::ostream* out) { *out << c.name; }

Settings with_default_clock(Settings s) {
  s.contact_clock = Settings{}.contact_clock;
  return s;
}

// A ball of 5 parcel radii that spins and has friction.
Settings with_ball(Settings s, double mass_kg, double speed_mps, bool curves) {
  s.ball_present = true;
  s.ball_radius_m = 2.5;
  s.ball_mass_kg = mass_kg;
  s.ball_x_m = s.ball_y_m = 0.0;
  s.ball_vx_mps = speed_mps;
  s.ball_spin_radps = 0.5 * speed_mps;
  s.friction = 0.3;
  s.magnus = curves;
  s.k_magnus = curves ? 0.05 * mass_kg : 0.0;
  return s;
}

Settings layer(std::int64_t n, double area_fraction, double e, double speed_mps = 15.0) {
  Settings s = exact(court(n));
  s.area_fraction = area_fraction;
  s.restitution = e;
  s.ball_vx_mps = speed_mps;
  s.ball_y_m = 0.0;
  s.contact_clock = 0.0;
  return s;
}

class Windows : public testing::TestWithParam<WindowCase> {};

TEST_P(Windows, DoNotChangeTheResult) {
  const WindowCase& c = GetParam();
  TimelineRun plain(c.settings, 1);
  plain.advance(c.num_steps, c.dt_s);
  const Result expected = plain.result();
  EXPECT_GT(expected.num_collisions + expected.num_ball_hits, 50U);
  for (int seed = 1; seed <= 6 * test_scale(); ++seed) {
    TimelineRun run(c.settings, 1 + static_cast<unsigned>(seed) % 3);
    run.draw_lengths(static_cast<std::uint64_t>(seed));
    if (seed % 2 == 0) run.timeline.window_length().event_limit = static_cast<std::uint32_t>(seed) - 1;
    run.advance(c.num_steps, c.dt_s);
    EXPECT_EQ(run.result(), expected) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Exact, Windows,
    testing::Values(
        WindowCase{"walls", with_restitution(exact(gas(300, 0.3, kWalls)), 0.9), 20, 0.1},
        WindowCase{"dense_periodic", exact(gas(1000, 0.6, kPeriodic)), 10, 0.1},
        WindowCase{"densest", exact(gas(200, 0.69, kPeriodic)), 10, 0.1},
        WindowCase{"open", exact(gas(1000, 0.3, kOpen)), 20, 0.1},
        WindowCase{"clock", with_clock(with_restitution(exact(gas(1000, 0.6, kPeriodic)), 0.8), 0.02), 10,
                   0.1},
        WindowCase{"without_restitution", with_restitution(exact(gas(200, 0.3, kWalls)), 0.0), 10, 0.1},
        WindowCase{"many", exact(gas(20000, 0.2, kPeriodic)), 4, 0.1},
        WindowCase{"ball", with_ball(exact(gas(300, 0.3, kWalls)), 20.0, 2.0, false), 30, 0.1},
        WindowCase{"fast_ball", with_ball(exact(gas(1000, 0.3, kPeriodic)), 200.0, 15.0, false), 20, 0.05},
        WindowCase{"light_ball", with_ball(exact(gas(300, 0.2, kWalls)), 0.3, 2.0, false), 30, 0.1},
        WindowCase{"ball_in_a_crowd", with_ball(exact(gas(1000, 0.6, kWalls)), 20.0, 2.0, false), 20, 0.1},
        WindowCase{"light_ball_in_a_crowd", with_ball(exact(gas(1000, 0.6, kPeriodic)), 1.0, 2.0, false), 20,
                   0.1},
        WindowCase{"curved_ball", with_ball(exact(gas(300, 0.3, kWalls)), 20.0, 2.0, true), 30, 0.1},
        WindowCase{"frozen_ball", with_ball(exact(gas(300, 0.2, kPeriodic)), 1e9, 3.0, true), 30, 0.1},
        WindowCase{"layer", layer(3000, 0.4, 0.9), 150, 4e-4},
        WindowCase{"inelastic_layer", layer(3000, 0.4, 0.3), 80, 4e-4},
        WindowCase{"layer_with_clock", with_default_clock(layer(3000, 0.4, 0.0)), 150, 4e-4},
        WindowCase{"bullet", layer(3000, 0.1, 0.5, 300.0), 40, 2e-4}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

// Two parcels that are mirror images, hit by others in one window, predict their collision with each other's
// old trajectory, both at the same tick. It comes later.
TEST(MirroredGas, WindowsDoNotChangeTheResult) {
  const Settings settings = exact(gas(600, 0.3, kWalls));
  const auto fly = [&](std::uint64_t seed) {
    TimelineRun run(settings, 1);
    run.mirror();
    if (seed > 0) run.draw_lengths(seed);
    run.advance(200, 0.1);
    return run.result();
  };
  const Result expected = fly(0);
  EXPECT_GT(expected.num_collisions, 1000U);
  for (std::uint64_t seed = 1; seed <= 40; ++seed) EXPECT_EQ(fly(seed), expected) << "seed " << seed;
}

// Events in the last of 60 windows of a gas of 100,000 parcels with an event in each tick. times_solved: how
// often each event is solved on the way.
double events_learnt(std::uint32_t largest_cluster, double times_solved) {
  WindowLength rule;
  rule.reset(100'000);
  std::uint32_t length = 0;
  for (int k = 0; k < 60; ++k) {
    length = rule.choose(1'000'000'000);
    WindowOutcome outcome;
    outcome.result.num_events = length;
    outcome.num_solved = static_cast<std::uint64_t>(times_solved * length);
    outcome.largest_cluster = largest_cluster;
    rule.learn(length, false, outcome);
  }
  return length;
}

// A tenth of the parcels have an event in a window, and a few are solved again. Where more than half are, or
// one cluster has many events, windows stay short: then they cost more than they save.
TEST(WindowLength, FollowsWhatWindowsCost) {
  EXPECT_NEAR(events_learnt(3, 1.0), 10'064.0, 20.0);
  EXPECT_NEAR(events_learnt(6, 1.1), 10'064.0, 20.0);
  EXPECT_LT(events_learnt(3, 2.0), 500.0);
  EXPECT_LT(events_learnt(1'000, 1.0), 500.0);
}

// In a long epoch a fast parcel comes from many rows and columns of cells away.
TEST(Epochs, FastParcelsFromFarAwayAreFound) {
  for (const Boundary boundary : {kWalls, kPeriodic, kOpen}) {
    const auto result = [&](double length) {
      TimelineRun run(exact(gas(150000, 0.2, boundary)), 2);
      run.heat(1000);
      run.timeline.epoch_length().draw = [length] { return length; };
      run.advance(10, 0.1);
      return run.result();
    };
    const Result expected = result(0.5);
    EXPECT_GT(expected.num_collisions, 20000U);
    EXPECT_EQ(result(20.0), expected) << "boundary " << static_cast<int>(boundary);
  }
}

// Length after many epochs of 1000 parcels that have events_of_one events while they are of length 1.
double epoch_length_after(int num_epochs, double events_of_one, bool was_whole = true) {
  EpochLength epochs;
  for (int k = 0; k < num_epochs; ++k) {
    epochs.add_events(static_cast<std::uint64_t>(0.5 * events_of_one * epochs.length()));
    epochs.add_events(static_cast<std::uint64_t>(0.5 * events_of_one * epochs.length()));
    was_whole ? epochs.end(1000) : epochs.drop();
  }
  return epochs.length();
}

TEST(EpochLength, GivesFourEventsForAHundredParcels) {
  EXPECT_NEAR(epoch_length_after(100, 20.0), 2.0, 0.1);
  EXPECT_NEAR(epoch_length_after(1, 20.0), 1.1, 1e-9) << "it changes slowly";
  EXPECT_EQ(epoch_length_after(100, 4.0), 4.0);
  EXPECT_EQ(epoch_length_after(100, 500.0), 1.0);
  EXPECT_EQ(epoch_length_after(100, 20.0, false), 1.0) << "epochs that ended early tell nothing";
}

}  // namespace
}  // namespace pf::test
