// Constants of a scene for all formulas: plain data in SI units, passed by value to kernels. scene/derive.hpp
// makes them from checked settings.
#pragma once

#include <cstdint>

#include "model/world.hpp"

namespace pf {

// Model of the air.
enum class Air : std::uint8_t { vacuum, drag, parcels };

enum class Method : std::uint8_t { impulse, spring, exact };

// Search for partners of contacts.
enum class Neighbors : std::uint8_t { grid, all_pairs };

struct ParcelConstants {
  std::uint32_t num = 0;
  double radius_m = 0.0;
  double mass_kg = 0.0;
  double speed_mps = 0.0;      // standard deviation per component at spawning, c = sqrt(kT/m)
  double restitution = 1.0;    // parcel-parcel and parcel-ball, in [0, 1]
  double impulse_scale = 1.0;  // the seed's k: multiplies parcel-parcel velocity changes
  bool contacts = true;        // parcels collide with each other
};

struct BallConstants {
  bool exists = true;
  bool held = false;  // it stays, whatever its velocity is, and its spin does not change; impulses on it are
                      // still summed
  double mass_kg = 0.026;
  double radius_m = 0.185;
  double inertia_kg_m2 = 0.0;
  double friction = 0.0;        // Coulomb coefficient at the contact with a parcel
  double magnus_per_rad = 0.0;  // turn rate of the velocity per spin: k_M / m_b [1/rad]
  double drag_per_m = 0.0;      // of closed-form drag, dv/dt = -drag |v| v; 0 unless air = drag
};

struct Physics {
  World world;
  ParcelConstants parcels;
  BallConstants ball;
  double reference_speed_mps = 1.0;  // fixes the units of velocity and impulse sums, and ticks, for a flight
  std::uint64_t seed = 1;
};

// Double precision: a hit changes the ball's velocity by 1e-6 of the parcel's, which float does not resolve.
struct BallState {
  Vec2d position_m;
  Vec2d velocity_mps;
  double spin_radps = 0.0;  // counter-clockwise seen from above
  double angle_rad = 0.0;   // since the start; only drawn

  bool operator==(const BallState&) const = default;
};

}  // namespace pf
