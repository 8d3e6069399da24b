// The scenes of the golden hashes: every method and boundary, with and without a ball, and rare cases. The
// tests of CPU and GPU compare the same scenes with the same file.
#pragma once

#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "support/scene_support.hpp"

namespace pf::test {

struct GoldenScene {
  std::string name;  // without blanks
  Settings settings;
  std::uint32_t num_steps = 0;
  double dt_s = 0.0;                     // 0: that of the scene's first frame
  void (*prepare)(SceneRun&) = nullptr;  // changes the spawned scene first; null: no change
};

inline GoldenScene golden(std::string name, const Settings& settings, std::uint32_t num_steps, double dt_s,
                          void (*prepare)(SceneRun&) = nullptr) {
  return {std::move(name), settings, num_steps, dt_s, prepare};
}

// A ball of 5 parcel radii and 20 parcel masses, with velocity, spin, friction and Magnus effect.
inline Settings with_golden_ball(Settings s) {
  s.ball_present = true;
  s.ball_radius_m = 2.5;
  s.ball_mass_kg = 20.0;
  s.ball_x_m = 1.0;
  s.ball_y_m = -2.0;
  s.ball_vx_mps = 3.0;
  s.ball_vy_mps = -1.0;
  s.ball_spin_radps = 1.5;
  s.friction = 0.3;
  s.k_magnus = 2.0;
  return s;
}

inline Settings golden_gas(Method method, Boundary boundary, double restitution = 0.9,
                           double area_fraction = 0.3) {
  Settings s = gas(200, area_fraction, boundary);
  s.width_m = 1.4;  // different sides
  s.method = method;
  s.restitution = restitution;
  return s;
}

// Groups of three parcels, in groups that touch: some parcels coincide, all overlap.
inline void crowd_together(SceneRun& run) {
  ParcelSnapshot state = run.backend->snapshot();
  const std::int32_t diameter = static_cast<std::int32_t>(1.0 / run.physics.world.unit_m);
  for (std::size_t i = 0; i < state.position.size(); ++i) {
    const auto column = static_cast<std::int32_t>(i / 3 % 8), row = static_cast<std::int32_t>(i / 24);
    state.position[i] = {(column - 4) * (diameter / 10 * 9), (row - 4) * (diameter / 10 * 9)};
    if (i % 3 == 2) state.position[i] = {state.position[i].x + diameter / 3, state.position[i].y - diameter};
  }
  run.backend->restore(state);
}

// The ball's centre is on the edge of a periodic world, and each parcel's centre half a world away. Its two
// images are equally near, and the ball is large enough to overlap both. Half of the parcels approach it.
inline void put_half_a_world_away(SceneRun& run) {
  BallState ball = run.ball;
  ball.position_m = {-run.physics.world.half.x * run.physics.world.unit_m, 0.0};
  run.backend->set_ball(ball);
  ParcelSnapshot state = run.backend->snapshot();
  for (std::size_t i = 0; i < state.position.size(); ++i) {
    state.position[i] = {0, (static_cast<std::int32_t>(i) - 2) << 20};
    state.velocity[i] = {i % 2 == 0 ? 1.0F : -1.0F, 0.25F};
  }
  run.backend->restore(state);
}

// A state left by another method: parcels overlap the ball and each other.
inline void step_with_impulse(SceneRun& run) {
  run.settings.method = Method::impulse;
  run.advance(25, 0.1);
  run.settings.method = Method::exact;
}

// Cools until ticks are long, then a parcel becomes fast again.
inline void cool_and_kick(SceneRun& run) {
  run.advance(1, 2e4);
  BallState ball = run.ball;
  ball.velocity_mps = {1.0, 0.3};
  run.backend->set_ball(ball);
}

// Velocities of NaN, too fast for the world, and the largest finite ones.
inline void break_some(SceneRun& run) {
  ParcelSnapshot state = run.backend->snapshot();
  state.velocity[3] = {1e20F, 0.0F};
  state.velocity[5] = {1e12F, -1e12F};
  state.velocity[7] = {400.0F, -300.0F};
  run.backend->restore(state);
}

// One parcel crosses the periodic world many times while the trajectories of others stay unchanged.
inline void make_one_fast(SceneRun& run) {
  ParcelSnapshot state = run.backend->snapshot();
  state.velocity[7] = {40.0F, -30.0F};
  run.backend->restore(state);
}

// A ball that returns from beyond a wall.
inline void put_beyond_a_wall(SceneRun& run) {
  BallState ball = run.ball;
  ball.position_m.x = run.physics.world.half.x * run.physics.world.unit_m + 0.1;
  ball.velocity_mps = {-1.0, 2.0};
  run.backend->set_ball(ball);
}

// Every method in every world, without a ball and with one.
inline void add_methods(std::vector<GoldenScene>& list) {
  struct Pace {
    Method method;
    const char* name;
    std::uint32_t num_steps;
    double dt_s;
  };
  const Pace paces[] = {{Method::impulse, "impulse", 80, 0.04},
                        {Method::spring, "spring", 300, 0.005},
                        {Method::exact, "exact", 30, 0.1}};
  const char* worlds[] = {"open", "walls", "periodic"};
  for (const Pace& pace : paces) {
    for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
      const std::string name = std::string(pace.name) + "_" + worlds[static_cast<int>(boundary)];
      const Settings alone = golden_gas(pace.method, boundary);
      list.push_back(golden(name, alone, pace.num_steps, pace.dt_s));
      list.push_back(golden(name + "_ball", with_golden_ball(alone), pace.num_steps, pace.dt_s));
    }
  }
}

