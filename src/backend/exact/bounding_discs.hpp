// The broad phase of method `exact` on the CPU. A parcel's bounding disc holds its path through the step with
// half the contact distance around it; two parcels can meet only if their discs overlap.
//
// Discs are floats, and wider than they must be by more than the roundings. Which overlap is found by
// disc_search.hpp; whether two parcels whose discs do meet is the model's to say.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "backend/candidate_ranges.hpp"
#include "model/exact/trajectory.hpp"

namespace pf {

struct Disc {
  float x, y, radius;  // position units; no disc overlaps one whose radius is not a number
};

// By how much a disc is wider than it must be: a coordinate is below 2^31 and rounded twice, an offset once
// more.
constexpr float kDiscMargin = 512.0F;
constexpr float kDiscRelative = 1.0F + 1e-5F;

// Of a parcel that moves along `path` from `begin`, position units.
inline Disc bounding_disc(Vec2i begin, Vec2f path, float half_contact) {
  const float length = std::sqrt(path.x * path.x + path.y * path.y);
  return {static_cast<float>(begin.x) + 0.5F * path.x, static_cast<float>(begin.y) + 0.5F * path.y,
          (half_contact + 0.5F * length) * kDiscRelative + kDiscMargin};
}

struct BoundingDiscs {
  std::vector<float> x, y, radius;  // n + kSearchPadding each

  void resize(std::size_t n) {
    for (std::vector<float>* all : {&x, &y, &radius}) all->resize(n + kSearchPadding);
  }
  void set(std::size_t i, const Disc& disc) {
    x[i] = disc.x;
    y[i] = disc.y;
    radius[i] = disc.radius;
  }
  std::uint64_t memory_bytes() const { return 3 * sizeof(float) * x.capacity(); }
};

struct Speeds {
  float largest2 = 0.0F;  // (m/s)^2, of those that are finite
  bool all_finite = true;
};

// Sets discs begin .. end - 1, of parcels that move by `velocity` times path_per_mps from where they are at
// present. That of one that has retired or has no finite speed overlaps nothing. Returns the speeds of those
// that have not retired.
Speeds set_discs(const Vec2i* present, const Vec2f* velocity, float path_per_mps, float half_contact,
                 std::size_t begin, std::size_t end, BoundingDiscs& discs);

}  // namespace pf
