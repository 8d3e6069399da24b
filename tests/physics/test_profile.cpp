// Profiles: their sums do not depend on the number of threads, and their rows are density, velocity and
// temperature.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "app/scene_run.hpp"
#include "backend/profile.hpp"

namespace pf {
namespace {

Settings stream(std::int64_t num) {
  Settings s = unit_gas(num, 0.2, Boundary::periodic);
  s.flow_x_mps = 1.5;
  s.seed = 3;
  return s;
}

Profile base_profile(Backend& backend, const ProfileShape& shape) { return backend.Backend::profile(shape); }

TEST(Profile, IsTheSameForAnyNumberOfThreadsAndFromASnapshot) {
  for (const Method method : {Method::impulse, Method::exact}) {
    for (const ProfileAxis axis : {ProfileAxis::x, ProfileAxis::radius}) {
      Settings s = stream(4000);
      s.method = method;
      SceneRun one(s, 1), three(s, 3);
      one.advance(5, 0.02);
      three.advance(5, 0.02);
      const ProfileShape shape = profile_shape(one.physics, axis, 37);
      const Profile profile = one.backend->profile(shape);
      EXPECT_EQ(profile.bins, three.backend->profile(shape).bins);
      EXPECT_EQ(profile.bins, base_profile(*one.backend, shape).bins);
    }
  }
}

// 40,000 parcels in 10 bins of 4,000: density to 1/sqrt(4000) at most, velocity to 1/sqrt(4000), c to half of
// it.
TEST(Profile, RowsOfAStreamShowItsDensityVelocityAndTemperature) {
  const SceneRun run(stream(40000), 2);
  const Profile profile = run.backend->profile(profile_shape(run.physics, ProfileAxis::x, 10));
  std::int64_t total = 0;
  for (const ProfileRow& row : rows_of(profile, run.physics.parcels)) {
    EXPECT_NEAR(row.area_fraction, 0.2, 0.2 * 0.06);
    EXPECT_NEAR(row.velocity_mps, 1.5, 0.06);
    EXPECT_NEAR(row.speed_mps, 1.0, 0.04);
    total += row.num;
  }
  EXPECT_EQ(total, 40000);
}

// A stream has no mean velocity away from the middle; beyond half of the smaller side nothing is counted.
TEST(Profile, AroundTheMiddleVelocityIsRadial) {
  const SceneRun run(stream(40000), 2);
  const Profile profile = run.backend->profile(profile_shape(run.physics, ProfileAxis::radius, 4));
  std::int64_t total = 0;
  for (const ProfileRow& row : rows_of(profile, run.physics.parcels)) {
    EXPECT_NEAR(row.area_fraction, 0.2, 0.2 * 0.1);
    EXPECT_NEAR(row.velocity_mps, 0.0, 0.15);
    total += row.num;
  }
  EXPECT_NEAR(static_cast<double>(total), 40000 * kPi / 4.0, 200.0);
}

TEST(Profile, EmptyBinsHaveNoVelocity) {
  Profile profile = empty_profile({ProfileAxis::x, 3, make_world(3.0, 1.0, Boundary::walls), 1e-6});
  const Vec2i position{0, 0};
  const Vec2f velocity{2.0F, 1.0F};
  add_parcels(profile, &position, &velocity, 1);
  const std::vector<ProfileRow> rows = rows_of(profile, {.radius_m = 0.1});
  EXPECT_TRUE(std::isnan(rows[0].velocity_mps));
  EXPECT_EQ(rows[1].num, 1);
  EXPECT_NEAR(rows[1].velocity_mps, 2.0, 1e-5);
  EXPECT_NEAR(rows[1].speed_mps, 0.0,
              std::sqrt(0.25 * kProfileSquareUnit) * 1e-6);  // half a count of the square
}

TEST(Profile, ADiscInTheMiddleStartsHot) {
  Settings s = unit_gas(20000, 0.1, Boundary::periodic);
  s.parcel_speed_mps = 0.0;
  s.hot_radius_m = 50.0;
  s.hot_speed_mps = 3.0;
  const SceneRun run(s, 1);
  const Profile profile = run.backend->profile(profile_shape(run.physics, ProfileAxis::radius, 198));  // 1 m
  double hot = 0.0, cold = 0.0, num_hot = 0.0;
  for (const ProfileRow& row : rows_of(profile, run.physics.parcels)) {
    if (row.num == 0) continue;
    const double square = (row.speed_mps * row.speed_mps + 0.5 * row.velocity_mps * row.velocity_mps);
    (row.position_m < 49.0 ? hot : cold) +=
        row.position_m > 51.0 || row.position_m < 49.0 ? row.num * square : 0.0;
    if (row.position_m < 49.0) num_hot += static_cast<double>(row.num);
  }
  EXPECT_NEAR(hot / num_hot, 9.0, 1.0);
  EXPECT_EQ(cold, 0.0);
}

}  // namespace
}  // namespace pf
