// Initial position and velocity of each parcel. They are pure functions of its id, so that spawning is a
// parallel loop or a kernel.
//
// Parcels sit on the sites of a lattice whose odd rows are shifted by half a spacing. Sites that the ball
// covers stay free. A random vector, shorter than half the gap between neighbours, moves each parcel off its
// site. Velocities are Maxwellian. Parcels i and i + N/2 get opposite velocities, so that the total momentum
// is zero; with a hot disc only nearly.
#pragma once

#include <cstdint>

#include "core/random.hpp"
#include "model/contact.hpp"

namespace pf {

// Lattice and velocities, planned on the host by class Spawner of scene/derive.hpp. row_start: num_rows + 1
// entries, free sites before each row. row_blocked_first and row_blocked_count: num_rows entries, the run of
// sites that the ball blocks; in a periodic world the run may wrap.
struct SpawnPlan {
  std::uint32_t num_parcels = 0;
  std::uint32_t num_rows = 0;
  std::uint32_t num_columns = 0;
  double spacing_x_m = 0.0;
  double spacing_y_m = 0.0;
  Vec2d first_site_m;
  double jitter_m = 0.0;
  double speed_mps = 0.0;
  double hot_radius_m = 0.0;  // parcels this near to the origin have hot_speed_mps instead; 0: none
  double hot_speed_mps = 0.0;
  Vec2d flow_mps;
  std::uint64_t seed = 0;
  World world;
  const std::uint64_t* row_start = nullptr;
  const std::uint32_t* row_blocked_first = nullptr;
  const std::uint32_t* row_blocked_count = nullptr;
};

PF_HD inline Vec2d site_position_m(const SpawnPlan& plan, std::uint64_t site) {
  std::uint32_t low = 0, high = plan.num_rows;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    (plan.row_start[middle] <= site ? low : high) = middle;
  }
  std::uint64_t column = site - plan.row_start[low];
  const std::uint32_t first = plan.row_blocked_first[low];
  const std::uint32_t count = plan.row_blocked_count[low];
  const std::uint32_t wrapped = first + count > plan.num_columns ? first + count - plan.num_columns : 0;
  column += wrapped;
  if (column >= first) column += count - wrapped;
  const double shift = low % 2 == 1 ? 0.5 : 0.0;
  return {plan.first_site_m.x + (static_cast<double>(column) + shift) * plan.spacing_x_m,
          plan.first_site_m.y + low * plan.spacing_y_m};
}

// Two independent standard normal numbers (Box and Muller 1958).
PF_HD inline Vec2d normal_pair(std::uint64_t seed, std::uint64_t id) {
  const double radius = sqrt(-2.0 * natural_log(uniform(random_bits(seed, id, 1))));
  const SinCos angle = sin_cos(2.0 * kPi * uniform(random_bits(seed, id, 2)));
  return {radius * angle.cos, radius * angle.sin};
}

// Wraps a position in a periodic world: the random shift may cross the edge.
PF_HD inline Vec2i wrapped_into(const World& world, Vec2i position) {
  if (world.boundary != Boundary::periodic) return position;
  return {axis_separation<Boundary::periodic>(0, position.x, world.half.x),
          axis_separation<Boundary::periodic>(0, position.y, world.half.y)};
}

PF_HD inline Parcel spawn_parcel(const SpawnPlan& plan, std::uint64_t num_free_sites, std::uint32_t id) {
  const std::uint64_t site =
      num_free_sites / plan.num_parcels * id + num_free_sites % plan.num_parcels * id / plan.num_parcels;
  const double angle = 2.0 * kPi * uniform(random_bits(plan.seed, id, 3));
  const double radius = plan.jitter_m * sqrt(uniform(random_bits(plan.seed, id, 4)));
  const SinCos direction = sin_cos(angle);
  const Vec2d position = site_position_m(plan, site) + Vec2d{direction.cos, direction.sin} * radius;

  const std::uint32_t half = plan.num_parcels / 2;
  const bool mirrored = id >= half && id < 2 * half;
  const bool hot = plan.hot_radius_m > 0.0 && dot(position, position) < plan.hot_radius_m * plan.hot_radius_m;
  const double speed_mps = hot ? plan.hot_speed_mps : plan.speed_mps;
  const Vec2d thermal = normal_pair(plan.seed, mirrored ? id - half : id) * speed_mps;
  const Vec2d velocity = plan.flow_mps + (mirrored ? -thermal : thermal);
  return {wrapped_into(plan.world, to_units(plan.world, position)), to_float(velocity), id};
}

}  // namespace pf