// Further cases of the time-stepped methods.
inline void add_stepped(std::vector<GoldenScene>& list) {
  Settings s = court(600);
  list.push_back(golden("court", s, 250, 0.0));
  s.boundary = Boundary::walls;  // a light gas, a fast ball from wall to wall
  s.ball_vx_mps = 40.0;
  s.ball_vy_mps = 25.0;
  list.push_back(golden("court_walls", s, 200, 0.005));
  s.boundary = Boundary::periodic;
  s.neighbors = Neighbors::all_pairs;
  list.push_back(golden("court_periodic_all_pairs", s, 200, 0.005));

  s = with_golden_ball(golden_gas(Method::impulse, Boundary::periodic, 0.7));
  s.ball_held = true;
  s.flow_x_mps = 2.0;
  s.flow_y_mps = 0.5;
  s.friction = 5.0;
  list.push_back(golden("held_ball_in_a_stream", s, 80, 0.04));
  s.contacts = false;
  list.push_back(golden("held_ball_without_contacts", s, 80, 0.04));

  s = golden_gas(Method::impulse, Boundary::walls, 0.0);
  s.impulse_scale = 0.7;
  list.push_back(golden("impulse_scaled", s, 80, 0.04));
  list.push_back(
      golden("impulse_broken", golden_gas(Method::impulse, Boundary::walls), 20, 0.01, break_some));
  list.push_back(
      golden("impulse_crowd", golden_gas(Method::impulse, Boundary::walls), 60, 0.02, crowd_together));
  list.push_back(
      golden("impulse_dense", golden_gas(Method::impulse, Boundary::periodic, 1.0, 0.65), 100, 0.04));
  list.push_back(golden("spring_crowd", golden_gas(Method::spring, Boundary::periodic, 0.5), 200, 0.005,
                        crowd_together));
}

// A ball about as large as its periodic world.
inline void add_large_ball(std::vector<GoldenScene>& list) {
  Settings s = gas(4, 0.02, Boundary::periodic);
  s.ball_present = true;
  s.ball_radius_m = 6.0;
  s.ball_mass_kg = 50.0;
  s.contacts = false;
  s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_spin_radps = 0.0;
  list.push_back(golden("half_a_world_away", s, 30, 0.05, put_half_a_world_away));
}

// The ball alone.
inline void add_flights(std::vector<GoldenScene>& list) {
  Settings s = court(0, Boundary::walls);
  s.air = Air::vacuum;
  list.push_back(golden("ball_vacuum_walls", s, 400, 0.02));
  list.push_back(golden("ball_beyond_a_wall", s, 100, 0.02, put_beyond_a_wall));
  s.boundary = Boundary::periodic;
  s.ball_vy_mps = 9.0;
  s.ball_spin_radps = 1e-3;  // small angles, for which a series is used
  list.push_back(golden("ball_vacuum_periodic", s, 400, 0.02));
  s.air = Air::drag;
  s.ball_spin_radps = 40.0;
  list.push_back(golden("ball_drag", s, 400, 0.02));
}

// A ball that pushes up a layer of inelastic parcels, with the default contact duration.
inline Settings layer_in_a_court() {
  Settings s = court(1000);
  s.method = Method::exact;
  s.restitution = 0.3;
  s.area_fraction = 0.3;
  return s;
}

