// Force and torque of a stream of parcels on a held ball, against the closed forms of free-molecular flow
// (Schaaf and Chambre 1961, in two dimensions; Weidman and Herczynski 2004 for the transverse force).
//
// Parcels do not collide with each other, and the world is periodic. A run ends before a reflected parcel, or
// the gap that it left, can cross the edge and reach the ball again. The ball is therefore in undisturbed gas
// from the start.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>

#include "lab/free_stream.hpp"
#include "model/ball.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr double kSide = 10.0;
constexpr double kBallRadius = 2.0;

// Sums over several runs, in units of parcel mass and m/s.
struct Push {
  double hits = 0.0;
  Vec2d impulse;
  double torque = 0.0;      // impulse of the torque, m^2/s
  double density_m2 = 0.0;  // parcels per area
  double seconds = 0.0;     // of all runs together
  double contact_m = 0.0;   // ball plus parcel radius

  double hit_rate_over(double speed_mps) const {
    return hits / (2.0 * contact_m * density_m2 * speed_mps * seconds);
  }
  double drag_coefficient(double speed_mps) const {
    return impulse.x / (density_m2 * speed_mps * speed_mps * contact_m * seconds);
  }
};

Settings tunnel(const FreeStream& stream, std::int64_t seed) {
  Settings s = free_stream_settings(stream, kSide, kBallRadius, 1000000);
  s.area_fraction = 0.01;
  s.parcel_speed_mps = stream.thermal_mps;
  s.flow_x_mps = stream.speed_mps;
  s.seed = seed;
  return s;
}

// Parcels per area away from the ball: parcels per lattice site over the area of a site.
double spawned_density(const SceneRun& run) {
  const Spawner spawner(run.settings, run.physics, run.ball);
  const SpawnPlan& plan = spawner.plan();
  return plan.num_parcels /
         (static_cast<double>(plan.row_start[plan.num_rows]) * plan.spacing_x_m * plan.spacing_y_m);
}

// The run's length assumes that parcels are at most 4.5 thermal speeds faster than the stream; one in 25,000
// is faster, and hardly any of these returns. The first of 16 steps does not count: parcels next to the ball
// start on a lattice with a hole, not at random.
Push push(const FreeStream& stream, int num_runs) {
  const double fastest_mps = stream.speed_mps + 4.5 * stream.thermal_mps;
  constexpr int kSteps = 16;
  const double dt = (kSide - 2.0 * kBallRadius) / fastest_mps / kSteps;
  Push sum;
  for (int k = 0; k < num_runs; ++k) {
    SceneRun run(tunnel(stream, 1 + k));
    run.advance(1, dt);
    const StepTotals totals = run.advance(kSteps - 1, dt).totals;
    sum.hits += static_cast<double>(totals.num_ball_hits);
    sum.impulse += totals.ball_impulse_kg_mps;
    sum.torque += totals.ball_torque_impulse_kg_m2ps;
    sum.seconds += (kSteps - 1) * dt;
    sum.density_m2 = spawned_density(run);
    sum.contact_m = kBallRadius + run.physics.parcels.radius_m;
  }
  return sum;
}

struct SpeedRatio {
  double s;                 // stream over sqrt(2) thermal speeds
  double drag_coefficient;  // specular
  double collision_factor;  // hit rate over 2 (R + r) n V
};

void PrintTo(const SpeedRatio& ratio, std::ostream* out) { *out << "S = " << ratio.s; }

class Tunnel : public testing::TestWithParam<SpeedRatio> {};

// Four runs give 2.8e5 (S = 0.5) to 6.4e5 (S = 5) hits: the rate has an error of 0.19 % to 0.13 %. The
// impulse of a hit scatters by 1.6 times its mean at S = 0.5, by 0.5 at S = 5: the drag has an error of at
// most 0.30 %. 0.5 % and 1 % are more than two standard errors of independent hits. Hits from a lattice
// scatter less.
TEST_P(Tunnel, HitRateAndDragFollowFreeMolecularFlow) {
  const auto [s, drag, factor] = GetParam();
  const double speed = s * std::sqrt(2.0);
  const Push measured = push({.speed_mps = speed}, 4);
  EXPECT_GT(measured.hits, 2e5);
  EXPECT_NEAR(measured.hit_rate_over(speed) / factor, 1.0, 0.005);
  EXPECT_NEAR(measured.drag_coefficient(speed) / drag, 1.0, 0.01);
  RecordProperty("hit_rate", std::to_string(measured.hit_rate_over(speed)));
  RecordProperty("drag", std::to_string(measured.drag_coefficient(speed)));
}

INSTANTIATE_TEST_SUITE_P(SpeedRatios, Tunnel,
                         testing::Values(SpeedRatio{0.5, 7.52398, 1.98736}, SpeedRatio{2.0, 3.14966, 1.06508},
                                         SpeedRatio{5.0, 2.74626, 1.01005}));

