// The world: a rectangle centred on the origin. Positions in it are fixed-point integers.
//
// A position is two signed 32-bit integers in units of (larger side) / 2^31. Coordinates along the larger
// side span [-2^30, 2^30]; half of the integer range is margin. Differences of positions are exact and do not
// depend on the place in the world.
#pragma once

#include <cstdint>

#include "core/portable_math.hpp"
#include "core/vec2.hpp"

namespace pf {

// Effect of the edge on a parcel, in this order: it is retired; it is reflected elastically; it enters on the
// other side.
enum class Boundary : std::uint8_t { open, walls, periodic };

constexpr std::int32_t kHalfSide = 1 << 30;
constexpr std::int32_t kRetired = INT32_MIN;  // position.x of a retired parcel; no live parcel has it

struct World {
  Vec2i half{kHalfSide, kHalfSide};  // half extents, position units
  double unit_m = 1.0;               // metres per position unit
  Boundary boundary = Boundary::open;
};

// width_m, height_m > 0. The larger one sets the unit.
inline World make_world(double width_m, double height_m, Boundary boundary) {
  const double larger_m = width_m > height_m ? width_m : height_m;
  World world;
  world.unit_m = larger_m / 2147483648.0;
  world.half.x = static_cast<std::int32_t>(round_to_int64(0.5 * width_m / world.unit_m));
  world.half.y = static_cast<std::int32_t>(round_to_int64(0.5 * height_m / world.unit_m));
  world.boundary = boundary;
  return world;
}

PF_HD inline Vec2d to_metres(const World& world, Vec2i position) {
  return {position.x * world.unit_m, position.y * world.unit_m};
}

PF_HD inline Vec2d size_m(const World& world) { return to_metres(world, world.half) * 2.0; }
PF_HD inline double area_m2(const World& world) {
  const Vec2d size = size_m(world);
  return size.x * size.y;
}

// metres: within the world's integer range, |coordinate| < larger side.
PF_HD inline Vec2i to_units(const World& world, Vec2d metres) {
  return {static_cast<std::int32_t>(round_to_int64(metres.x / world.unit_m)),
          static_cast<std::int32_t>(round_to_int64(metres.y / world.unit_m))};
}

PF_HD inline bool is_retired(Vec2i position) { return position.x == kRetired; }

// to - from along one axis, of the nearest image where the world is periodic (period 2 half). Wraps modulo
// 2^32 by design.
template <Boundary kBoundary>
PF_HD inline std::int32_t axis_separation(std::int32_t from, std::int32_t to, std::int32_t half) {
  std::int32_t d =
      static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
  if constexpr (kBoundary == Boundary::periodic) {
    const std::uint32_t period = 2U * static_cast<std::uint32_t>(half);
    if (d >= half) {
      d = static_cast<std::int32_t>(static_cast<std::uint32_t>(d) - period);
    } else if (d < -half) {
      d = static_cast<std::int32_t>(static_cast<std::uint32_t>(d) + period);
    }
  }
  return d;
}

template <Boundary kBoundary>
PF_HD inline Vec2i separation(const World& world, Vec2i from, Vec2i to) {
  return {axis_separation<kBoundary>(from.x, to.x, world.half.x),
          axis_separation<kBoundary>(from.y, to.y, world.half.y)};
}

// Not inlined, because it is rarely needed.
PF_HD_RARE inline double offset_of_far_image(double offset, double there, double half) {
  const double period = 2.0 * half;
  return offset - period * static_cast<double>(round_to_int64(there / period));
}

// Of an offset along an axis on which the world repeats after 2 half, in any unit, that of the image which is
// nearest where the offset is `there`. An offset that stays has its bits wherever `there` is.
PF_HD inline double offset_of_image(double offset, double there, double half) {
  if (there < half && there > -half) return offset;
  return offset_of_far_image(offset, there, half);
}

// That of the nearest image.
PF_HD inline double nearest_image(double offset, double half) {
  return offset_of_image(offset, offset, half);
}

// offset: position units.
template <Boundary kBoundary>
PF_HD inline Vec2d nearest_image(const World& world, Vec2d offset) {
  if constexpr (kBoundary != Boundary::periodic) return offset;
  return {nearest_image(offset.x, world.half.x), nearest_image(offset.y, world.half.y)};
}

}  // namespace pf
