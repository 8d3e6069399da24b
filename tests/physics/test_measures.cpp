// Measured and expected properties of a gas: closed forms against their definitions. Also the world's units.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "model/kinetic_theory.hpp"
#include "model/measures.hpp"
#include "model/world.hpp"

namespace pf {
namespace {

// Simpson's rule with 2,000 intervals.
double integral(const std::function<double(double)>& f, double from, double to) {
  constexpr int kIntervals = 2000;
  const double h = (to - from) / kIntervals;
  double sum = f(from) + f(to);
  for (int k = 1; k < kIntervals; ++k) sum += f(from + k * h) * (k % 2 == 1 ? 4.0 : 2.0);
  return sum * h / 3.0;
}

// Density of relative speeds in a Maxwellian gas, c = 1 m/s: each component has a variance of 2. Less than
// 1e-40 lies beyond 20 m/s.
double relative_speed_density(double v) { return 0.5 * v * std::exp(-0.25 * v * v); }

double mean_over_relative_speeds(const std::function<double(double)>& f) {
  return integral([&](double v) { return f(v) * relative_speed_density(v); }, 0.0, 20.0);
}

// A parcel sweeps 4 r times its relative speed per second; each parcel in that area is one collision.
// Simpson's rule is off by less than 1e-9 here.
TEST(Measures, RateOfADiluteGasFollowsFromTheSweptArea) {
  const double area_fraction = 1e-10, radius_m = 0.3, speed_mps = 2.0;
  const double density = area_fraction / (kPi * radius_m * radius_m);
  const double swept = 4.0 * radius_m * speed_mps * mean_over_relative_speeds([](double v) { return v; });
  EXPECT_NEAR(enskog_rate_per_s(area_fraction, speed_mps, radius_m) / (swept * density), 1.0, 1e-8);
}

// The third virial coefficient of hard discs is 4/3 - sqrt(3)/pi of the second's square (Tonks 1936). The
// contact value is therefore 1 + (8/3 - 2 sqrt(3)/pi) eta + ..., a slope of 1.564. Henderson's 25/16 is 0.1 %
// below, and eta^2 adds 1e-3 here.
TEST(Measures, ContactValueStartsWithTheThirdVirialCoefficient) {
  const double slope = (contact_value(1e-3) - 1.0) / 1e-3;
  EXPECT_NEAR(slope, 8.0 / 3.0 - 2.0 * std::sqrt(3.0) / kPi, 4e-3);
}

// A chord of the contact circle shorter than a step may lie between two ends of steps.
TEST(Measures, MissedShareIsTheMeanOverImpactParameters) {
  for (const double step : {1e-4, 0.01, 0.5, 1.5, 1.9999, 2.0, 7.0}) {
    const double first = step < 2.0 ? std::acos(0.5 * step) : 0.0;  // b = sin(angle): chords below the step
    const double mean =
        integral([&](double angle) { return (1.0 - 2.0 * std::cos(angle) / step) * std::cos(angle); }, first,
                 0.5 * kPi);
    EXPECT_NEAR(missed_fraction(step) / mean, 1.0, 1e-6) << step;
  }
}

// The number of collisions is proportional to the relative speed, and short steps miss a share that grows as
// its square.
TEST(Measures, MissedShareOfAGasIsTheMeanOverItsCollisions) {
  const double dt_s = 1e-5;
  const double weight = mean_over_relative_speeds([](double v) { return v; });
  const double missed =
      mean_over_relative_speeds([&](double v) { return v * missed_fraction(v * dt_s / 0.5); });
  EXPECT_NEAR(missed_fraction_of_gas(1.0, dt_s, 0.5) / (missed / weight), 1.0, 1e-6);
}

TEST(Measures, BallEnergyIsOfFlightAndSpin) {
  BallConstants ball;
  ball.mass_kg = 2.0;
  ball.inertia_kg_m2 = 0.5;
  Measures sum;
  sum.momentum_kg_mps = {1.0, 1.0};
  add_ball(ball, {{7.0, 7.0}, {3.0, -4.0}, 6.0, 0.0}, sum);
  EXPECT_DOUBLE_EQ(sum.ball_energy_j, 0.5 * 2.0 * 25.0 + 0.5 * 0.5 * 36.0);
  EXPECT_EQ(sum.momentum_kg_mps, (Vec2d{7.0, -7.0}));
  EXPECT_EQ(sum.ball_momentum_kg_mps, (Vec2d{6.0, -8.0}));
  EXPECT_EQ(sum.momentum_scale_kg_mps, 10.0);
  ball.exists = false;
  add_ball(ball, {{7.0, 7.0}, {3.0, -4.0}, 6.0, 0.0}, sum);
  EXPECT_EQ(sum.momentum_kg_mps, (Vec2d{7.0, -7.0}));
}

// 100 parcels of 0.5 kg with c = 3 m/s in a stream of (8, -6) m/s, and a ball against it.
TEST(Measures, ThermalSpeedIsRelativeToTheMeanOfTheParcels) {
  ParcelConstants parcels;
  parcels.num = 100;
  parcels.mass_kg = 0.5;
  Measures sum;
  sum.parcel_energy_j = 50.0 * (9.0 + 0.5 * 100.0);
  sum.momentum_kg_mps = {400.0 - 30.0, -300.0};
  sum.ball_momentum_kg_mps = {-30.0, 0.0};
  EXPECT_DOUBLE_EQ(thermal_speed_mps(parcels, sum), 3.0);
  sum.parcel_energy_j = 50.0 * 0.5 * 100.0 * (1.0 - 1e-15);
  EXPECT_EQ(thermal_speed_mps(parcels, sum), 0.0);
  parcels.num = 0;
  EXPECT_TRUE(std::isnan(thermal_speed_mps(parcels, sum)));
}

// The unit is 2^-31 of the larger side. Positions in metres are off by half a unit.
TEST(World, SpansItsSidesAndResolvesItsUnit) {
  for (const Vec2d size : {Vec2d{13.4, 6.1}, Vec2d{2.0, 30.0}, Vec2d{1e-6, 1e-6}}) {
    const World world = make_world(size.x, size.y, Boundary::open);
    const double larger = std::fmax(size.x, size.y);
    EXPECT_EQ(world.unit_m, larger * 0x1p-31);
    EXPECT_NEAR(to_metres(world, world.half).x, 0.5 * size.x, 0.51 * world.unit_m);
    EXPECT_NEAR(to_metres(world, world.half).y, 0.5 * size.y, 0.51 * world.unit_m);
    const Vec2d position{0.3 * size.x, -0.49 * size.y};
    const Vec2d rounded = to_metres(world, to_units(world, position));
    EXPECT_NEAR(rounded.x, position.x, 0.51 * world.unit_m);
    EXPECT_NEAR(rounded.y, position.y, 0.51 * world.unit_m);
  }
}

// A parcel's term of the hash contains every bit of its state.
TEST(StateHash, DependsOnEveryComponent) {
  const std::uint64_t hash = parcel_hash(3, {5, -7}, {1.5F, -0.25F});
  EXPECT_NE(parcel_hash(2, {5, -7}, {1.5F, -0.25F}), hash);
  EXPECT_NE(parcel_hash(3, {4, -7}, {1.5F, -0.25F}), hash);
  EXPECT_NE(parcel_hash(3, {5, -8}, {1.5F, -0.25F}), hash);
  EXPECT_NE(parcel_hash(3, {5, -7}, {1.5000001F, -0.25F}), hash);
  EXPECT_NE(parcel_hash(3, {5, -7}, {1.5F, -0.25000003F}), hash);
  const BallState ball{{1.0, 2.0}, {3.0, 4.0}, 5.0, 0.0};
  for (int k = 0; k < 5; ++k) {
    BallState other = ball;
    double* fields[] = {&other.position_m.x, &other.position_m.y, &other.velocity_mps.x,
                        &other.velocity_mps.y, &other.spin_radps};
    *fields[k] = std::nextafter(*fields[k], 0.0);
    EXPECT_NE(ball_hash(other), ball_hash(ball)) << k;
  }
}

}  // namespace
}  // namespace pf
