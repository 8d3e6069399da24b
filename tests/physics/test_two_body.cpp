// Single collisions against the laws of mechanics: momentum, energy, angular momentum, restitution.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "backend/backend.hpp"
#include "backend/cpu_tally.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

Physics pair_physics(double restitution) {
  Physics physics;
  physics.world = make_world(8.0, 8.0, Boundary::periodic);
  physics.parcels = {2, 0.5, 1.0, 1.0, restitution, 1.0, true};
  physics.ball.exists = false;
  physics.reference_speed_mps = 4.0;
  return physics;
}

struct Outcome {
  Vec2d v1, v2;
};

// Velocities after one contact by `impulse` of two parcels at a distance of 0.99 diameters.
Outcome collide(double restitution, double direction, Vec2f v1, Vec2f v2, bool swap_ids = false) {
  const StepConstants c = make_step_constants(pair_physics(restitution), 1e-3, 0.0);
  const Vec2d offset{0.99 * std::cos(direction), 0.99 * std::sin(direction)};
  const Parcel a{to_units(c.physics.world, {0, 0}), v1, swap_ids ? 1U : 0U};
  const Parcel b{to_units(c.physics.world, offset), v2, swap_ids ? 0U : 1U};
  CpuTally tally;
  ContactSums of_a, of_b;
  const Vec2i e = separation<Boundary::periodic>(c.physics.world, a.position, b.position);
  add_contact<ImpulseContact>(c, a, b, e, of_a, tally);
  add_contact<ImpulseContact>(c, b, a, -e, of_b, tally);
  const auto after = [&](const Parcel& p, const ContactSums& s) {
    return Vec2d{p.velocity.x + static_cast<double>(s.velocity_x) * c.velocity_unit_mps,
                 p.velocity.y + static_cast<double>(s.velocity_y) * c.velocity_unit_mps};
  };
  return {after(a, of_a), after(b, of_b)};
}

// The normal is rounded to position units (world / 2^31, 1e-9 of the distance here). Relative velocity,
// normal, their product and the change are rounded to float, in ten operations, each by at most 2^-24 of 5
// m/s.
constexpr double kRounding = 5.0 * 2.0 * (8.0 / 2147483648.0) + 10.0 * 5.0 * 0x1p-24;

TEST(TwoBody, ParcelsConserveMomentumAndReverseTheNormalSpeed) {
  for (const double e : {0.0, 0.3, 0.9, 1.0}) {
    for (int k = 0; k < 32; ++k) {
      const double direction = 0.1 + 2.0 * kPi * k / 32.0;
      const Vec2d n{std::cos(direction), std::sin(direction)};
      const Vec2f v1 = to_float(n * 1.25 + perpendicular(n) * 0.5);
      const Vec2f v2 = to_float(n * -0.75 + perpendicular(n) * -2.0);
      const Outcome o = collide(e, direction, v1, v2);
      const Vec2d p = o.v1 + o.v2 - (to_double(v1) + to_double(v2));
      EXPECT_EQ(p.x, 0.0);
      EXPECT_EQ(p.y, 0.0);
      const double before = dot(to_double(v2) - to_double(v1), n);
      EXPECT_NEAR(dot(o.v2 - o.v1, n), -e * before, kRounding) << "e = " << e;
      EXPECT_NEAR(cross(n, o.v2 - o.v1), cross(n, to_double(v2) - to_double(v1)), kRounding);
      if (e == 1.0) {
        EXPECT_NEAR(dot(o.v1, o.v1) + dot(o.v2, o.v2),
                    dot(to_double(v1), to_double(v1)) + dot(to_double(v2), to_double(v2)), kRounding);
      }
    }
  }
}

TEST(TwoBody, SeparatingParcelsKeepTheirVelocities) {
  const Outcome o = collide(1.0, 0.7, {-1.0F, 0.0F}, {1.0F, 0.5F});
  EXPECT_EQ(o.v1.x, -1.0);
  EXPECT_EQ(o.v2.y, 0.5);
}

TEST(TwoBody, CoincidentCentresSeparateAlongTheFixedNormal) {
  const StepConstants c = make_step_constants(pair_physics(1.0), 1e-3, 0.0);
  const Parcel low{{100, 100}, {1.0F, 0.25F}, 3};
  const Parcel high{{100, 100}, {-1.0F, 0.0F}, 8};
  CpuTally tally;
  ContactSums of_low, of_high;
  add_contact<ImpulseContact>(c, low, high, {0, 0}, of_low, tally);
  add_contact<ImpulseContact>(c, high, low, {0, 0}, of_high, tally);
  EXPECT_EQ(of_low.velocity_x, -of_high.velocity_x);
  EXPECT_NEAR(static_cast<double>(of_low.velocity_x) * c.velocity_unit_mps, -2.0, 1e-9);
  EXPECT_EQ(of_low.velocity_y, 0);
  EXPECT_LT(of_low.push_x, 0) << "the lower id goes to -x";
  EXPECT_EQ(of_low.push_x, -of_high.push_x);
}

// The CPU computes a contact once, for the lower id, and takes the opposite sums for the other: so any law
// must be odd, to the bit, also where velocities are not finite.
template <class Contact>
void expect_opposite_sums(const StepConstants& c, const Parcel& low, const Parcel& high) {
  CpuTally once, none;
  ContactSums of_low, of_high;
  const Vec2i offset = high.position - low.position;
  add_contact<Contact>(c, low, high, offset, of_low, once);
  add_contact<Contact>(c, high, low, {-offset.x, -offset.y}, of_high, none);
  const ContactSums opposite = -of_low;
  EXPECT_EQ(of_high.velocity_x, opposite.velocity_x);
  EXPECT_EQ(of_high.velocity_y, opposite.velocity_y);
  EXPECT_EQ(of_high.push_x, opposite.push_x);
  EXPECT_EQ(of_high.push_y, opposite.push_y);
  EXPECT_EQ(none.num_collisions, 0U);
  EXPECT_EQ(none.impulse_sum, 0);
  EXPECT_EQ(none.max_overlap, 0.0F);
  EXPECT_GE(once.max_overlap, 0.0F);
}

