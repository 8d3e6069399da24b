// The CPU's cheap first test: which parcels may touch one parcel. The precise test is the model's; this one
// only must not miss, so it may use what the processor has.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/candidate_ranges.hpp"

namespace pf {

struct SearchSpace {
  const Vec2i* position = nullptr;  // num_parcels + kSearchPadding
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  World world;
  std::uint32_t num_parcels = 0;
  std::int32_t reach = 0;         // half side of the search box, position units
  float filter_distance2 = 0.0F;  // position units squared
  bool all_pairs = false;
};

// What a search leaves, and its working memory; one per thread.
struct SearchScratch {
  std::vector<std::uint32_t> candidates;
  CandidateRanges ranges;
};

// Fills scratch.finds with the parcels j != i of i's search box whose squared distance is below
// filter_distance2.
using Search = void (*)(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch);

// The fastest search that this processor runs.
Search choose_search(Boundary boundary);
// The plain loop, which the others are tested against.
Search plain_search(Boundary boundary);

}  // namespace pf
