// The fast loop over the parcels against the plain one: the same states and tallies, to the bit.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "backend/cpu_backend.hpp"
#include "model/methods.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

struct LoopCase {
  std::string name;
  Settings settings;
  double dt_s;
};

Settings with_ball(Settings s, double radius_m) {
  add_resting_ball(s, 50.0, radius_m);
  s.ball_vx_mps = 4.0;
  s.ball_vy_mps = 1.5;
  s.ball_spin_radps = 3.0;
  return s;
}

void add_cases(Boundary boundary, Method method, std::vector<LoopCase>& cases) {
  const std::string kind = std::to_string(static_cast<int>(boundary)) + " " + method_name(method);
  const double scale = method == Method::spring ? 0.1 : 1.0;  // keeps springs stable
  const auto add = [&](const std::string& name, Settings s, double dt_s) {
    s.method = method;
    cases.push_back({name + " " + kind, s, dt_s * scale});
  };
  for (const double area_fraction : {0.02, 0.2, 0.6}) {
    const Settings s = gas(3000, area_fraction, boundary);
    add("gas " + std::to_string(area_fraction), s, 0.035);
    add("with ball " + std::to_string(area_fraction), with_ball(s, 4.0), 0.035);
  }
  for (const std::int64_t n : {1, 2, 5, 12, 40}) add(std::to_string(n), gas(n, 0.15, boundary), 0.05);
  Settings lossy = gas(2000, 0.4, boundary);
  lossy.restitution = 0.3;
  add("lossy", lossy, 0.02);
  add("far in one step", gas(2000, 0.1, boundary), 3.0);
  Settings no_contacts = with_ball(gas(2000, 0.2, boundary), 3.0);
  no_contacts.contacts = false;
  add("without contacts", no_contacts, 0.05);
}

std::vector<LoopCase> loop_cases() {
  std::vector<LoopCase> list;
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const Method method : {Method::impulse, Method::spring}) add_cases(boundary, method, list);
  }
  return list;
}

SceneRun run_of(const Settings& settings, unsigned num_threads, bool is_plain) {
  auto backend = std::make_unique<CpuBackend>(num_threads);
  if (is_plain) backend->use_plain_loop();
  return {settings, std::move(backend)};
}

void expect_same(const StepTotals& fast, const StepTotals& plain) {
  EXPECT_EQ(fast.num_collisions, plain.num_collisions);
  EXPECT_EQ(fast.num_ball_hits, plain.num_ball_hits);
  EXPECT_EQ(fast.num_retired, plain.num_retired);
  EXPECT_EQ(fast.num_invalid, plain.num_invalid);
  EXPECT_EQ(fast.first_invalid_id, plain.first_invalid_id);
  EXPECT_EQ(fast.impulse_sum_mps, plain.impulse_sum_mps);
  EXPECT_EQ(fast.max_overlap_diameters, plain.max_overlap_diameters);
  EXPECT_EQ(fast.ball_torque_impulse_kg_m2ps, plain.ball_torque_impulse_kg_m2ps);
}

TEST(PairedLoop, EqualsThePlainLoop) {
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  std::uint64_t num_hits = 0, num_retired = 0;
  for (const LoopCase& c : loop_cases()) {
    SCOPED_TRACE(c.name);
    SceneRun plain = run_of(c.settings, 1, true);
    SceneRun one = run_of(c.settings, 1, false), three = run_of(c.settings, 3, false),
             seven = run_of(c.settings, 7, false);
    for (int request = 0; request < 4; ++request) {
      const StepTotals expected = plain.advance(25, c.dt_s).totals;
      expect_same(one.advance(25, c.dt_s).totals, expected);
      expect_same(three.advance(25, c.dt_s).totals, expected);
      expect_same(seven.advance(25, c.dt_s).totals, expected);
      ASSERT_EQ(one.backend->state_hash(), plain.backend->state_hash());
      ASSERT_EQ(three.backend->state_hash(), plain.backend->state_hash());
      ASSERT_EQ(seven.backend->state_hash(), plain.backend->state_hash());
      num_hits += expected.num_ball_hits;
      num_retired += expected.num_retired;
    }
  }
  EXPECT_GT(num_hits, 300U);
  EXPECT_GT(num_retired, 1000U);
}

