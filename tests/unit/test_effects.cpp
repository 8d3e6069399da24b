// The effects of changed settings on a flight, as the table of settings states them.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.hpp"
#include "scene/settings.hpp"
#include "support/scene_support.hpp"

namespace pf {
namespace {

// A short flight in which every setting has something to affect.
Settings flight() {
  Settings s = test::court(400);
  s.method = Method::exact;
  s.profile = ProfileAxis::x;
  s.drawn_area_fraction = 0.2;
  return s;
}

// The settings with another allowed value of a field.
Settings changed(const Field& field, Settings settings) {
  const Settings before = settings;
  for (const char* text :
       {"1", "2", "0.5", "true", "false", "all-pairs", "radius", "ring", "spring", "off", "another"}) {
    try {
      set_from_text(field, settings, text, "test");
    } catch (const UserError&) {
      continue;
    }
    if (!is_same(field, before, settings)) return settings;
  }
  ADD_FAILURE() << "no other value of " << field.path();
  return settings;
}

bool is_of_next_launch(const Field& field) {
  const std::string path = field.path();
  return path == "ball.x_m" || path == "ball.y_m" || path == "ball.vx_mps" || path == "ball.vy_mps";
}

std::uint64_t hash_after_flight(const Settings& settings) {
  constexpr std::uint32_t num_steps = 100;
  SceneRun run(settings);
  run.advance(num_steps, 1e-3);
  return run.backend->state_hash();
}

TEST(Effects, OthersLeaveTheFlightAsItIs) {
  const std::uint64_t expected = hash_after_flight(flight());
  int num_tried = 0;
  for (const Field& field : fields()) {
    if (field.effects.flight || is_of_next_launch(field)) continue;
    EXPECT_EQ(hash_after_flight(changed(field, flight())), expected) << field.path();
    ++num_tried;
  }
  EXPECT_GT(num_tried, 10);
}

TEST(Effects, OthersLeaveTheParcelsAsTheyStart) {
  const ParcelSnapshot expected = SceneRun(flight()).backend->snapshot();
  for (const Field& field : fields()) {
    if (field.effects.parcels || is_of_next_launch(field)) continue;
    const ParcelSnapshot start = SceneRun(changed(field, flight())).backend->snapshot();
    EXPECT_TRUE(start.position == expected.position) << field.path();
    EXPECT_TRUE(start.velocity == expected.velocity) << field.path();
  }
}

TEST(Effects, DifferLooksAtTheirSettingsAlone) {
  const Settings a = flight();
  Settings b = a;
  b.threads = 3;
  b.ball_vx_mps += 1.0;
  EXPECT_TRUE(differ(a, b, &Effects::cost));
  EXPECT_FALSE(differ(a, b, &Effects::flight));
  EXPECT_FALSE(differ(a, b, &Effects::parcels));
  b.seed = 9;
  EXPECT_TRUE(differ(a, b, &Effects::flight));
  EXPECT_TRUE(differ(a, b, &Effects::parcels));
  EXPECT_EQ(only(a, &Effects::parcels).num_parcels, 400);
  EXPECT_EQ(only(b, &Effects::flight).threads, Settings{}.threads);
}

}  // namespace
}  // namespace pf
