// Profile of the parcels along x or around a point: density, velocity and temperature by bin. Sums are fixed
// point, so that order, number of threads and device do not matter.
#pragma once

#include <cstdint>

#include "model/parcel.hpp"

namespace pf {

enum class ProfileAxis : std::uint8_t { off, x, radius };  // radius: around the origin

constexpr std::uint32_t kMaxProfileBins = 4096;

struct ProfileShape {
  ProfileAxis axis = ProfileAxis::off;
  std::uint32_t num_bins = 128;  // 1 to kMaxProfileBins, equally wide
  World world;
  double unit_mps = 1.0;  // of the sums; 2^-30 of a power of two near the reference speed
};

constexpr double kProfileSquareUnit = 1073741824.0;  // of ProfileSums::square, in unit_mps^2

// Sums over the parcels of a bin. Velocities are counts of unit_mps.
struct ProfileSums {
  std::int64_t num = 0;
  std::int64_t along = 0;   // velocity along x, or away from the origin
  std::int64_t across = 0;  // along y, or counter-clockwise
  std::int64_t square = 0;  // of the speed, counts of kProfileSquareUnit

  PF_HD void operator+=(const ProfileSums& o) {
    num += o.num;
    along += o.along;
    across += o.across;
    square += o.square;
  }
  bool operator==(const ProfileSums&) const = default;
};

// Extent of the bins: the world's width, or half of its smaller side around the origin.
PF_HD inline double profile_extent_m(const ProfileShape& shape) {
  const Vec2i half = shape.world.half;
  if (shape.axis == ProfileAxis::x) return 2.0 * half.x * shape.world.unit_m;
  return (half.x < half.y ? half.x : half.y) * shape.world.unit_m;
}

struct ProfilePlace {
  std::uint32_t bin = 0;  // num_bins: outside
  Vec2d direction;        // unit vector of `along`
};

PF_HD inline ProfilePlace profile_place(const ProfileShape& shape, Vec2i position) {
  const Vec2i half = shape.world.half;
  if (shape.axis == ProfileAxis::x) {
    const std::int64_t from_edge = static_cast<std::int64_t>(position.x) + half.x;
    const std::int64_t bin = from_edge * shape.num_bins / (2 * static_cast<std::int64_t>(half.x));
    const std::int64_t last = static_cast<std::int64_t>(shape.num_bins) - 1;
    return {static_cast<std::uint32_t>(bin < 0 ? 0 : (bin > last ? last : bin)), {1.0, 0.0}};
  }
  const Vec2d at = to_double(position);
  const double radius = sqrt(dot(at, at));
  const double bin = radius * shape.num_bins / (half.x < half.y ? half.x : half.y);
  if (radius == 0.0) return {0, {1.0, 0.0}};
  return {bin < shape.num_bins ? static_cast<std::uint32_t>(bin) : shape.num_bins,
          {at.x / radius, at.y / radius}};
}

// The sums of one parcel. Components of more than 2^34 units (16 reference speeds) count as that.
PF_HD inline ProfileSums profile_sums(const ProfileShape& shape, Vec2d direction, Vec2f velocity) {
  constexpr double kMax = 17179869184.0;
  const auto clamped = [](double value) { return value > kMax ? kMax : (value < -kMax ? -kMax : value); };
  const Vec2d v = to_double(velocity) * (1.0 / shape.unit_mps);
  const Vec2d u = {clamped(v.x), clamped(v.y)};
  return {1, round_to_int64(dot(u, direction)), round_to_int64(dot(u, perpendicular(direction))),
          round_to_int64(dot(u, u) / kProfileSquareUnit)};
}

}  // namespace pf