// Eight shares for two threads, twelve for three, which take them from each other. Of fewer parcels, which
// the same backend gets next, each thread has one share.
TEST(PairedLoop, MoreSharesThanThreadsEqualThePlainLoop) {
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const Method method : {Method::impulse, Method::spring}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(boundary)) + " " + method_name(method));
      const double dt_s = method == Method::spring ? 0.004 : 0.04;
      SceneRun plain = run_of(gas(10, 0.2, boundary), 1, true),
               two = run_of(gas(10, 0.2, boundary), 2, false),
               three = run_of(gas(10, 0.2, boundary), 3, false);
      for (const std::int64_t num : {20'000, 2'000, 26'000}) {
        Settings settings = with_ball(gas(num, num == 26'000 ? 0.5 : 0.2, boundary), 4.0);
        settings.method = method;
        for (SceneRun* run : {&plain, &two, &three}) *run = SceneRun(settings, std::move(run->backend));
        const StepTotals expected = plain.advance(30, dt_s).totals;
        expect_same(two.advance(30, dt_s).totals, expected);
        expect_same(three.advance(30, dt_s).totals, expected);
        ASSERT_EQ(two.backend->state_hash(), plain.backend->state_hash()) << num;
        ASSERT_EQ(three.backend->state_hash(), plain.backend->state_hash()) << num;
      }
    }
  }
}

// In a hundredth of the width of the world: hundreds of candidates for each parcel.
TEST(PairedLoop, CrowdsEqualThePlainLoop) {
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  for (const Boundary boundary : {Boundary::walls, Boundary::periodic}) {
    const Settings settings = gas(1500, 0.0001, boundary);
    SceneRun plain = run_of(settings, 1, true), one = run_of(settings, 1, false),
             three = run_of(settings, 3, false);
    ParcelSnapshot crowd = plain.backend->snapshot();
    for (std::size_t i = 0; i < 1400; ++i)
      crowd.position[i] = {crowd.position[i].x / 100, crowd.position[i].y / 100};
    for (SceneRun* run : {&plain, &one, &three}) run->backend->restore(crowd);
    for (int request = 0; request < 4; ++request) {
      const StepTotals expected = plain.advance(5, 0.02).totals;
      EXPECT_GT(expected.num_collisions, 200U);
      expect_same(one.advance(5, 0.02).totals, expected);
      expect_same(three.advance(5, 0.02).totals, expected);
      ASSERT_EQ(one.backend->state_hash(), plain.backend->state_hash());
      ASSERT_EQ(three.backend->state_hash(), plain.backend->state_hash());
    }
  }
}

// Pairs half a period apart, within contact distance: each sees the other on the same side.
TEST(PairedLoop, PairsHalfAWorldApartEqualThePlainLoop) {
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  const auto flown = [&](unsigned num_threads, bool is_plain) {
    SceneRun run = run_of(gas(60, 0.2, Boundary::periodic), num_threads, is_plain);
    const Vec2i half = run.physics.world.half;
    Physics physics = run.physics;
    physics.parcels.radius_m = 0.6 * half.y * physics.world.unit_m;
    run.backend->set_physics(physics);
    ParcelSnapshot state = run.backend->snapshot();
    for (std::size_t i = 0; i < state.position.size(); i += 2) {
      state.position[i].y = 0;
      state.position[i + 1] = {state.position[i].x, -half.y};
    }
    run.backend->restore(state);
    run.advance(3, 1e-3);
    return run.backend->state_hash();
  };
  EXPECT_EQ(flown(1, false), flown(1, true));
  EXPECT_EQ(flown(3, false), flown(1, true));
}

