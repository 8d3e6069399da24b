// The broad phase of method `exact` on the CPU: pairs of bounding discs that overlap, and the candidates for
// collisions with a parcel on a new trajectory.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <vector>

#include "backend/exact/bounding_discs.hpp"
#include "model/exact/step_plan.hpp"

namespace pf {

// Discs of parcels sorted into cells, and bounds that hold for all of them.
struct DiscSpace {
  const float* x = nullptr;  // num_parcels + kSearchPadding each
  const float* y = nullptr;
  const float* radius = nullptr;
  const std::uint32_t* owner = nullptr;  // cluster; kInvalidIndex: the parcel's path stays within its disc
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  World world;
  std::uint32_t num_parcels = 0;
  bool all_pairs = false;
  // A search box extends this far beyond a disc's radius. It holds the sorted positions of all parcels whose
  // discs overlap it (reach), and of all owned ones that may touch it in the step (reach_owned).
  std::int32_t reach = 0;
  std::int32_t reach_owned = 0;
  float owned_radius = 0.0F;  // around the centre of an owned parcel's disc: holds all that it may touch
};

// Limits the reach of a search box, so that its sides stay within 32 bits.
inline std::int32_t saturated_reach(double units) {
  return static_cast<std::int32_t>(std::min(units, kMaxReach));
}

// Reach of a search box that holds the positions at a step's start of parcels with speed at most speed_mps
// whose discs overlap the central one.
std::int32_t reach_of(const ExactConstants& c, double speed_mps);

// Sets world, reaches and owned_radius for a step. fastest_mps: bound on the parcels' speeds at its start.
// max_displacement: bound on displacements along an axis since the sort, position units.
void set_reaches(const ExactConstants& c, double fastest_mps, std::int64_t max_displacement,
                 DiscSpace& space);

struct IndexPair {
  std::uint32_t first, second;
  auto operator<=>(const IndexPair&) const = default;  // NOLINT(modernize-use-nullptr): it takes 0 for one
};

// Result of a search for pairs, and its working memory; one per thread.
struct DiscPairs {
  CandidateRanges ranges;
  std::vector<IndexPair> candidates;
};

// A parcel on another trajectory than that of its disc in the space.
struct Mover {
  std::uint32_t index;
  Disc disc;
};

// Parcels that a mover may collide with, and the working memory of their search.
struct Candidates {
  CandidateRanges ranges;
  std::vector<std::uint32_t> overlapping;  // their discs overlap
  std::vector<std::uint32_t> owned;        // their discs do not, but clusters own them and they may touch it
};

struct DiscSearch {
  // Sets pairs.candidates to all (i, j), begin <= i < end, j > i, whose discs overlap.
  void (*find_pairs)(const DiscSpace& space, std::uint32_t begin, std::uint32_t end, DiscPairs& pairs);
  // Sets candidates to the parcels that the mover may collide with, itself excluded.
  void (*find_candidates)(const DiscSpace& space, const Mover& mover, Candidates& candidates);
  // The same for two movers near each other. They share a search box, so `owned` may hold a few more.
  void (*find_candidates_of_two)(const DiscSpace& space, const Mover (&movers)[2],
                                 Candidates (&candidates)[2]);
};

// The fastest search that this processor runs.
DiscSearch choose_disc_search(Boundary boundary);
// Plain loops, which the others are tested against.
DiscSearch plain_disc_search(Boundary boundary);
// For x86-64 processors that have AVX2.
DiscSearch avx2_disc_search(Boundary boundary);

}  // namespace pf
