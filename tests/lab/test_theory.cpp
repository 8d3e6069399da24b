// The theory against published or derived tables. A tolerance is half of the last digit that the table shows.
#include <gtest/gtest.h>

#include <cmath>

#include "core/portable_math.hpp"
#include "lab/theory.hpp"
#include "model/ball.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"

namespace pf::theory {
namespace {

void expect_digits(double value, double expected, int digits_after_point, const char* name, double at) {
  EXPECT_NEAR(value, expected, 0.5001 * std::pow(10.0, -digits_after_point)) << name << " at " << at;
}

struct GasRow {
  double eta, z, chi;
};

TEST(Theory, EquationOfStateAgreesWithKolafaAndRottner) {
  const GasRow rows[] = {{0.01, 1.020317, 1.01586}, {0.05, 1.108388, 1.08388}, {0.10, 1.236144, 1.18072},
                         {0.20, 1.570366, 1.42592}, {0.30, 2.063261, 1.77210}, {0.40, 2.829331, 2.28666},
                         {0.50, 4.106364, 3.10636}, {0.60, 6.455337, 4.54611}, {0.65, 8.408044, 5.69850},
                         {0.67, 9.362462, 6.24064}};
  for (const GasRow& row : rows) {
    expect_digits(compressibility(row.eta), row.z, 6, "Z", row.eta);
    expect_digits(contact_value(row.eta), row.chi, 5, "chi", row.eta);
  }
}

// Table 1 of Kolafa and Rottner: simulated value and its standard error. The test allows 4 of them.
TEST(Theory, EquationOfStateAgreesWithPublishedSimulation) {
  const double rows[][3] = {{0.40, 2.1514393, 52e-7}, {0.50, 2.7601235, 79e-7}, {0.60, 3.663691, 12e-6},
                            {0.70, 5.082362, 19e-6},  {0.80, 7.476491, 36e-6},  {0.85, 9.245785, 72e-6}};
  for (const auto& [density, z, error] : rows) {
    EXPECT_NEAR(compressibility(0.25 * kPi * density), z, 4.0 * error) << "n sigma^2 = " << density;
  }
}

TEST(Theory, RateAndMeanFreePathAgreeWithTables) {
  const double rows[][3] = {{0.05, 0.12230, 10.248}, {0.10, 0.26646, 4.7036}, {0.20, 0.64359, 1.9474},
                            {0.30, 1.19976, 1.0446}, {0.40, 2.06418, 0.6072}, {0.50, 3.50516, 0.3576},
                            {0.60, 6.15569, 0.2036}};
  for (const auto& [eta, rate, path] : rows) {
    expect_digits(collision_rate_per_s(eta, 1.0, 1.0), rate, 5, "rate", eta);
    expect_digits(mean_free_path_m(eta, 1.0), path, eta < 0.07 ? 3 : 4, "path", eta);
    EXPECT_NEAR(collision_rate_per_s(eta, 3.0, 0.5), 6.0 * collision_rate_per_s(eta, 1.0, 1.0), 1e-12);
  }
}

TEST(Theory, ViscosityAgreesWithEnskog) {
  const double rows[][2] = {{0.05, 9.348}, {0.10, 4.928}, {0.20, 2.945}, {0.30, 2.598},
                            {0.40, 2.847}, {0.50, 3.653}, {0.60, 5.385}};
  for (const auto& [eta, viscosity] : rows) {
    expect_digits(kinematic_viscosity_m2ps(eta, 1.0, 1.0), viscosity, 3, "viscosity", eta);
    EXPECT_NEAR(kinematic_viscosity_m2ps(eta, 3.0, 0.5), 1.5 * kinematic_viscosity_m2ps(eta, 1.0, 1.0),
                1e-12);
  }
}

// At the number of parcels from which clusters form the longest wave neither decays nor grows, and its excess
// equals the cooling. That number is 242 at area fraction 0.2 and e = 0.9; without the Sonine correction it
// is 0.5 % less (docs/physics.md, 'Cooling').
TEST(Theory, ShearWavesGrowBeyondTheOnsetOfClusters) {
  EXPECT_NEAR(shear_wave_excess(0.2, 0.9, 242.0, 1.0, 1.0), 1.0, 0.005);
  EXPECT_NEAR(shear_wave_excess(0.2, 0.9, 200.0, 1.0, 50.0), 1.0 / (242.0 / 200.0 - 1.0), 0.2)
      << "stationary";
  EXPECT_GT(shear_wave_excess(0.2, 0.9, 400.0, 1.0, 10.0), 25.0) << "unstable";
  EXPECT_LT(shear_wave_excess(0.2, 0.9, 200.0, 100.0, 1.0), 0.02);
}

// Cooling follows Haff's law while shear waves hold little energy.
TEST(Theory, CoolingInABoxFollowsHaffsLawWithoutShearWaves) {
  EXPECT_NEAR(cooled_fraction_in_box(0.2, 0.9, 200.0, 0.1) / cooled_fraction(0.9, 1.0, 0.1), 1.0, 1e-5);
  EXPECT_NEAR(cooled_fraction_in_box(0.2, 0.99, 200.0, 14.0) / cooled_fraction(0.99, 1.0, 14.0), 1.0, 3e-4);
  EXPECT_NEAR(cooled_fraction_in_box(0.2, 0.9, 200.0, 14.0) / cooled_fraction(0.9, 1.0, 14.0), 1.015, 1e-3);
}

// The mean impulse over mass of an elastic collision is the mean normal closing speed, sqrt(pi) c. Rate and
// pressure therefore agree: Z - 1 = sqrt(pi)/2 Gamma r / c.
TEST(Theory, PressureFromImpulsesAgreesWithTheRate) {
  const double num = 1000.0, c = 1.3, radius = 0.5, time_s = 7.0, eta = 0.3;
  const double collisions = 0.5 * num * time_s * collision_rate_per_s(eta, c, radius);
  const double sum = collisions * std::sqrt(kPi) * c;
  EXPECT_NEAR(measured_compressibility(sum, time_s, num, c * c, 2.0 * radius), compressibility(eta), 1e-12);
}

TEST(Theory, CoolingFollowsHaffsLaw) {
  EXPECT_NEAR(sonine_a2(0.9), -0.0269, 5e-5);
  EXPECT_EQ(sonine_a2(1.0), 0.0);
  EXPECT_EQ(cooled_fraction(1.0, 2.0, 5.0), 1.0);
  // A direct simulation Monte Carlo run gave 0.2929 after 13 collisions per parcel, with noise below 3e-4.
  // The value without the correction is 0.2908.
  EXPECT_NEAR(cooled_fraction_by_collisions(0.9, 13.0), 0.2929, 5e-4);
  // Both laws agree: d tau = Gamma dt, Gamma = Gamma0 sqrt(T/T0) (1 - a2/16).
  const double rate = 1.7, end_s = 9.0;
  const int steps = 20000;
  double tau = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double t = end_s * (k + 0.5) / steps;
    tau += rate * (1.0 - sonine_a2(0.8) / 16.0) * std::sqrt(cooled_fraction(0.8, rate, t)) * end_s / steps;
  }
  EXPECT_NEAR(cooled_fraction_by_collisions(0.8, tau), cooled_fraction(0.8, rate, end_s), 1e-7);
}

TEST(Theory, MissedCollisionsAgreeWithTables) {
  expect_digits(missed_fraction(0.1), 4.2e-4, 5, "missed", 0.1);
  expect_digits(missed_fraction(0.2), 1.7e-3, 4, "missed", 0.2);
  expect_digits(missed_fraction(0.5), 0.0105, 4, "missed", 0.5);
  expect_digits(missed_fraction(1.0), 0.043, 3, "missed", 1.0);
  expect_digits(missed_fraction(2.0), 0.215, 3, "missed", 2.0);
  expect_digits(missed_fraction(3.0), 0.476, 3, "missed", 3.0);
  expect_digits(missed_fraction(5.0), 0.686, 3, "missed", 5.0);
  EXPECT_NEAR(missed_fraction(1.999999), missed_fraction(2.0), 1e-5);
  EXPECT_NEAR(missed_fraction(1.001e-3) / (1.001e-3 * 1.001e-3 / 24.0), 1.0, 1e-6);
}

// The closed form against its definition: a chord is missed if no end of a step, at a uniform phase, lies in
// it. The midpoint rule over impact parameters is off by 1e-5, since the integrand has a square root at 1.
TEST(Theory, MissedCollisionsAgreeWithQuadrature) {
  for (const double step : {0.3, 0.8, 1.5, 1.9, 2.5, 7.0}) {
    double sum = 0.0;
    const int num = 200000;
    for (int k = 0; k < num; ++k) {
      const double b = (k + 0.5) / num;
      sum += std::fmax(0.0, 1.0 - 2.0 * std::sqrt(1.0 - b * b) / step) / num;
    }
    EXPECT_NEAR(missed_fraction(step), sum, 1e-5) << step;
  }
}

TEST(Theory, DragAndHitsAgreeWithTables) {
  const double rows[][5] = {
      {0.1, 35.5376, 44.4220, 40.5740, 8.90653}, {0.3, 12.0803, 15.1003, 13.7005, 3.08555},
      {0.5, 7.52398, 9.40497, 8.42715, 1.98736}, {1, 4.36548, 5.45685, 4.66619, 1.28192},
      {1.5, 3.49790, 4.37238, 3.55148, 1.12003}, {2, 3.14966, 3.93707, 3.05829, 1.06508},
      {3, 2.88571, 3.60713, 2.62831, 1.02820},   {5, 2.74626, 3.43283, 2.33811, 1.01005},
      {10, 2.68664, 3.35830, 2.15419, 1.00250}};
  for (const auto& [s, specular, rough, diffuse, hits] : rows) {
    const int digits = s < 0.4 ? 4 : 5;
    expect_digits(drag_specular(s), specular, digits, "specular", s);
    expect_digits(drag_rough(s, 1.0), rough, digits, "rough", s);
    expect_digits(drag_diffuse(s, 1.0), diffuse, digits, "diffuse", s);
    expect_digits(hit_factor(s), hits, 5, "hits", s);
    EXPECT_NEAR(drag_smooth(s, 0.8), 0.9 * drag_specular(s), 1e-12 * specular);
  }
}

TEST(Theory, DragHasItsLimits) {
  EXPECT_NEAR(drag_specular(1e-3) * 1e-3, 2.0 * std::sqrt(kPi), 1e-5);
  // Up to S = 60, where unscaled Bessel functions exceed the range of double. Drag is 8/3 + 2 / S^2 + ...
  for (const double s : {20.0, 24.0, 25.0, 40.0, 60.0}) {
    EXPECT_NEAR(drag_specular(s), 8.0 / 3.0 + 2.0 / (s * s), 1.0 / (s * s * s)) << s;
    EXPECT_NEAR(hit_factor(s), 1.0 + 0.25 / (s * s), 0.1 / (s * s * s)) << s;
  }
  EXPECT_NEAR(drag_specular(24.4949), drag_specular(24.4950), 1e-7) << "both forms of the Bessel function";
}

TEST(Theory, ColdDragWithFrictionAgreesWithTable) {
  const double rows[][2] = {{0.0, 2.66667}, {0.1, 2.79741}, {0.3, 3.00966}, {0.5, 3.13807}, {1.0, 3.26295}};
  for (const auto& [friction, drag] : rows)
    expect_digits(cold_drag_coefficient(1.0, friction), drag, 5, "cold", friction);
  expect_digits(cold_drag_coefficient(1.0, 1e9), 3.33333, 5, "cold", 1e9);
  expect_digits(cold_drag_coefficient(0.8, 0.3), 2.71677, 5, "cold", 0.3);
}

// Sums the model's impulses over the impact parameters of a cold beam.
TEST(Theory, ColdDragIsTheSumOfTheModelsImpulses) {
  BallConstants ball;
  ball.held = true;
  ball.radius_m = 0.5;
  ball.inertia_kg_m2 = 1.0;
  for (const double friction : {0.0, 0.3}) {
    ball.friction = friction;
    ParcelConstants parcel;
    parcel.mass_kg = 1e-8;
    parcel.restitution = 0.8;
    double sum = 0.0;
    const int num = 20000;
    for (int k = 0; k < num; ++k) {
      const double b = 2.0 * (k + 0.5) / num - 1.0;
      const Vec2d normal{-std::sqrt(1.0 - b * b), b};
      sum -= ball_impulse(ball, parcel, normal, {1.0, 0.0}, 0.0).per_mass_mps.x * 2.0 / num;
    }
    EXPECT_NEAR(sum, cold_drag_coefficient(0.8, friction), 1e-6);
  }
}

// air = drag uses the coefficient: dv/dt = -rho Cd R / m_b v^2.
TEST(Theory, ScenesUseColdDrag) {
  Settings s;
  s.air = Air::drag;
  const double drag = derive_physics(s).ball.drag_per_m;
  EXPECT_NEAR(drag,
              s.areal_density_kg_m2 * cold_drag_coefficient(s.restitution, s.friction) * s.ball_radius_m /
                  s.ball_mass_kg,
              1e-12 * drag);
}

// A rough ball with slip w R in a resting gas: each hit transfers m w R on average, at lever R. The
// transverse force is half the displaced mass times w V, against z x V.
TEST(Theory, SpinTorqueAndTransverseForceFollowTheirLaws) {
  const double hit_mass = 2e-3 * hits_per_s(0.2, 500.0, 3.0, 2.0);
  EXPECT_NEAR(hit_mass, 2e-3 * 2.0 * 0.2 * 500.0 * 3.0 * 1.06508, 1e-5 * hit_mass);
  EXPECT_NEAR(spin_torque_n_m(0.5, 4.0, 0.2, hit_mass), -0.5 * 4.0 * 0.04 * hit_mass, 1e-15);
  EXPECT_NEAR(transverse_force_n(1.0, 2.0, 0.3, 0.3, 4.0, 5.0), -0.5 * (2.0 * kPi * 0.09) * 4.0 * 5.0, 1e-12);
}

TEST(Theory, EnergyGainsAgreeWithClosedForms) {
  EXPECT_NEAR(jacobi_triple_gain(kPi / 6.0), 1.75, 1e-12);
  EXPECT_NEAR(jacobi_triple_gain(kPi / 4.0), 1.0, 1e-12);
  EXPECT_NEAR(jacobi_triple_gain(kPi / 3.0), 0.75, 1e-12);
  EXPECT_NEAR(std::pow(euler_turn_gain(0.1), 2.0 * kPi / 0.1), 1.367, 5e-4);
  EXPECT_NEAR(std::pow(euler_turn_gain(0.01), 2.0 * kPi / 0.01), 1.0319, 5e-5);
}

}  // namespace
}  // namespace pf::theory
