// Method `exact` event for event: against the serial reference, and against itself for other steps, requests,
// threads and searches. PF_TEST_SCALE=10 in the environment makes runs of gases in equilibrium ten times as
// long.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "backend/exact/timeline.hpp"
#include "core/error.hpp"
#include "exact/event_match.hpp"
#include "exact/exact_support.hpp"
#include "model/grid.hpp"

namespace pf::test {
namespace {

// ---- comparison with the reference

struct MatchCase {
  const char* name;
  Settings settings;
  double collisions_per_window;  // per parcel
  std::uint32_t steps_per_window;
  int num_windows;
};

void PrintTo(const MatchCase& c, std::ostream* out) { *out << c.name; }

// Adds a ball of 5 parcel radii that spins and has friction.
Settings with_ball(Settings s, double mass_kg = 20.0, double speed_mps = 2.0) {
  s.ball_present = true;
  s.ball_radius_m = 2.5;
  s.ball_mass_kg = mass_kg;
  s.ball_x_m = s.ball_y_m = 0.0;
  s.ball_vx_mps = speed_mps;
  s.ball_spin_radps = 0.5 * speed_mps;
  s.friction = 0.3;
  s.magnus = false;
  return s;
}

Settings court_like(std::int64_t n) {
  Settings s = exact(court(n));
  s.magnus = false;
  s.ball_x_m = -3.0;
  s.contact_clock = 0.0;
  s.ball_mass_kg = 1e4 * s.areal_density_kg_m2 * s.width_m * s.height_m / static_cast<double>(n);
  return s;
}

// With a contact duration that makes a third of the collisions elastic, but no hit of the ball.
Settings court_like_with_clock(std::int64_t n) {
  Settings s = court_like(n);
  s.restitution = 0.5;
  s.contact_clock = 0.2;
  return s;
}

// Returns whether the gas neither cools nor disperses.
bool stays_in_equilibrium(const Settings& s) { return s.restitution == 1.0 && s.boundary != Boundary::open; }

class Events : public testing::TestWithParam<MatchCase> {};

TEST_P(Events, MatchTheReference) {
  const MatchCase& c = GetParam();
  SceneRun run(c.settings, 1);
  MatchPlan plan;
  plan.collisions_per_window = c.collisions_per_window;
  plan.steps_per_window = c.steps_per_window;
  plan.num_windows = c.num_windows * (stays_in_equilibrium(c.settings) ? test_scale() : 1);
  const MatchResult result = match_events(run, plan);
  std::printf(
      "%s: %llu events in %llu windows; lists that differ: %llu near-ties, %llu grazing, %llu at the "
      "window's end, %llu as a consequence; times within %.1e diameters, ball within %.1e\n",
      c.name, static_cast<unsigned long long>(result.num_events),
      static_cast<unsigned long long>(result.num_windows),
      static_cast<unsigned long long>(result.num_near_ties),
      static_cast<unsigned long long>(result.num_grazing), static_cast<unsigned long long>(result.num_at_end),
      static_cast<unsigned long long>(result.num_consequences), result.max_shift, result.max_ball_difference);
  EXPECT_EQ(result.num_unexplained, 0U) << result.first_unexplained;
  EXPECT_GT(result.num_events, 0U);
  EXPECT_LT(result.max_ball_difference, 1e-4);  // as the times: 1e-7, grown by the collisions of a window
  // Rounding decides the order of two events, or whether a pair touches, once in 1e5 events. Each such parcel
  // affects a few others within its window.
  EXPECT_LE(static_cast<double>(result.num_explained()), 6.0 + 1e-3 * static_cast<double>(result.num_events));
}

INSTANTIATE_TEST_SUITE_P(
    Gas, Events,
    testing::Values(
        MatchCase{"2_periodic", exact(gas(2, 0.05, kPeriodic)), 0.5, 1, 400},
        MatchCase{"2_walls", exact(gas(2, 0.2, kWalls)), 0.5, 3, 200},
        MatchCase{"10_dilute_walls", exact(gas(10, 0.05, kWalls)), 0.5, 1, 200},
        MatchCase{"10_dense_walls", exact(gas(10, 0.6, kWalls)), 0.5, 2, 200},
        MatchCase{"10_periodic", exact(gas(10, 0.2, kPeriodic)), 0.5, 1, 200},
        MatchCase{"100_dilute_periodic", exact(gas(100, 0.05, kPeriodic)), 0.5, 1, 200},
        MatchCase{"100_periodic", exact(gas(100, 0.2, kPeriodic)), 0.5, 5, 200},
        MatchCase{"100_dense_periodic", exact(gas(100, 0.6, kPeriodic)), 0.5, 1, 200},
        MatchCase{"100_inelastic_walls", with_restitution(exact(gas(100, 0.2, kWalls)), 0.9), 0.5, 1, 100},
        MatchCase{"100_open", exact(gas(100, 0.2, kOpen)), 0.5, 1, 40},
        MatchCase{"100_clock", with_clock(with_restitution(exact(gas(100, 0.6, kPeriodic)), 0.8), 0.02), 0.5,
                  1, 100},
        MatchCase{"2000_dilute_walls", exact(gas(2000, 0.05, kWalls)), 0.5, 3, 20},
        MatchCase{"2000_dilute_inelastic", with_restitution(exact(gas(2000, 0.05, kPeriodic)), 0.9), 0.5, 3,
                  20},
        MatchCase{"2000_periodic", exact(gas(2000, 0.2, kPeriodic)), 0.5, 1, 40},
        MatchCase{"2000_dense_periodic", exact(gas(2000, 0.6, kPeriodic)), 0.5, 1, 80},
        MatchCase{"2000_dense_walls", with_restitution(exact(gas(2000, 0.6, kWalls)), 0.9), 0.5, 1, 40},
        MatchCase{"2000_open", with_restitution(exact(gas(2000, 0.6, kOpen)), 0.9), 0.5, 1, 40},
        MatchCase{"2000_densest_periodic", exact(gas(2000, 0.69, kPeriodic)), 0.5, 1, 40}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Ball, Events,
    testing::Values(
        MatchCase{"100_walls", with_ball(exact(gas(100, 0.2, kWalls))), 0.5, 1, 200},
        MatchCase{"100_light", with_ball(exact(gas(100, 0.2, kPeriodic)), 2.0), 0.5, 1, 200},
        MatchCase{"100_inelastic_open", with_restitution(with_ball(exact(gas(100, 0.2, kOpen))), 0.9), 0.3, 1,
                  40},
        MatchCase{"100_fast", with_ball(exact(gas(100, 0.05, kWalls)), 1e4, 15.0), 0.3, 2, 100},
        MatchCase{"100_frozen", with_ball(exact(gas(100, 0.1, kPeriodic)), 1e9, 3.0), 0.3, 1, 100},
        MatchCase{"2000_walls", with_ball(exact(gas(2000, 0.6, kWalls))), 0.5, 1, 40},
        MatchCase{"2000_fast_periodic", with_ball(exact(gas(2000, 0.2, kPeriodic)), 200.0, 15.0), 0.3, 1, 40},
        MatchCase{"2000_court", court_like(2000), 0.3, 3, 30},
        MatchCase{"2000_court_clock", court_like_with_clock(2000), 0.3, 3, 30}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

// The radius is too small by 1e-4 of it.
TEST(EventMatch, DetectsAWrongRadius) {
  SceneRun run(exact(gas(100, 0.2, kPeriodic)), 1);
  MatchPlan plan;
  plan.num_windows = 50;
  plan.wrong_radius_m = 0.5 * (1.0 - 1e-4);
  const MatchResult result = match_events(run, plan);
  EXPECT_GT(result.max_shift, 2e-5);
  EXPECT_GT(result.num_unexplained, 0U);
}

// ---- the same events for other steps, requests, threads and searches

struct Hashes {
  std::uint64_t events = 0, state = 0;
  std::uint64_t num_collisions = 0;
  bool operator==(const Hashes&) const = default;
};

void PrintTo(const Hashes& h, std::ostream* out) {
  *out << h.num_collisions << " collisions, events " << h.events << ", state " << h.state;
}

// Runs to end_s in `steps` equal steps, per_request of them at a time (fewer in the last request).
Hashes hashes_of(const Settings& s, double end_s, int steps, int per_request = INT32_MAX,
                 unsigned threads = 1) {
  SceneRun run(s, threads);
  Hashes hashes;
  for (int done = 0; done < steps; done += per_request) {
    const int now = std::min(per_request, steps - done);
    const StepTotals totals = run.advance(static_cast<std::uint32_t>(now), end_s / steps).totals;
    hashes.events += totals.event_hash;
    hashes.num_collisions += totals.num_collisions;
  }
  hashes.state = run.backend->state_hash();
  return hashes;
}

struct InvarianceCase {
  const char* name;
  Settings settings;
};
void PrintTo(const InvarianceCase& c, std::ostream* out) { *out << c.name; }

class SameEvents : public testing::TestWithParam<InvarianceCase> {
 protected:
  const Settings& settings() const { return GetParam().settings; }
  double end_s() const { return 3.5 * test_scale(); }
};

// Steps of 0.01, 0.035, 0.1 and 0.35 diameters per c.
TEST_P(SameEvents, ForAnyStepLength) {
  const Hashes expected = hashes_of(settings(), end_s(), 350 * test_scale());
  EXPECT_GT(expected.num_collisions, 100U);
  for (const int steps : {100, 35, 10})
    EXPECT_EQ(hashes_of(settings(), end_s(), steps * test_scale()), expected) << steps << " steps";
}

TEST_P(SameEvents, ForAnyRequests) {
  const Hashes expected = hashes_of(settings(), end_s(), 50);
  for (const int per_request : {1, 7, 49})
    EXPECT_EQ(hashes_of(settings(), end_s(), 50, per_request), expected);
}

TEST_P(SameEvents, ForAnyNumberOfThreads) {
  const Hashes expected = hashes_of(settings(), end_s(), 25);
  for (const unsigned threads : {2U, 3U})
    EXPECT_EQ(hashes_of(settings(), end_s(), 25, INT32_MAX, threads), expected) << threads << " threads";
}

TEST_P(SameEvents, ForAnyNeighbourSearch) {
  Settings plain = settings();
  plain.neighbors = Neighbors::all_pairs;
  EXPECT_EQ(hashes_of(plain, 0.7, 10), hashes_of(settings(), 0.7, 10));
}

INSTANTIATE_TEST_SUITE_P(
    Exact, SameEvents,
    testing::Values(InvarianceCase{"periodic", exact(gas(1000, 0.2, kPeriodic))},
                    InvarianceCase{"dense_periodic", exact(gas(1000, 0.6, kPeriodic))},
                    InvarianceCase{"dense_walls", with_restitution(exact(gas(1000, 0.6, kWalls)), 0.9)},
                    InvarianceCase{"clock",
                                   with_clock(with_restitution(exact(gas(1000, 0.6, kPeriodic)), 0.8), 0.02)},
                    InvarianceCase{"open", exact(gas(1000, 0.3, kOpen))},
                    InvarianceCase{"ball_walls", with_ball(exact(gas(1000, 0.3, kWalls)))},
                    InvarianceCase{"ball_periodic", with_ball(exact(gas(1000, 0.3, kPeriodic)))}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

// So many that loops over them read memory ahead, to the last, which is one more than a line holds.
TEST(Exact, ThreadsAgreeOnMoreParcelsThanTheCacheHolds) {
  const Settings settings = exact(gas(140001, 0.2, kPeriodic));
  EXPECT_EQ(hashes_of(settings, 0.2, 4, INT32_MAX, 1), hashes_of(settings, 0.2, 4, INT32_MAX, 2));
}

TEST(Exact, ManyParcelsThatPassThroughEachOther) {
  Settings settings = exact(gas(140001, 0.2, kWalls));
  settings.contacts = false;
  EXPECT_EQ(hashes_of(settings, 0.2, 4, INT32_MAX, 1), hashes_of(settings, 0.2, 4, INT32_MAX, 2));
}

// All parcels start with equal speeds. Steps are so long that a collision can slow a parcel and leave one far
// behind, out of its search box, that would have collided with it on its old trajectory.
TEST(Exact, StalePredictionsAreDiscarded) {
  int num_differ = 0;
  for (std::int64_t seed = 1; seed <= 300; ++seed) {
    Settings settings = exact(gas(300, 0.003, Boundary::periodic));
    settings.seed = seed;
    settings.restitution = 0.2;
    const auto hash = [&](std::uint32_t num_steps) {
      SceneRun run(settings, 1);
      ParcelSnapshot start = run.backend->snapshot();
      for (Vec2f& v : start.velocity) v = v * (1.0F / std::sqrt(dot(v, v)));
      run.backend->restore(start);
      return run.advance(num_steps, 17.0 / num_steps).totals.event_hash;
    };
    num_differ += hash(1) != hash(64) ? 1 : 0;
  }
  EXPECT_EQ(num_differ, 0) << "of 300 gases";
}

// If ids equal indices in memory, a collision is hard to tell from a later event with a wall that it
// replaces.
TEST(Exact, ThreadsAgreeWhereIdsEqualIndices) {
  constexpr int kSide = 20;
  const Physics physics = SceneRun(gas(kSide * kSide, 0.28)).physics;
  const World& world = physics.world;
  const GridShape grid = choose_grid(world, kSide * kSide, {2.8 / world.unit_m});  // as method exact
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int num_differ = 0;
  for (int k = 0; k < 1500; ++k) {
    std::vector<Vec2i> start;
    for (int site = 0; site < kSide * kSide; ++site) {
      const double x = (site % kSide + 0.5 + 0.18 * uniform(random)) / kSide - 0.5;
      const double y = (site / kSide + 0.5 + 0.18 * uniform(random)) / kSide - 0.5;
      start.push_back({static_cast<std::int32_t>(2.0 * x * world.half.x),
                       static_cast<std::int32_t>(2.0 * y * world.half.y)});
    }
    std::stable_sort(start.begin(), start.end(),
                     [&](Vec2i a, Vec2i b) { return cell_key(grid, a) < cell_key(grid, b); });
    SortedParcels parcels;
    parcels.resize(start.size());
    for (std::uint32_t i = 0; i < start.size(); ++i) {
      const double angle = kPi * uniform(random);
      parcels.current.position[i] = start[i];
      parcels.current.velocity[i] = to_float({std::cos(angle), std::sin(angle)});
      parcels.current.id[i] = i;
    }
    const auto hash = [&](unsigned num_threads) {
      SortedParcels now = parcels;
      ThreadTeam team(num_threads);
      ExactTimeline timeline(team);
      timeline.enter(physics, 0.0, now);
      StepRequest request;
      request.method = Method::exact;
      request.num_steps = 1;
      request.dt_s = 0.7;
      BallState ball;
      StepReport report;
      timeline.advance(physics, request, now, ball, report);
      return report.totals.event_hash;
    };
    num_differ += hash(1) != hash(2) ? 1 : 0;
  }
  EXPECT_EQ(num_differ, 0) << "of 1500 gases";
}

// A gas that has cooled to a thousandth of its speed has longer ticks. Events and state are the same for all
// steps.
TEST(Exact, TicksGrowAsTheGasCoolsForAnyStepLength) {
  for (const double clock_s : {0.0, 0.02}) {
    const Settings cooling = with_clock(with_restitution(exact(gas(200, 0.25, kPeriodic)), 0.6), clock_s);
    const double end_s = 4e5;
    SceneRun run(cooling, 1);
    run.advance(1, end_s);
    EXPECT_LT(run.backend->measure().parcel_energy_j / 200.0, 1e-6);
    const Hashes expected = hashes_of(cooling, end_s, 1);
    for (const int steps : {7, 1000})
      EXPECT_EQ(hashes_of(cooling, end_s, steps), expected) << steps << " steps";
    EXPECT_EQ(hashes_of(cooling, end_s, 30, 4, 2), expected);
  }
}

TEST(Exact, RejectsTimesBeyondTheLimit) {
  SceneRun run(exact(gas(2, 0.01, kPeriodic)), 1);
  EXPECT_THROW(run.advance(1, 1e18), UserError);
  EXPECT_EQ(run.advance(1, 1e-3).totals.num_steps, 1U);  // the run goes on
}

// A ball that is set in motion in a cold gas makes ticks shorter again: nothing overlaps.
TEST(Exact, ABallSetInMotionShortensTicks) {
  Settings s = with_ball(exact(gas(200, 0.25, kPeriodic)), 20.0, 0.0);
  s.restitution = 0.6;
  s.friction = 0.0;
  SceneRun run(s, 1);
  run.advance(1, 4e5);
  const double cold = run.backend->measure().energy_j();
  EXPECT_LT(cold / 200.0, 1e-5);
  BallState ball = run.ball;
  ball.velocity_mps = {1.0, 0.3};
  run.backend->set_ball(ball);
  const StepTotals totals = run.advance(40, 0.5).totals;
  EXPECT_GT(totals.num_ball_hits, 10U);
  const double diameter_units = 2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m;
  EXPECT_LT(totals.max_overlap_diameters * diameter_units, 5.0);
}

}  // namespace
}  // namespace pf::test
