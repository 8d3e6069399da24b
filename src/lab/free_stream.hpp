// The free-molecular wind tunnel: a held ball in a stream of parcels that do not collide with each other.
#pragma once

#include "scene/settings.hpp"

namespace pf {

struct FreeStream {
  double speed_mps = 1.0;    // along x
  double thermal_mps = 1.0;  // standard deviation per component
  double restitution = 1.0;
  double friction = 0.0;
  double spin_radps = 0.0;       // of the ball
  std::uint64_t first_seed = 1;  // of the runs
};

// A periodic square with the ball in the middle and parcels of mass 1. The caller sets the parcels' size and
// velocities.
inline Settings free_stream_settings(const FreeStream& stream, double side_m, double ball_radius_m,
                                     std::int64_t num_parcels) {
  Settings s;
  s.width_m = s.height_m = side_m;
  s.boundary = Boundary::periodic;
  s.num_parcels = num_parcels;
  s.parcel_mass_kg = 1.0;
  s.contacts = false;
  s.restitution = stream.restitution;
  s.ball_held = true;
  s.ball_radius_m = ball_radius_m;
  s.ball_x_m = s.ball_y_m = s.ball_vx_mps = s.ball_vy_mps = 0.0;
  s.ball_spin_radps = stream.spin_radps;
  s.friction = stream.friction;
  s.magnus = false;
  return s;
}

}  // namespace pf
