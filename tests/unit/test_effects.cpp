// The effects of changed settings on a flight, as the table of settings states them.
#include <gtest/gtest.h>

#include <algorithm>

#include "app/simulation.hpp"
#include "core/error.hpp"
#include "scene/derive.hpp"
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

// Changed in flight. With losses and `exact` a contact duration follows from the speed of the ball's launch.
TEST(Effects, OthersLeaveAFlightUnderWayAsItIs) {
  Settings settings = flight();
  settings.restitution = 0.5;
  settings.dt_s = 1e-3;
  settings.substeps = 10;
  settings.threads = 1;
  const auto hash_with_change_to = [](const Settings& begun, const Field* field) {
    Simulation simulation(begun, make_cpu_backend(1));
    for (int k = 0; k < 4; ++k) simulation.advance_frame({}, nullptr);
    Commands commands;
    if (field != nullptr) commands.settings = changed(*field, simulation.settings());
    for (int k = 0; k < 6; ++k) {
      simulation.advance_frame(commands, nullptr);
      commands = {};
    }
    EXPECT_EQ(simulation.view().message, "");
    EXPECT_FALSE(simulation.view().flight_record->disturbed);
    return simulation.backend().state_hash();
  };
  for (const Method method : {Method::exact, Method::impulse}) {
    settings.method = method;
    const std::uint64_t expected = hash_with_change_to(settings, nullptr);
    for (const Field& field : fields()) {
      const bool may_be_changed = field.path() != "run.threads" && field.path() != "run.substeps";
      if (field.effects.flight || !may_be_changed) continue;
      EXPECT_EQ(hash_with_change_to(settings, &field), expected) << field.path();
    }
    Settings faster = settings;
    faster.ball_vx_mps = 90.0;
    EXPECT_NE(hash_with_change_to(faster, nullptr), expected);
  }
}

TEST(Effects, TheSpeedOfALaunchCountsFromItOn) {
  Simulation simulation(flight(), make_cpu_backend(1));
  const auto reference_mps = [&] { return simulation.view().physics->reference_speed_mps; };
  const double before_mps = reference_mps();
  Commands commands;
  commands.settings = simulation.settings();
  commands.settings->ball_vx_mps = 70.0;
  simulation.advance_frame(commands, nullptr);
  EXPECT_EQ(reference_mps(), before_mps);
  commands = {};
  commands.launch = true;
  simulation.advance_frame(commands, nullptr);
  EXPECT_EQ(reference_mps(), derive_physics(simulation.settings()).reference_speed_mps);
  EXPECT_GT(reference_mps(), before_mps);
}

// A flight that was launched by itself has other air. A change of no effect leaves its roundings as they are.
TEST(Effects, OthersLeaveALaterFlightAsItIs) {
  Settings settings = flight();
  settings.method = Method::impulse;
  settings.time_scale = 1.0;
  const auto fly = [&](bool with_change) {
    Simulation simulation(settings, make_cpu_backend(1));
    while (simulation.view().flight_record->number < 2) simulation.advance_frame({}, nullptr);
    Commands commands;
    if (with_change) commands.settings = simulation.settings();
    if (with_change) commands.settings->profile = ProfileAxis::off;
    simulation.advance_frame(commands, nullptr);
    for (int k = 0; k < 5; ++k) simulation.advance_frame({}, nullptr);
    return simulation.backend().state_hash();
  };
  EXPECT_EQ(fly(true), fly(false));
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
