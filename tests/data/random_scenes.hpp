// Small scenes drawn at random: every method, boundary, loss, contact clock, and kind of ball.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "app/simulation.hpp"
#include "support/golden_scenes.hpp"

namespace pf::test {

struct RandomScene {
  Settings settings;
  int num_frames = 0;  // of the whole run
  int saved_after = 0;
  std::string text;
};

// A box of the size that would follow from the parcels: a flight's ghosts need it without them.
inline void in_own_box(Settings& s) {
  const double area_m2 = static_cast<double>(s.num_parcels) * 3.14159265 * 0.25 / s.area_fraction;
  s.width_m = s.height_m = std::sqrt(area_m2);
  s.box_follows_parcels = false;
}

// The first nine have each method in each world.
inline RandomScene random_scene(unsigned number) {
  std::mt19937 random(1000 + number);
  const auto between = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  const auto method = static_cast<Method>(number % 3);
  const auto boundary = static_cast<Boundary>(number / 3 % 3);
  const double losses[] = {1.0, 0.9, 0.5};
  Settings s = gas(between(120, 300), 0.05 * between(1, 13), boundary);
  in_own_box(s);
  s.method = method;
  s.restitution = losses[between(0, 2)];
  s.contact_clock = between(0, 1) * 0.3;  // long, so that contacts are within it
  s.dt_s = method == Method::spring ? 0.004 : 0.02 * between(1, 4);
  s.substeps = method == Method::spring ? 8 : between(1, 4);
  s.seed = between(1, 1000000);
  s.relaunch = false;
  const int ball = between(0, 3);
  if (ball > 0) s = with_golden_ball(s);
  s.ball_held = ball == 2;
  if (ball == 3) s.magnus = false;
  const int num_frames = between(12, 30);
  return {s, num_frames, between(0, num_frames - 1),
          "scene " + std::to_string(number) + ": method " + std::to_string(static_cast<int>(method)) +
              ", world " + std::to_string(static_cast<int>(boundary)) + ", ball " + std::to_string(ball)};
}

// An elastic gas so dense that crowds heat parcels in most steps.
inline RandomScene heating_scene(int saved_after) {
  Settings s = golden_gas(Method::impulse, Boundary::walls, 1.0, 0.65);
  s.num_parcels = 1000;
  s.dt_s = 0.04;
  return {s, 12, saved_after, "dense scene"};
}

struct End {
  std::uint64_t state_hash = 0, event_hash = 0, num_collisions = 0, num_hits = 0, num_steps = 0;
  double simulated_s = 0.0, ball_distance_m = 0.0;
  bool operator==(const End&) const = default;
};

inline void PrintTo(const End& end, std::ostream* out) {
  *out << "state " << std::hex << end.state_hash << ", events " << end.event_hash << std::dec << ", "
       << end.num_collisions << " collisions, " << end.num_hits << " hits, " << end.num_steps << " steps, "
       << end.simulated_s << " s, " << end.ball_distance_m << " m";
}

inline End end_of(Simulation& simulation) {
  const FrameView& view = simulation.view();
  return {simulation.backend().state_hash(),
          view.totals.event_hash,
          view.totals.num_collisions,
          view.totals.num_ball_hits,
          view.totals.num_steps,
          view.simulated_s,
          view.ball_distance_m};
}

inline void advance(Simulation& simulation, int num_frames) {
  for (int frame = 0; frame < num_frames; ++frame) simulation.advance_frame({}, nullptr);
}

}  // namespace pf::test
