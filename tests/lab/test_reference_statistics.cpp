// The reference against known properties of hard-disc gases: collision rate, pressure, cooling. Prints its
// speed.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "lab/lab_support.hpp"
#include "lab/mean_error.hpp"
#include "lab/theory.hpp"
#include "model/kinetic_theory.hpp"

namespace pf::test {
namespace {

class Equilibrium : public testing::TestWithParam<double> {};

// The rate and the sum of impulses over M collisions have an error of 1/sqrt(M) if collisions are
// independent; at N = 4,096 up to 1.4 times that was measured. The test allows 4 of these. Temperature is K /
// (N - 1), since the momentum is zero (docs/physics.md, 'Measuring rate and pressure').
TEST_P(Equilibrium, RateAndPressureAgreeWithKolafaAndRottner) {
  const double eta = GetParam();
  const double num = 1000.0;
  const SpawnedGas gas_1000(gas(1000, eta, Boundary::periodic));
  Reference reference(gas_1000.physics, gas_1000.parcels, {});
  const double c2 = reference.measure().parcel_energy_j / (num - 1.0);
  const double expected = theory::collision_rate_per_s(eta, std::sqrt(c2), 0.5);
  reference.run_until(50.0 / expected);
  const ReferenceTotals before = reference.totals();
  const double start_s = reference.now_s();
  reference.run_until(start_s + 1500.0 / expected);
  const double elapsed_s = reference.now_s() - start_s;
  const auto collisions = static_cast<double>(reference.totals().num_collisions - before.num_collisions);
  const double bound = 4.0 * 1.4 / std::sqrt(collisions);
  EXPECT_NEAR(2.0 * collisions / (num * elapsed_s) / expected, 1.0, bound);
  const double impulses = reference.totals().impulse_sum_mps - before.impulse_sum_mps;
  const double z = measured_compressibility(impulses, elapsed_s, num, c2, 1.0);
  EXPECT_NEAR((z - 1.0) / (theory::compressibility(eta) - 1.0), 1.0, bound);
  std::printf("eta %.1f: %.3g collisions, rate / theory %.4f, (Z - 1) / theory %.4f, bound %.4f\n", eta,
              collisions, 2.0 * collisions / (num * elapsed_s) / expected,
              (z - 1.0) / (theory::compressibility(eta) - 1.0), bound);
}

INSTANTIATE_TEST_SUITE_P(AreaFraction, Equilibrium, testing::Values(0.2, 0.5));

// Energy of the longest shear waves over that of equipartition at energy_j: mean over both axes.
double longest_waves(const std::vector<ReferenceParcel>& parcels, double side_m, double energy_j) {
  double sum = 0.0;
  for (const bool along_x : {true, false}) {
    double real = 0.0, imaginary = 0.0;
    for (const ReferenceParcel& parcel : parcels) {
      const double phase = 2.0 * kPi / side_m * (along_x ? parcel.position_m.x : parcel.position_m.y);
      const double across = along_x ? parcel.velocity_mps.y : parcel.velocity_mps.x;
      real += across * std::cos(phase);
      imaginary += across * std::sin(phase);
    }
    sum += 0.5 * (real * real + imaginary * imaginary);
  }
  const double num = static_cast<double>(parcels.size());
  return sum / num / (energy_j / (num - 1.0));
}

// Homogeneous cooling at e = 0.9, area fraction 0.2, N = 200, below the 242 from which clusters form. Means
// over seeds of T / T0 after 14 initial collision times, and of the energy in the longest shear waves. The
// test allows 4 standard errors from the scatter over the seeds, and 0.2 % for effects that the theory omits
// (8,000 seeds: 1.00043(40)).
TEST(Cooling, FollowsHaffsLawWithShearWaves) {
  const double eta = 0.2, restitution = 0.9, num = 200.0, times = 14.0;
  Mean ratio, waves;
  for (int seed = 1; seed <= 400; ++seed) {
    Settings settings = gas(200, eta, Boundary::periodic);
    settings.seed = seed;
    SpawnedGas start(settings);
    Reference elastic(start.physics, start.parcels, {});
    elastic.run_until(15.0);
    const double energy = elastic.measure().parcel_energy_j;
    start.physics.parcels.restitution = restitution;
    Reference cooling(start.physics, elastic.parcels(), {});
    cooling.run_until(times / theory::collision_rate_per_s(eta, std::sqrt(energy / (num - 1.0)), 0.5));
    const double left = cooling.measure().parcel_energy_j;
    ratio.add(left / energy);
    waves.add(longest_waves(cooling.parcels(),
                            2.0 * to_metres(start.physics.world, start.physics.world.half).x, left));
  }
  const double expected = theory::cooled_fraction_in_box(eta, restitution, num, times);
  EXPECT_NEAR(ratio.value() / expected, 1.0, 4.0 * ratio.error() / expected + 0.002);
  const double excess = theory::shear_wave_excess(eta, restitution, num, 1.0, -std::log(expected));
  EXPECT_NEAR(waves.value(), 1.0 + excess, 4.0 * waves.error());
  EXPECT_GT(excess, 10.0 * waves.error()) << "enough seeds to resolve the excess";
  std::printf("T / T0 over theory %.4f +- %.4f; longest shear waves %.3f +- %.3f, theory %.3f\n",
              ratio.value() / expected, ratio.error() / expected, waves.value(), waves.error(), 1.0 + excess);
}

TEST(Mean, AScatterThatIsSmallAgainstTheMeanIsKept) {
  const MeanError mean = mean_and_error({1e9, 1e9 + 1.0, 1e9 + 2.0});
  EXPECT_DOUBLE_EQ(mean.mean, 1e9 + 1.0);
  EXPECT_DOUBLE_EQ(mean.sigma, std::sqrt(1.0 / 3.0));
  EXPECT_EQ(mean_and_error({5.0}).sigma, 0.0);
  EXPECT_TRUE(std::isnan(mean_and_error({}).mean));
}

}  // namespace
}  // namespace pf::test
