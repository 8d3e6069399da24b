// Which bounding discs overlap, and whom a parcel on a new line may meet, with what the processor has.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "backend/exact/bounding_discs.hpp"
#include "model/exact/step_plan.hpp"

namespace pf {

// The discs of parcels sorted into cells, and what is known of all of them.
struct DiscSpace {
  const float* x = nullptr;  // num_parcels + kSearchPadding each
  const float* y = nullptr;
  const float* radius = nullptr;
  const std::uint32_t* owner = nullptr;  // kNone: the parcel keeps to its disc
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  World world;
  std::uint32_t num_parcels = 0;
  bool all_pairs = false;
  // Half sides of boxes, less a disc's radius, that hold what it overlaps where that was sorted to: of
  // others' discs, and of owned parcels wherever they may go in the step.
  std::int32_t reach = 0;
  std::int32_t reach_owned = 0;
  float owned_radius = 0.0F;  // around the centre of an owned parcel's disc, of all that it may touch
};

// As the reach of a box must be for its sides to stay within 32 bits.
inline std::int32_t saturated_reach(double units) {
  return static_cast<std::int32_t>(std::min(units, kMaxReach));
}

// Sets world, reaches and owned_radius of a space of discs in a step. fastest_mps: bound on the parcels'
// speeds at its begin; travel: bound on how far along an axis anything has come since it was sorted, position
// units.
void set_reaches(const ExactConstants& c, double fastest_mps, std::int64_t max_displacement, DiscSpace& space);

struct IndexPair {
  std::uint32_t first, second;
};

// The pairs found and working memory of their search; one per thread.
struct DiscPairs {
  CandidateRanges ranges;
  std::vector<IndexPair> found;
};

// A parcel on another line than that of its disc in the space.
struct Mover {
  std::uint32_t index;
  Disc disc;
};

// Whom one may meet from now on.
struct Candidates {
  CandidateRanges ranges;
  std::vector<std::uint32_t> overlapping;  // their discs overlap
  std::vector<std::uint32_t> owned;        // theirs do not, but they are owned and may touch it all the same
};

struct DiscSearch {
  // Fills pairs.found with all (i, j), begin <= i < end, j > i, whose discs overlap.
  void (*overlaps)(const DiscSpace& space, std::uint32_t begin, std::uint32_t end, DiscPairs& pairs);
  // Fills reached with whom the mover may meet, itself not among them.
  void (*reach)(const DiscSpace& space, const Mover& mover, Candidates& candidates);
  // The same of two that are near each other, for both; perhaps with more of the owned ones, as they share a
  // box.
  void (*reach_of_two)(const DiscSpace& space, const Mover (&movers)[2], Candidates (&candidates)[2]);
};

// The fastest that this processor runs.
DiscSearch choose_disc_search(Boundary boundary);
// Plain loops, which the others are tested against.
DiscSearch plain_disc_search(Boundary boundary);
// Of x86-64 processors that have AVX2.
DiscSearch avx2_disc_search(Boundary boundary);

}  // namespace pf