// Rare cases of `exact`.
inline void add_exact(std::vector<GoldenScene>& list) {
  Settings s = court(400, Boundary::walls);
  s.method = Method::exact;
  s.contact_clock = 0.0;
  list.push_back(golden("exact_court_walls", s, 120, 0.0));
  s.neighbors = Neighbors::all_pairs;
  s.ball_vx_mps = -15.0;  // to the wall at once
  s.ball_vy_mps = 20.0;
  list.push_back(golden("exact_court_all_pairs", s, 60, 0.005));
  list.push_back(golden("exact_court_default_clock", layer_in_a_court(), 150, 0.0));

  s = golden_gas(Method::exact, Boundary::periodic, 0.6, 0.6);
  s.contact_clock_s = 0.05;
  list.push_back(golden("exact_clock", s, 40, 0.05));
  s = golden_gas(Method::exact, Boundary::walls, 1.0, 0.65);
  s.dt_s = 0.0;  // from the collision rate
  s.time_scale = 10.0;
  list.push_back(golden("exact_dense_elastic", s, 200, 0.0));
  list.push_back(golden("exact_dilute_one_fast", golden_gas(Method::exact, Boundary::periodic, 1.0, 0.003),
                        60, 0.5, make_one_fast));
  list.push_back(
      golden("exact_without_restitution", golden_gas(Method::exact, Boundary::walls, 0.0), 20, 0.1));
  list.push_back(golden("exact_crowd", golden_gas(Method::exact, Boundary::walls), 40, 0.05, crowd_together));

  list.push_back(
      golden("exact_one_fast", golden_gas(Method::exact, Boundary::periodic), 20, 0.05, make_one_fast));
  list.push_back(
      golden("exact_dilute_long_steps", golden_gas(Method::exact, Boundary::periodic, 0.2, 0.003), 2, 17.0));

  s = with_golden_ball(golden_gas(Method::exact, Boundary::walls));
  s.magnus = false;  // the ball flies straight, from event to event and from wall to wall
  s.ball_vx_mps = 12.0;
  list.push_back(golden("exact_straight_ball", s, 30, 0.1));
  list.push_back(golden("exact_after_impulse", s, 20, 0.1, step_with_impulse));
  s.ball_mass_kg = 0.3;
  list.push_back(golden("exact_light_ball", s, 40, 0.1));
  s = with_golden_ball(golden_gas(Method::exact, Boundary::periodic));
  s.ball_mass_kg = 1e9;  // frozen
  s.k_magnus = 1e8;
  list.push_back(golden("exact_frozen_ball", s, 40, 0.1));
  s.ball_held = true;
  s.flow_x_mps = 2.0;
  list.push_back(golden("exact_held_ball", s, 40, 0.1));

  s = golden_gas(Method::exact, Boundary::periodic, 0.6);
  s.contact_clock_s = 0.02;
  list.push_back(golden("exact_cooling", s, 3, 1e4));
  s = with_golden_ball(golden_gas(Method::exact, Boundary::periodic, 0.6));
  s.ball_vx_mps = s.ball_vy_mps = s.ball_spin_radps = s.friction = 0.0;
  s.magnus = false;
  list.push_back(golden("exact_cold_and_kicked", s, 40, 0.25, cool_and_kick));
}

inline std::vector<GoldenScene> golden_scenes() {
  std::vector<GoldenScene> list;
  add_methods(list);
  add_stepped(list);
  add_large_ball(list);
  add_flights(list);
  add_exact(list);
  return list;
}

using MakeBackend = std::function<std::unique_ptr<Backend>()>;

// A scene's line without its name.
inline std::string golden_line(const GoldenScene& scene, const MakeBackend& make_backend) {
  SceneRun run(scene.settings, make_backend());
  if (scene.prepare != nullptr) scene.prepare(run);
  const StepTotals totals = scene.dt_s > 0.0 ? run.advance(scene.num_steps, scene.dt_s).totals
                                             : run.advance(scene.num_steps).totals;
  char text[128];
  std::snprintf(text, sizeof text, "%016llx %016llx %llu %llu",
                static_cast<unsigned long long>(run.backend->state_hash()),
                static_cast<unsigned long long>(totals.event_hash),
                static_cast<unsigned long long>(totals.num_collisions),
                static_cast<unsigned long long>(totals.num_ball_hits));
  return text;
}

}  // namespace pf::test