struct ColdCase {
  double restitution, friction;
};

void PrintTo(const ColdCase& cold, std::ostream* out) {
  *out << "e = " << cold.restitution << ", mu = " << cold.friction;
}

class ColdStream : public testing::TestWithParam<ColdCase> {};

// Without thermal motion. The 2.6e5 parcels that hit start on a lattice, displaced by less than half its
// spacing. Their number is random only along the edge of their starting area, about 4,000 sites long: 60
// hits, 0.02 %. The test allows five of these.
TEST_P(ColdStream, DragFollowsTheClosedForm) {
  const auto [e, mu] = GetParam();
  const double expected = cold_drag_coefficient(e, mu);
  const Push measured = push({.speed_mps = 1.0, .thermal_mps = 0.0, .restitution = e, .friction = mu}, 1);
  EXPECT_GT(measured.hits, 2e5);
  EXPECT_NEAR(measured.drag_coefficient(1.0) / expected, 1.0, 0.001);
  RecordProperty("drag", std::to_string(measured.drag_coefficient(1.0)));
  RecordProperty("expected", std::to_string(expected));
}

INSTANTIATE_TEST_SUITE_P(Cases, ColdStream,
                         testing::Values(ColdCase{1.0, 0.0}, ColdCase{1.0, 0.3}, ColdCase{0.8, 0.3},
                                         ColdCase{1.0, 1.0}));

// A smooth ball takes 1 + e of each hit's normal momentum, and no parcel hits twice. The same hits therefore
// give impulses in the ratio (1 + e) / 2. Each is rounded by at most half a unit of 2^-32 of the reference
// speed (2.8 to 4 m/s): 5e-10 m/s per hit, of a mean of at least 2 m/s.
TEST(Tunnel, RestitutionScalesTheDrag) {
  const double speed = 2.0 * std::sqrt(2.0);
  const Push elastic = push({.speed_mps = speed}, 1);
  for (const double e : {0.0, 0.5, 0.9}) {
    const Push lossy = push({.speed_mps = speed, .restitution = e}, 1);
    EXPECT_EQ(lossy.hits, elastic.hits);
    EXPECT_NEAR(lossy.impulse.x / elastic.impulse.x, 0.5 * (1.0 + e), 1e-9);
  }
}

// Without friction the spin has no effect at all.
TEST(Tunnel, SmoothBallFeelsNeitherTorqueNorSpin) {
  const double speed = 2.0 * std::sqrt(2.0);
  const Push still = push({.speed_mps = speed}, 1);
  const Push spinning = push({.speed_mps = speed, .spin_radps = 0.5}, 1);
  EXPECT_EQ(still.torque, 0.0);
  EXPECT_EQ(spinning.torque, 0.0);
  EXPECT_EQ(spinning.hits, still.hits);
  EXPECT_NEAR(spinning.impulse.x, still.impulse.x, 1e-9 * still.hits);  // the unit follows the spin
  EXPECT_NEAR(spinning.impulse.y, still.impulse.y, 1e-9 * still.hits);
}

// Each hit stops all slip (mu = 100; exceptions are hits that graze by less than 1/200 of the slip). The
// torque is -omega R^2 per parcel mass and hit. The transverse force is 1/2 rho pi R_c R omega V, to the
// right of the stream for counter-clockwise spin, at any speed ratio. At a rim speed of 2 thermal speeds and
// 1e5 hits the slip scatters by 1 to 2.2 m/s (the stream's share), the torque by 0.4 %. The transverse
// impulse scatters by 3 m/s around a mean of 1.5, the force by 0.7 %. The test allows four and five standard
// errors.
TEST(Tunnel, RoughSpinningBallFollowsTorqueAndTransverseForceLaws) {
  const double spin = 1.0;
  const double rim = spin * kBallRadius;
  for (const double s : {0.5, 2.0}) {
    const double speed = s * std::sqrt(2.0);
    const Push rough = push({.speed_mps = speed, .friction = 100.0, .spin_radps = spin}, 2);
    EXPECT_GT(rough.hits, 1e5);
    EXPECT_NEAR(rough.torque / (rough.hits * kBallRadius * rim), -1.0, 0.016) << "S = " << s;
    const double across = 0.5 * kPi * rough.density_m2 * rough.contact_m * rim * speed * rough.seconds;
    EXPECT_NEAR(std::fabs(rough.impulse.y) / across, 1.0, 0.035) << "S = " << s;
    EXPECT_GT(rough.impulse.y, 0.0) << "opposite to the Magnus force";
    RecordProperty("torque_" + std::to_string(s),
                   std::to_string(rough.torque / (rough.hits * kBallRadius * rim)));
    RecordProperty("across_" + std::to_string(s), std::to_string(rough.impulse.y / across));
  }
}

}  // namespace
}  // namespace pf::test
