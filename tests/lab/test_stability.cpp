// The lab's breaking points against theory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/scene_run.hpp"
#include "lab/gas_case.hpp"
#include "lab/stability_cases.hpp"
#include "lab/theory.hpp"
#include "model/kinetic_theory.hpp"

namespace pf::test {
namespace {

std::unique_ptr<Backend> cpu() { return make_cpu_backend(1); }

// The test allows four binomial standard errors. `impulse` acts on the first half of the chord, as if steps
// were twice as long.
TEST(Stability, ImpulseMissesTheShareOfTheory) {
  for (const double step : {0.2, 1.0, 3.0}) {
    const Share share = missed_share(Method::impulse, step, cpu());
    EXPECT_NEAR(share.value, missed_fraction(2.0 * step), 4.0 * share.sigma) << step;
  }
  EXPECT_NEAR(missed_fraction(0.2), 0.1 * 0.1 / 6.0, 2e-5) << "Delta^2 / 6 at Delta = 0.1";
  EXPECT_EQ(missed_share(Method::exact, 3.0, cpu()).value, 0.0);
}

// Four discs in a row. Each overlaps its neighbours, the outer two across the periodic edge, so that contacts
// last. Neighbours start towards each other. Two springs act on each disc: that mode has omega = sqrt(2)
// omega_0. Returns the largest kinetic energy over the first.
double pressed_row_growth(double omega_dt, int num_steps) {
  constexpr double kContact = 0.01, kSpacing = 0.99;
  constexpr float kStart = 0.01F;  // moves discs by 0.03 of the overlap: contacts stay closed
  Settings s = unit_gas(4, 0.1, Boundary::periodic);
  s.box_follows_parcels = false;
  s.width_m = s.height_m = 4.0 * kSpacing;
  s.method = Method::spring;
  s.spring_contact_s = kContact;
  SceneRun run(s, cpu());
  ParcelSnapshot row;
  for (int k = 0; k < 4; ++k) {
    row.position.push_back(to_units(run.physics.world, {(k - 1.5) * kSpacing, 0.0}));
    row.velocity.push_back({k % 2 == 0 ? kStart : -kStart, 0.0F});
  }
  run.backend->restore(row);
  const double before = run.backend->measure().parcel_energy_j;
  const double dt = omega_dt * kContact / (kPi * std::sqrt(2.0));
  double max_energy = 0.0;
  for (int k = 0; k < num_steps; ++k) {
    run.advance(1, dt);
    max_energy = std::max(max_energy, run.backend->measure().parcel_energy_j);
  }
  return max_energy / before;
}

// Semi-implicit steps of an oscillator keep v^2 + (omega x)^2 - omega dt v (omega x). From x = 0 the kinetic
// energy therefore grows at most by 1 / (1 - (omega dt / 2)^2). From dt = 2 / omega on the form is no longer
// definite, and the energy grows without bound. One percent below the limit the factor is 50.3, reached to 2
// % in 400 phases; one percent above it the velocity grows by 1.33 per step.
TEST(Stability, SpringBlowsUpBeyondTwoOverOmega) {
  EXPECT_NEAR(pressed_row_growth(0.6 * 2.0, 400), 1.0 / (1.0 - 0.6 * 0.6), 0.02);
  EXPECT_NEAR(pressed_row_growth(0.99 * 2.0, 400), 1.0 / (1.0 - 0.99 * 0.99), 1.0);
  EXPECT_GT(pressed_row_growth(1.01 * 2.0, 100), 1e4);
}

// A pair separates at the end of a step. Well below the limit its energy is therefore off by (w0 dt)^2 / 12,
// 0.8 % at 0.1 t_c. The limit is 2 t_c / pi.
TEST(Stability, SpringPairGainsEnergyInLongSteps) {
  constexpr double kLimit = 2.0 / kPi;
  EXPECT_NEAR(spring_pair_energy(0.1, cpu()), 1.0, 0.01);
  EXPECT_LT(spring_pair_energy(0.5 * kLimit, cpu()), 1.1);
  EXPECT_GT(spring_pair_energy(1.5 * kLimit, cpu()), 5.0);
}

// The tolerance is the rounding of velocities to float.
TEST(Stability, ImpulseAloneChangesEnergyInSimultaneousContacts) {
  const double min_angle = kPi / 6.0;
  EXPECT_NEAR(fork_energy(Method::impulse, min_angle, cpu()), theory::jacobi_triple_gain(min_angle), 4e-7);
  EXPECT_NEAR(fork_energy(Method::exact, min_angle, cpu()), 1.0, 1e-6);
  EXPECT_EQ(head_on_energy(Method::impulse, cpu()), 0.0);
  EXPECT_NEAR(head_on_energy(Method::exact, cpu()), 1.0, 1e-6);
}

TEST(Stability, ExplicitEulerGainsSpeed) {
  const double steps = std::round(2.0 * kPi / 0.1);
  EXPECT_NEAR(euler_turned_speed(0.1), std::pow(theory::euler_turn_gain(0.1), steps), 1e-12);
  EXPECT_NEAR(turned_speed(0.1, *cpu()), 1.0, 1e-12) << "63 rotations, each rounded to 1e-16";
}

// Without a contact duration time stops, with it time goes on (Luding and McNamara 1998).
TEST(Stability, ContactClockPreventsCollapse) {
  EXPECT_TRUE(cool_with_clock(0.5, 0.0, 2000.0).collapsed);
  EXPECT_FALSE(cool_with_clock(0.5, 1e-2, 2000.0).collapsed);
  EXPECT_FALSE(cool_with_clock(0.95, 0.0, 200.0).collapsed);
}

// At N = 10^7 and area fraction 0.1 the half side is 4,431 diameters. There a float has an ulp of 2^-11
// diameters; a position unit, 2 * 4431 / 2^31, is less than a hundredth of it (docs/physics.md, 'Positions').
TEST(Stability, PositionUnitsAreFinerThanFloats) {
  EXPECT_DOUBLE_EQ(float_position_step(1e7), 0x1p-11);
  EXPECT_NEAR(unit_position_step(1e7), 8862.3 * 0x1p-31, 1e-9);
}

}  // namespace
}  // namespace pf::test
