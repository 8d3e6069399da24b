// The fast loop over the parcels against the plain one: the same states and tallies, to the bit.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "backend/cpu_backend.hpp"
#include "model/methods.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

struct Case {
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

void add_cases(Boundary boundary, Method method, std::vector<Case>& cases) {
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

std::vector<Case> cases() {
  std::vector<Case> list;
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
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    SceneRun plain = run_of(c.settings, 1, true);
    SceneRun one = run_of(c.settings, 1, false), three = run_of(c.settings, 3, false);
    for (int request = 0; request < 4; ++request) {
      const StepTotals expected = plain.advance(25, c.dt_s).totals;
      expect_same(one.advance(25, c.dt_s).totals, expected);
      expect_same(three.advance(25, c.dt_s).totals, expected);
      ASSERT_EQ(one.backend->state_hash(), plain.backend->state_hash());
      ASSERT_EQ(three.backend->state_hash(), plain.backend->state_hash());
      num_hits += expected.num_ball_hits;
      num_retired += expected.num_retired;
    }
  }
  EXPECT_GT(num_hits, 300U);
  EXPECT_GT(num_retired, 1000U);
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
