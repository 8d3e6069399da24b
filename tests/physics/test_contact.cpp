// Contacts beyond the exchange of an impulse: push-out of overlaps, the contact duration of the TC model, and
// the spring's duration and restitution.
#include <gtest/gtest.h>

#include <cmath>

#include "backend/cpu_tally.hpp"
#include "model/exact/collision.hpp"
#include "model/spring.hpp"
#include "model/time_step.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

Settings two_discs(Method method, double restitution) {
  Settings s = gas(2, 0.1, Boundary::periodic);
  s.box_follows_parcels = false;
  s.width_m = s.height_m = 8.0;
  s.method = method;
  s.restitution = restitution;
  s.dt_s = 1e-6;
  return s;
}

// Places two unit discs, the second at an offset from the first.
void place_pair(SceneRun& run, Vec2d offset_m, Vec2f v1 = {}, Vec2f v2 = {}) {
  const World& world = run.physics.world;
  run.backend->restore({{to_units(world, offset_m * -0.5), to_units(world, offset_m * 0.5)}, {v1, v2}});
}

Vec2d direction(int k) { return {std::cos(0.3 + 0.7 * k), std::sin(0.3 + 0.7 * k)}; }

class PushOut : public testing::TestWithParam<Method> {};

// The discs are at rest: only the push-out moves them. Each position is rounded by half a unit along x and y,
// the distance by two times 0.71 units. Of either push, up to half a diameter, four operations in float lose
// up to 2^-24 each.
TEST_P(PushOut, LeavesAPairJustTouching) {
  for (int k = 0; k < 16; ++k) {
    SceneRun run(two_discs(GetParam(), 0.5), 1);
    place_pair(run, direction(k) * (0.05 + 0.059 * k));
    run.advance(1, 1e-6);
    const std::vector<Vec2i> at = run.backend->snapshot().position;
    const double distance = length(to_double(at[1]) - to_double(at[0]));
    const double diameter = 1.0 / run.physics.world.unit_m;
    EXPECT_NEAR(distance, diameter, 2.0 + 4.0 * 0x1p-24 * diameter) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, PushOut, testing::Values(Method::impulse, Method::exact));

// A sum that is too large for a position, or stands for a push out of range, must not wrap to a small one.
TEST(PushOut, OfHalfTheWorldAndMoreIsNoDistance) {
  const std::int64_t unit = 1 << kPushBits, limit = kHalfSide * unit;
  EXPECT_EQ(push_after(limit - unit), kHalfSide - 1);
  EXPECT_EQ(push_after(unit - limit), 1 - kHalfSide);
  for (const std::int64_t sum : {limit, -limit, 4 * limit + 5 * unit, INT64_MIN})
    EXPECT_EQ(push_after(sum), kHalfSide) << sum;
}

// Sums hold changes below 1,024 reference speeds (here 1 m/s). What is beyond is reported, and stays in
// place.
TEST(Contact, ThatChangesVelocitiesTooMuchIsReported) {
  for (const Neighbors neighbors : {Neighbors::grid, Neighbors::all_pairs}) {
    for (const float speed : {1000.0F, 1100.0F}) {
      Settings s = two_discs(Method::impulse, 1.0);
      s.neighbors = neighbors;
      SceneRun run(s, 1);
      place_pair(run, {0.999, 0.0}, {speed / 2, 0.0F}, {-speed / 2, 0.0F});
      const bool is_beyond = speed > 1024.0F;
      EXPECT_EQ(run.advance(1, 1e-9).totals.num_invalid, is_beyond ? 2U : 0U) << speed;
      const float expected = is_beyond ? speed / 2 : -speed / 2;
      EXPECT_FLOAT_EQ(run.backend->snapshot().velocity[0].x, expected) << speed;
    }
  }
}

// A parcel that the ball makes too fast is reported and stays in place, so the ball must not feel the hit.
TEST(Contact, WithTheBallThatMakesAParcelTooFastDoesNotHappen) {
  for (const double speed_mps : {300.0, 1000.0}) {
    Settings s = two_discs(Method::impulse, 1.0);
    s.ball_present = true;
    s.ball_radius_m = 0.5;
    s.ball_mass_kg = 1e3;  // the parcel leaves at twice its speed
    s.ball_x_m = -3.0;
    s.ball_y_m = s.ball_spin_radps = s.k_magnus = s.friction = 0.0;
    s.ball_vx_mps = speed_mps;
    SceneRun run(s, 1);
    const World& world = run.physics.world;
    run.backend->restore({{to_units(world, {-1.5, 0.0}), to_units(world, {0.0, 3.0})}, {{}, {}}});
    const StepReport report = run.advance(1, 0.0025);  // half of the world is 4 m
    const bool is_beyond = speed_mps > 500.0;
    EXPECT_EQ(report.totals.num_invalid, is_beyond ? 1U : 0U) << speed_mps;
    EXPECT_EQ(report.totals.num_ball_hits, is_beyond ? 0U : 1U) << speed_mps;
    if (is_beyond) {
      EXPECT_EQ(report.ball.velocity_mps.x, speed_mps);
      EXPECT_EQ(run.backend->snapshot().velocity[0].x, 0.0F);
    }
    EXPECT_EQ(run.advance(3, 1e-9).totals.num_invalid, 0U) << "the parcel goes on";
  }
}

// The count is of parcels, not of parcels times steps.
TEST(Contact, ParcelsThatAreNotFiniteCountOnce) {
  SceneRun run(gas(100, 0.1), 1);
  ParcelSnapshot broken = run.backend->snapshot();
  broken.velocity[17].x = broken.velocity[42].y = std::nanf("");
  run.backend->restore(broken);
  const StepTotals totals = run.advance(5, 0.01).totals;
  EXPECT_EQ(totals.num_invalid, 2U);
  EXPECT_EQ(totals.first_invalid_id, 17U);
  EXPECT_EQ(totals.first_invalid_step, 0U);
}

// The contact distance is 1.5 m. The parcel starts inside it and approaches. Bounds as above, and 1e-9 of a
// unit for the ball's position.
TEST(PushOut, LeavesAParcelJustTouchingTheBall) {
  for (int k = 0; k < 16; ++k) {
    Settings s = two_discs(Method::impulse, 0.5);
    s.ball_present = s.ball_held = true;
    s.ball_radius_m = 1.0;
    s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_spin_radps = s.friction = 0.0;
    s.contacts = false;
    SceneRun run(s, 1);
    const World& world = run.physics.world;
    const Vec2d e = direction(k);
    run.backend->restore(
        {{to_units(world, e * (0.5 + 0.06 * k)), to_units(world, e * -3.0)}, {to_float(e * -1e-6), {}}});
    run.advance(1, 1e-6);
    EXPECT_NEAR(length(to_double(run.backend->snapshot().position[0])) * world.unit_m, 1.5,
                2.0 * world.unit_m);
  }
}

// A collision by `exact` at a distance of 0.9999 diameters.
struct Collision {
  Vec2d v1, v2, normal;
};

Collision collision(double restitution, bool elastic, int k, Vec2d v1, Vec2d v2) {
  Settings s = two_discs(Method::exact, restitution);
  SceneRun run(s, 1);
  const RunConstants constants = make_run_constants(run.physics, 0.01);
  const ExactConstants c{constants, {constants.reference_ticks}};
  const Vec2i at = to_units(run.physics.world, direction(k) * 0.9999);
  Trajectory first{{0, 0}, to_float(v1), 0}, second{at, to_float(v2), 0};
  CpuTally tally;
  collide<Boundary::periodic>(c, first, second, elastic, tally);
  return {to_double(first.velocity), to_double(second.velocity), direction(k)};
}

// Speeds are up to 3.5 m/s. Each of four components is rounded to float twice, by at most 2^-24 of 3.5 m/s.
// The normal speed is then off by 4 x 2.1e-7 m/s, and the kinetic energy by 8 x 3.5 x 2.1e-7 J.
constexpr double kFloatSpeed = 4.0 * 2.1e-7;
constexpr double kFloatEnergy = 8.0 * 3.5 * 2.1e-7;

TEST(ContactClock, ContactsWithinItLoseNothing) {
  for (const double restitution : {0.0, 0.5, 0.9}) {
    for (int k = 0; k < 16; ++k) {
      const Vec2d n = direction(k), v1 = n * 2.0 + perpendicular(n), v2 = n * -1.5 - perpendicular(n) * 3.0;
      const Collision after = collision(restitution, true, k, v1, v2);
      EXPECT_NEAR(dot(after.v2 - after.v1, n), 3.5, kFloatSpeed);
      EXPECT_NEAR(dot(after.v1, after.v1) + dot(after.v2, after.v2), dot(v1, v1) + dot(v2, v2),
                  2.0 * kFloatEnergy);
    }
  }
}

TEST(ContactClock, ContactsBeyondItLoseByRestitution) {
  for (const double restitution : {0.0, 0.5, 0.9, 1.0}) {
    for (int k = 0; k < 16; ++k) {
      const Vec2d n = direction(k), v1 = n * 2.0 + perpendicular(n), v2 = n * -1.5 - perpendicular(n) * 3.0;
      const Collision after = collision(restitution, false, k, v1, v2);
      const double min_separation = 0x1p-20 * 15.0;  // a share of the reference speed, 15 m/s
      EXPECT_NEAR(dot(after.v2 - after.v1, n), restitution * 3.5, kFloatSpeed + min_separation);
      EXPECT_GT(dot(after.v2 - after.v1, n), 0.0) << "otherwise the pair would collide again at once";
      EXPECT_NEAR(cross(n, after.v2 - after.v1), -4.0, kFloatSpeed);
    }
  }
}

// Normal speeds after a slow collision without restitution of bodies at an offset that overlap.
struct Separation {
  double of_parcels_mps, of_ball_and_parcel_mps;
};

Separation separation_after(const ExactConstants& c, int k, double overlap_units) {
  const Vec2d n = direction(k);
  const auto at = [&](double contact) {
    const Vec2d offset = n * (contact - overlap_units);
    return Vec2i{round_to_int32(offset.x), round_to_int32(offset.y)};
  };
  CpuTally tally;
  Trajectory first{{0, 0}, to_float(n * 1e-6), 0}, second{at(c.run.contact_distance), {}, 0};
  collide<Boundary::periodic>(c, first, second, false, tally);
  Trajectory third{at(c.run.ball_contact), to_float(n * -1e-6), 0};
  const BallReaction reaction = collide_with_ball<Boundary::periodic>(c, {}, 0, third, tally);
  const Vec2d ball_mps = reaction.velocity_mps * (1.0 / c.run.physics.ball.mass_kg);
  return {dot(to_double(second.velocity) - to_double(first.velocity), n),
          dot(to_double(third.velocity) - ball_mps, n)};
}

// In a crowd without restitution every event would add a rounding to the overlaps. A rounded position is off
// by up to 0.71 units, and velocities of 1e-4 m/s by 1e-11.
TEST(ExactContact, UndoesOverlapsOfRoundings) {
  Settings s = two_discs(Method::exact, 0.0);
  s.ball_present = true;
  s.ball_radius_m = 1.0;
  s.ball_mass_kg = 3.0;
  s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_spin_radps = s.friction = 0.0;
  SceneRun run(s, 1);
  const RunConstants constants = make_run_constants(run.physics, 0.0);
  ExactConstants c{constants, {constants.reference_ticks}};
  c.plan.ball = BallRole::participant;
  const double least = c.plan.min_separation_speed_mps;
  const double undo_mps_per_unit = 1.0 / (16384.0 * c.plan.units_per_tick);
  for (int k = 0; k < 16; ++k) {
    for (const double overlap : {1.5, 4.0, 7.0}) {
      const auto [parcels, ball] = separation_after(c, k, overlap);
      EXPECT_NEAR(parcels, least + (overlap - 0.5) * undo_mps_per_unit, 0.75 * undo_mps_per_unit);
      EXPECT_NEAR(ball, least + (overlap - 0.5) * undo_mps_per_unit, 0.75 * undo_mps_per_unit);
    }
    for (const double overlap : {-100.0, -0.3, 9.0, 1e6}) {
      const auto [parcels, ball] = separation_after(c, k, overlap);
      EXPECT_NEAR(parcels, least, 1e-10) << "no overlap, or not by roundings: " << overlap;
      EXPECT_NEAR(ball, least, 1e-10) << overlap;
    }
  }
}

// Without losses every bit of energy stays.
TEST(ExactContact, UndoesNoOverlapsWithoutLosses) {
  SceneRun run(two_discs(Method::exact, 1.0), 1);
  EXPECT_EQ(make_run_constants(run.physics, 0.0).reference_ticks.separation_mps_per_unit, 0.0);
}

// Ball and parcel separate at restitution times their closing speed, whether or not the ball recoils, and at
// least at the minimum separation speed. The parcel's velocity is rounded to float, by 1.2e-7 m/s along x and
// y.
TEST(BallCollision, SeparatesByRestitutionForAnyBallMass) {
  for (const double mass_kg : {0.1, 1.0, 1e6}) {
    for (const double restitution : {0.0, 0.5, 1.0}) {
      Settings s = two_discs(Method::exact, restitution);
      s.ball_present = true;
      s.ball_radius_m = 1.0;
      s.ball_mass_kg = mass_kg;
      s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_spin_radps = s.friction = 0.0;
      SceneRun run(s, 1);
      const RunConstants constants = make_run_constants(run.physics, 0.0);
      ExactConstants c{constants, {constants.reference_ticks}};
      c.plan.ball = BallRole::participant;
      const Vec2d n = direction(4);
      Trajectory trajectory{to_units(run.physics.world, n * 1.5), to_float(n * -2.0 + perpendicular(n)), 0};
      CpuTally tally;
      const BallReaction reaction = collide_with_ball<Boundary::periodic>(c, {}, 0, trajectory, tally);
      const Vec2d ball_mps = reaction.velocity_mps * (1.0 / mass_kg);
      const Vec2d after = to_double(trajectory.velocity) - ball_mps;
      EXPECT_NEAR(dot(after, n), std::fmax(restitution * 2.0, c.plan.min_separation_speed_mps), 2.5e-7)
          << mass_kg;
      EXPECT_NEAR(cross(n, after), 1.0, 2.5e-7);
      const Vec2d momentum = to_double(trajectory.velocity) + reaction.velocity_mps;
      EXPECT_NEAR(dot(momentum, n), -2.0, 2.5e-7) << "the ball takes the momentum that the parcel loses";
    }
  }
}

// The seed's factor multiplies the change of velocity. Rounding: two velocities to float, the normal to units
// of 4e-9 m.
TEST(ImpulseScale, MultipliesTheChangeOfVelocity) {
  for (const double scale : {0.5, 1.0, 1.3}) {
    Settings s = two_discs(Method::impulse, 0.5);
    s.impulse_scale = scale;
    SceneRun run(s, 1);
    place_pair(run, {0.999, 0.0}, {1.0F, 0.25F}, {-0.5F, 0.0F});
    run.advance(1, 1e-6);
    const std::vector<Vec2f> v = run.backend->snapshot().velocity;
    EXPECT_NEAR(v[1].x - v[0].x, -1.5 + scale * 1.5 * 1.5, 2e-7);
    EXPECT_EQ(v[0].y, 0.25F);
  }
}

// A head-on contact in steps of a 2000th of its duration. The restitution is reached to the order of the step
// (semi- implicit: first order, pi / 2000), the duration to a step. The impulse is the change of momentum.
TEST(Spring, ContactHasTheSetDurationAndRestitution) {
  for (const double restitution : {1.0, 0.8, 0.3}) {
    Settings s = two_discs(Method::spring, restitution);
    s.spring_contact_s = 0.002;  // overlaps stay below 1 m/s x 0.002 s / pi
    SceneRun run(s, 1);
    const double dt_s = 1e-6;
    place_pair(run, {1.0 + 1e-7, 0.0}, {0.5F, 0.0F}, {-0.5F, 0.0F});
    StepTotals totals;
    int num_in_contact = 0;
    for (int k = 0; k < 2400; ++k) {
      totals += run.advance(1, dt_s).totals;
      const std::vector<Vec2i> at = run.backend->snapshot().position;
      num_in_contact += at[1].x - at[0].x < 1.0 / run.physics.world.unit_m ? 1 : 0;
    }
    const std::vector<Vec2f> v = run.backend->snapshot().velocity;
    EXPECT_NEAR(v[1].x - v[0].x, restitution, 0.01 * restitution);
    EXPECT_NEAR(num_in_contact * dt_s, 0.002, 3.0 * dt_s) << "restitution " << restitution;
    EXPECT_EQ(totals.num_collisions, 1U);
    EXPECT_NEAR(totals.impulse_sum_mps, 0.5 * (1.0 + restitution), 0.002);
  }
}

TEST(Spring, SeparatingPairStartsNoContact) {
  Settings s = two_discs(Method::spring, 1.0);
  s.spring_contact_s = 0.02;
  SceneRun run(s, 1);
  place_pair(run, {0.9999, 0.0}, {-1.0F, 0.0F}, {1.0F, 0.0F});
  EXPECT_EQ(run.advance(5, 1e-4).totals.num_collisions, 0U);
}

// x'' = -w0^2 x - 2 g x' in steps, velocity first. 1e-3 below the limit the motion decays or stays bounded.
// 1e-3 above it the motion grows without bound, by at least 1e-3 per step near an eigenvalue of -1.
TEST(Spring, StepsAreStableOnlyUpToTheLimit) {
  for (const double restitution : {1.0, 0.7, 0.2}) {
    const SpringContactRates rates = spring_contact_rates(restitution, 0.01);
    const auto after_steps = [&](double dt_s) {
      double x = 1.0, v = 0.0;
      for (int k = 0; k < 4000; ++k) {
        v += -dt_s * (rates.omega0_squared_per_s2 * x + 2.0 * rates.damping_per_s * v);
        x += dt_s * v;
      }
      return std::fabs(x);
    };
    const double limit_s = spring_step_limit_s(rates);
    EXPECT_LT(after_steps(0.999 * limit_s), 100.0) << restitution;
    EXPECT_GT(after_steps(1.001 * limit_s), 1e6) << restitution;
  }
}

}  // namespace
}  // namespace pf::test
