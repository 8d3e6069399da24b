// Parcels with discs at the start of a step, for tests of the broad phase of method exact on the CPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "backend/exact/broad_phase.hpp"
#include "backend/exact/positions_at.hpp"
#include "backend/parcel_arrays.hpp"
#include "model/exact/step_plan.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

// A gas at the start of a step; its parcels flew straight since they were sorted. With many parcels, some
// retired before the sort, some after it, and some have no finite speed.
struct GasMotion {
  double flown = 0.6;             // since the sort, at most; contact distances
  double path = 1.5;              // of the fastest in the step, contact distances
  std::uint32_t fast_period = 0;  // one parcel of so many is 20 times as fast; 0: none
};

struct Gas {
  SceneRun run;
  RunConstants constants;
  ExactConstants c;
  ParcelArrays trajectories;  // anchored at the sorted positions
  std::vector<Vec2i> position;
  std::vector<std::uint32_t> owner, cell_start;
  BoundingDiscs discs;
  DiscSpace space;

  Gas(std::int64_t n, double area_fraction, Boundary boundary, double cell_width, GasMotion motion = {})
      : run(gas(n, area_fraction, boundary)),
        constants(make_run_constants(run.physics, 0.0)),
        c{constants, {}} {
    static_cast<TickScale&>(c.plan) = constants.reference_ticks;
    const ParcelSnapshot snapshot = run.backend->snapshot();
    const auto num = static_cast<std::uint32_t>(snapshot.position.size());
    ParcelArrays parcels;
    parcels.resize(num);
    trajectories.resize(num);
    std::copy(snapshot.position.begin(), snapshot.position.end(), parcels.position.begin());
    std::copy(snapshot.velocity.begin(), snapshot.velocity.end(), parcels.velocity.begin());
    for (std::uint32_t i = 0; i < num; ++i) parcels.id[i] = i;
    for (std::uint32_t i = 5; num >= 40 && i < num; i += 29) parcels.position[i] = {kRetired, 0};
    ThreadTeam team(1);
    CellSort cell_sort;
    PhaseTimes times;
    space.grid = choose_grid(run.physics.world, num, {cell_width / run.physics.world.unit_m, 20.0});
    cell_sort.sort(team, {space.grid, parcels.position.data(), parcels}, {trajectories, cell_start}, times);

    for (std::uint32_t i = 7; num >= 40 && i < num; i += 31) trajectories.position[i] = {kRetired, 0};
    for (std::uint32_t i = 11; num >= 40 && i < num; i += 37)
      trajectories.velocity[i].x = std::numeric_limits<float>::quiet_NaN();
    for (std::uint32_t i = 3; motion.fast_period > 0 && i < num; i += motion.fast_period)
      trajectories.velocity[i] = trajectories.velocity[i] * 20.0F;
    float fastest2 = 0.0F;
    for (std::uint32_t i = 0; i < num; ++i) {
      if (is_live(i)) fastest2 = std::max(fastest2, dot(trajectories.velocity[i], trajectories.velocity[i]));
    }
    const double fastest_mps = std::sqrt(static_cast<double>(fastest2));
    const double ticks_per_diameter = c.run.contact_distance / (fastest_mps * c.plan.units_per_tick);
    const auto age = static_cast<std::uint32_t>(motion.flown * ticks_per_diameter);
    const std::int64_t max_displacement =
        static_cast<std::int64_t>(motion.flown * c.run.contact_distance) + 2;
    c.plan.start = 4000000000U;  // wraps around soon
    c.plan.max_speed_mps = kSpeedMargin * fastest_mps;
    c.plan.length = std::min(static_cast<std::uint32_t>(motion.path * ticks_per_diameter),
                             max_step_ticks(c, max_displacement));
    space.all_pairs = needs_all_pairs(c.run);
    trajectories.tick.assign(num, c.plan.start - age);
    position.resize(num + kSearchPadding);
    positions_at(c, {trajectories.position.data(), trajectories.velocity.data(), trajectories.tick.data()}, 0,
                 0, num, position.data());
    discs.resize(num);
    set_discs({position.data(), trajectories.velocity.data(), units_in_step(), half_contact()}, 0, num,
              discs);
    owner.assign(num + kSearchPadding, kInvalidIndex);  // every third parcel is owned
    for (std::uint32_t i = 0; i < num; i += 3) owner[i] = is_live(i) ? 0 : kInvalidIndex;
    space.x = discs.x.data();
    space.y = discs.y.data();
    space.radius = discs.radius.data();
    space.owner = owner.data();
    space.cell_start = cell_start.data();
    space.num_parcels = num;
    set_reaches(c, fastest_mps, max_displacement, space);
  }

  float units_in_step() const { return static_cast<float>(c.plan.units_per_tick * c.plan.length); }
  float half_contact() const { return static_cast<float>(0.5 * c.run.contact_distance); }
  Trajectory trajectory(std::uint32_t i) const {
    return {trajectories.position[i], trajectories.velocity[i], trajectories.tick[i]};
  }
  bool is_live(std::uint32_t i) const {
    return !is_retired(trajectories.position[i]) &&
           dot(trajectories.velocity[i], trajectories.velocity[i]) < kMaxFiniteSpeed2;
  }
  // The parcel on a trajectory that is turned by a right angle.
  Mover mover(std::uint32_t i) const {
    return {i, bounding_disc(position[i], perpendicular(trajectories.velocity[i]) * units_in_step(),
                             half_contact())};
  }
};

}  // namespace pf::test
