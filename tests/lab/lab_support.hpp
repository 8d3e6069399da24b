// Gases for the tests of the lab: unit diameter, mass and speed per component.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "lab/reference.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

// Places parcels of unit diameter at random, one by one. They overlap neither each other nor the walls or the
// ball. Area fractions up to 0.4.
inline std::vector<ReferenceParcel> random_gas(const Physics& physics, const BallState& ball,
                                               std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const Vec2d half = to_metres(physics.world, physics.world.half);
  const bool periodic = physics.world.boundary == Boundary::periodic;
  const auto far_enough = [&](Vec2d a, Vec2d b, double distance) {
    Vec2d e = a - b;
    if (periodic) e = {std::remainder(e.x, 2.0 * half.x), std::remainder(e.y, 2.0 * half.y)};
    return dot(e, e) > distance * distance;
  };
  const double margin = periodic ? 0.0 : physics.parcels.radius_m;
  std::vector<ReferenceParcel> parcels;
  while (parcels.size() < physics.parcels.num) {
    const Vec2d at{(2.0 * unit() - 1.0) * (half.x - margin), (2.0 * unit() - 1.0) * (half.y - margin)};
    bool free = !physics.ball.exists ||
                far_enough(at, ball.position_m, physics.ball.radius_m + physics.parcels.radius_m);
    for (const ReferenceParcel& other : parcels) {
      free = free && far_enough(at, other.position_m, 2.0 * physics.parcels.radius_m);
    }
    if (!free) continue;
    const double speed = std::sqrt(-2.0 * std::log(1.0 - unit())), angle = 2.0 * kPi * unit();
    parcels.push_back({at, {speed * std::cos(angle), speed * std::sin(angle)}, false});
  }
  return parcels;
}

// Parcels of a gas as the backend spawns them, with zero momentum.
struct SpawnedGas {
  Physics physics;
  std::vector<ReferenceParcel> parcels;

  explicit SpawnedGas(const Settings& settings) {
    SceneRun run(settings, 1);
    physics = run.physics;
    parcels = reference_parcels(physics.world, run.backend->snapshot());
  }
};

}  // namespace pf::test