TEST(TwoBody, ContactsAddOppositeSums) {
  const StepConstants c = make_step_constants(pair_physics(0.7), 1e-3, 0.01);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1.0, 1.0), power(-3.0, 3.0);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float odd[] = {kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN(), 3e38F, -0.0F};
  for (int k = 0; k < 2000; ++k) {
    const auto coordinate = [&] { return static_cast<std::int32_t>(place(random) * c.contact_distance); };
    const auto speed = [&] { return static_cast<float>(place(random) * std::pow(10.0, power(random))); };
    Parcel low{{0, 0}, {speed(), speed()}, 3}, high{{coordinate(), coordinate()}, {speed(), speed()}, 8};
    if (k % 10 == 0) high.position = low.position;
    if (k % 7 == 0) low.velocity.x = odd[k % 5];
    if (k % 11 == 0) high.velocity.y = odd[k % 5];
    expect_opposite_sums<ImpulseContact>(c, low, high);
    expect_opposite_sums<SpringContact>(c, low, high);
    expect_opposite_sums<PushOutContact>(c, low, high);
  }
}

struct BallCase {
  double restitution, friction;
};

class BallContact : public testing::TestWithParam<BallCase> {};

TEST_P(BallContact, ConservesMomentumAndExchangesAngularMomentum) {
  const auto [e, mu] = GetParam();
  BallConstants ball;  // mass ratio 2.6e6
  ball.inertia_kg_m2 = 2.0 / 3.0 * ball.mass_kg * ball.radius_m * ball.radius_m;
  ball.friction = mu;
  ParcelConstants parcel;
  parcel.mass_kg = 1e-8;
  parcel.restitution = e;
  const double spin = 25.0;
  for (int k = 0; k < 16; ++k) {
    const double direction = 0.2 + 2.0 * kPi * k / 16.0;
    const Vec2d n{std::cos(direction), std::sin(direction)};
    const Vec2d relative = n * -3.0 + perpendicular(n) * 1.5;  // parcel relative to ball
    const BallImpulse j = ball_impulse(ball, parcel, n, relative, spin);
    const double ratio = parcel.mass_kg / ball.mass_kg;
    const Vec2d after = relative + j.per_mass_mps * (1.0 + ratio);
    EXPECT_NEAR(dot(after, n), 3.0 * e, 1e-12);
    const double spin_after = spin - j.tangential_mps * parcel.mass_kg * ball.radius_m / ball.inertia_kg_m2;
    const double slip_before = dot(relative, perpendicular(n)) - spin * ball.radius_m;
    const double slip_after = dot(after, perpendicular(n)) - spin_after * ball.radius_m;
    const double normal_mps = dot(j.per_mass_mps, n);
    EXPECT_LE(std::fabs(j.tangential_mps), mu * normal_mps * (1.0 + 1e-14));
    if (std::fabs(j.tangential_mps) < mu * normal_mps * (1.0 - 1e-9)) {
      EXPECT_NEAR(slip_after, 0.0, 1e-12) << "sticks";
    } else {
      EXPECT_GE(slip_before * slip_after, 0.0) << "friction never reverses the slip";
    }
    // Energy in the frame of the pair: restitution and friction take energy and add none.
    const double reduced = 1.0 / (1.0 + ratio);
    const double kinetic_before = 0.5 * reduced * dot(relative, relative);
    const double kinetic_after =
        0.5 * reduced * dot(after, after) +
        0.5 * (spin_after * spin_after - spin * spin) * ball.inertia_kg_m2 / parcel.mass_kg;
    EXPECT_LE(kinetic_after, kinetic_before + 1e-9);
    if (e == 1.0 && mu == 0.0) {
      EXPECT_NEAR(kinetic_after, kinetic_before, 1e-12);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sweep, BallContact,
                         testing::Values(BallCase{0.0, 0.0}, BallCase{0.5, 0.0}, BallCase{1.0, 0.0},
                                         BallCase{0.9, 0.3}, BallCase{1.0, 10.0}, BallCase{0.0, 0.1}));

TEST(TwoBody, TimeOfImpactIsWhenBodiesTouch) {
  for (int k = 0; k < 40; ++k) {
    const Vec2d offset{3.0 + 0.1 * k, 0.02 * k};
    const Vec2d velocity{-2.0, 0.01 * (k % 7)};
    const double t = time_of_impact(offset, velocity, 1.0, 100.0);
    ASSERT_GT(t, 0.0);
    const Vec2d at = offset + velocity * t;
    EXPECT_NEAR(std::hypot(at.x, at.y), 1.0, 1e-12);
  }
  EXPECT_LT(time_of_impact({3.0, 0.0}, {1.0, 0.0}, 1.0, 100.0), 0.0) << "separating";
  EXPECT_LT(time_of_impact({3.0, 2.0}, {-1.0, 0.0}, 1.0, 100.0), 0.0) << "passes by";
  EXPECT_LT(time_of_impact({3.0, 0.0}, {-1.0, 0.0}, 1.0, 1.9), 0.0) << "too late";
  EXPECT_EQ(time_of_impact({0.5, 0.0}, {-1.0, 0.0}, 1.0, 1.9), 0.0) << "overlapping and approaching: at once";
  EXPECT_LT(time_of_impact({0.5, 0.0}, {1.0, 0.0}, 1.0, 1.9), 0.0) << "overlapping and separating: never";
}

}  // namespace
}  // namespace pf