// Between requests contacts are switched off and on, discs shrink and grow, and one request searches all
// pairs: nothing that is kept from the last step may be used.
TEST(PairedLoop, ChangesBetweenRequestsAreNoticed) {
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  const Settings settings = gas(1000, 0.3);
  const auto flown = [&](unsigned num_threads, bool is_plain) {
    SceneRun run = run_of(settings, num_threads, is_plain);
    std::vector<std::uint64_t> hashes;
    for (int request = 0; request < 60; ++request) {
      Physics physics = run.physics;
      physics.parcels.contacts = request % 3 != 1;
      physics.parcels.radius_m *= request % 4 == 3 ? 0.7 : 1.0;
      run.backend->set_physics(physics);
      run.settings.neighbors = request % 5 == 2 ? Neighbors::all_pairs : Neighbors::grid;
      run.advance(1, 0.03);
      hashes.push_back(run.backend->state_hash());
    }
    return hashes;
  };
  const std::vector<std::uint64_t> expected = flown(1, true);
  EXPECT_EQ(flown(1, false), expected);
  EXPECT_EQ(flown(3, false), expected);
}

// Contact distances from 3 units to half of the world. Rounding must lose no pair, and add few.
TEST(RoughPositions, NoContactIsMissed) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * kPi), place(-0x1p30, 0x1p30);
  for (double contact_distance = 3.0; contact_distance < 0x1p30; contact_distance *= 1.37) {
    StepConstants c;
    c.filter_distance2 = static_cast<float>(contact_distance * contact_distance * (1.0 + 1e-5));
    const RoughScale scale(c);
    const auto looks_near = [&](double distance) {
      const double turn = angle(random);
      const Vec2d from{place(random), place(random)};
      const Vec2d to = from + Vec2d{std::cos(turn), std::sin(turn)} * distance;
      const auto at = [&](Vec2d p) {
        return scale(
            {static_cast<std::int32_t>(std::floor(p.x)), static_cast<std::int32_t>(std::floor(p.y))});
      };
      const std::uint32_t a = at(from), b = at(to);
      const auto x = static_cast<std::int16_t>(b - a), y = static_cast<std::int16_t>((b >> 16) - (a >> 16));
      return x * x + y * y < scale.limit();
    };
    for (int k = 0; k < 3000; ++k) {
      ASSERT_TRUE(looks_near(std::max(contact_distance - 1.5, 0.0))) << contact_distance;
      ASSERT_FALSE(looks_near(contact_distance * 1.002 + 4.0)) << contact_distance;
    }
  }
}

// Velocities that no step can follow: not a number, infinite, the largest float, and one of a world in a
// step. Negative zeros and the smallest numbers must round alike.
TEST(PairedLoop, OddVelocitiesAreTreatedAlike) {
  if (!PairedLoop::is_supported()) GTEST_SKIP() << "this processor lacks AVX2";
  const Settings settings = gas(64, 0.05, Boundary::periodic);
  const auto flown = [&](bool is_plain) {
    SceneRun run = run_of(settings, 1, is_plain);
    ParcelSnapshot snapshot = run.backend->snapshot();
    using Limits = std::numeric_limits<float>;
    const float odd[] = {Limits::quiet_NaN(),
                         Limits::infinity(),
                         -Limits::infinity(),
                         Limits::max(),
                         1e15F,
                         -0.0F,
                         Limits::denorm_min(),
                         -Limits::denorm_min(),
                         1e-30F,
                         800.0F,
                         -700.0F};
    for (std::size_t k = 0; k < std::size(odd); ++k) {
      snapshot.velocity[5 * k + 1].x = odd[k];
      snapshot.velocity[5 * k + 2] = {0.0F, odd[k]};
      snapshot.velocity[5 * k + 3] = {odd[k], odd[k]};
    }
    run.backend->restore(snapshot);
    const StepTotals totals = run.advance(2, 0.035).totals;
    return std::tuple(run.backend->state_hash(), totals.num_invalid, totals.first_invalid_id);
  };
  EXPECT_EQ(flown(false), flown(true));
  EXPECT_GT(std::get<1>(flown(false)), 9U);
}

}  // namespace
}  // namespace pf::test
