// Shocks, stops and blasts against published figures of ideal gases: a constant Z is one of heat ratio 1 + Z.
#include <gtest/gtest.h>

#include <cmath>

#include "lab/theory.hpp"

namespace pf::theory {
namespace {

constexpr double kAnyDensity = 0.01;  // an ideal gas has no scale of it
double heat_ratio_2(double) { return 1.0; }
double heat_ratio_7_5(double) { return 0.4; }
double heat_ratio_5_3(double) { return 2.0 / 3.0; }

// The discs' dilute limit: rho2/rho1 = 3 M^2 / (M^2 + 2), p2/p1 = 1 + 4 (M^2 - 1) / 3.
TEST(FlowTheory, ShocksOfAnIdealGasOfDiscsAreRankineHugoniot) {
  const double rows[][3] = {{2.0, 2.0, 5.0}, {3.0, 27.0 / 11.0, 35.0 / 3.0}, {5.0, 75.0 / 27.0, 33.0}};
  for (const auto& [mach, density, pressure] : rows) {
    const Shock shock = shock_of(kAnyDensity, mach, heat_ratio_2);
    EXPECT_NEAR(shock.density, density, 1e-9) << mach;
    EXPECT_NEAR(shock.pressure, pressure, 1e-8) << mach;
    EXPECT_NEAR(shock.temperature, pressure / density, 1e-8) << mach;
    EXPECT_NEAR(shock.front_speed + shock.gas_speed, mach * std::sqrt(2.0), 1e-9) << mach;
  }
}

// NACA Report 1135 (1953), table II, heat ratio 7/5: M = 2 and 3.
TEST(FlowTheory, ShocksAndStopsOfAirAgreeWithNaca1135) {
  const double rows[][5] = {{2.0, 2.667, 4.500, 1.687, 5.640}, {3.0, 3.857, 10.33, 2.679, 12.06}};
  for (const auto& [mach, density, pressure, temperature, stop] : rows) {
    const Shock shock = shock_of(kAnyDensity, mach, heat_ratio_7_5);
    EXPECT_NEAR(shock.density, density, 6e-4);
    EXPECT_NEAR(shock.pressure, pressure, 6e-3);
    EXPECT_NEAR(shock.temperature, temperature, 6e-4);
    EXPECT_NEAR(pitot_pressure_ratio(kAnyDensity, mach, heat_ratio_7_5), stop, 6e-3);
  }
}

// Rayleigh's formula: (3 M^2 / 2)^2 * 3 / (4 M^2 - 1).
TEST(FlowTheory, StopsOfAnIdealGasOfDiscsFollowRayleigh) {
  for (const double mach : {1.5, 2.0, 4.0}) {
    const double m2 = mach * mach, expected = 2.25 * m2 * m2 * 3.0 / (4.0 * m2 - 1.0);
    EXPECT_NEAR(pitot_pressure_ratio(kAnyDensity, mach, heat_ratio_2), expected, 1e-5 * expected) << mach;
  }
}

// With 1 + 2 cos^2 the mean over half a circle is 2; near the axis it is 1 + 2 (1 - angle^2 / 3).
TEST(FlowTheory, PressureFallsAwayFromTheAxis) {
  EXPECT_NEAR(pressure_around_axis(3.0, 0.5 * kPi), 2.0, 1e-12);
  EXPECT_NEAR(pressure_around_axis(3.0, 0.01), 3.0 - 2e-4 / 3.0, 1e-8);
}

// Cylindrical blast, heat ratio 7/5: alpha = 0.984041 (Kamm 2000, LA-UR-00-6055).
TEST(FlowTheory, BlastsOfAnIdealGasAgreeWithSedov) {
  const Blast air = strong_blast(kAnyDensity, heat_ratio_7_5);
  EXPECT_NEAR(air.density, 6.0, 1e-9);
  EXPECT_NEAR(air.energy_share, 0.984041, 2e-4);
  EXPECT_NEAR(strong_blast(kAnyDensity, heat_ratio_5_3).density, 4.0, 1e-9);
  EXPECT_NEAR(strong_blast(kAnyDensity, heat_ratio_2).density, 3.0, 1e-9);
}

// The speed of sound of discs, and their dilute limit.
TEST(FlowTheory, DiscsTendToTheIdealGas) {
  EXPECT_NEAR(sound_speed(0.2), 2.1993, 6e-5);
  EXPECT_NEAR(sound_speed(0.4), 3.8336, 6e-5);
  const Shock thin = shock_of(1e-7, 2.0);
  EXPECT_NEAR(thin.density, 2.0, 1e-5);
  EXPECT_NEAR(thin.pressure, 5.0, 1e-5);
  EXPECT_NEAR(strong_blast(1e-7).prefactor, strong_blast(kAnyDensity, heat_ratio_2).prefactor, 1e-5);
}

// Mass, momentum and energy through a shock in a dense gas; c = 1 ahead, enthalpy c^2 (1 + Z).
TEST(FlowTheory, ShocksInADenseGasConserve) {
  for (const double eta : {0.1, 0.4}) {
    const Shock shock = shock_of(eta, 2.0);
    const double in = shock.front_speed + shock.gas_speed, out = shock.front_speed;
    const double z = compressibility(eta), behind = compressibility(eta * shock.density);
    EXPECT_NEAR(shock.density * out, in, 1e-9 * in);
    EXPECT_NEAR(z * shock.pressure + shock.density * out * out, z + in * in, 1e-7 * in * in);
    EXPECT_NEAR(shock.temperature * (1.0 + behind) + 0.5 * out * out, 1.0 + z + 0.5 * in * in,
                1e-7 * in * in);
  }
}

}  // namespace
}  // namespace pf::theory
