// Bounding discs for the broad phase of method `exact` on the CPU. A parcel's disc holds its path through the
// step with half the contact distance around it. Two parcels can collide only if their discs overlap.
//
// Discs are floats, and wider than necessary by more than the roundings. broad_phase.hpp finds discs that
// overlap; the model decides whether their parcels collide.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "backend/candidate_ranges.hpp"
#include "model/exact/trajectory.hpp"

namespace pf {

struct Disc {
  float x, y, radius;  // position units; a disc whose radius is NaN overlaps nothing
};

// Margins of a disc's radius. A coordinate is below 2^31 and rounded twice, an offset once more.
constexpr float kDiscMargin = 512.0F;
constexpr float kDiscRelative = 1.0F + 1e-5F;

// Disc of a parcel that moves along `path` from `start`, position units.
inline Disc bounding_disc(Vec2i start, Vec2f path, float half_contact) {
  const float length = std::sqrt(path.x * path.x + path.y * path.y);
  return {static_cast<float>(start.x) + 0.5F * path.x, static_cast<float>(start.y) + 0.5F * path.y,
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

// Straight paths of parcels through a step.
struct StepPaths {
  const Vec2i* start;  // positions at the step's start
  const Vec2f* velocity;
  float units_per_mps;  // position units covered in the step at 1 m/s
  float half_contact;   // position units
};

// Speeds of parcels that have not retired.
struct SpeedBounds {
  float max2 = 0.0F;  // (m/s)^2, largest of the finite ones
  bool all_finite = true;
};

// Sets discs begin .. end - 1 and returns bounds on the speeds. A parcel that has retired or has no finite
// speed gets a disc that overlaps nothing.
SpeedBounds set_discs(const StepPaths& paths, std::size_t begin, std::size_t end, BoundingDiscs& discs);

}  // namespace pf
