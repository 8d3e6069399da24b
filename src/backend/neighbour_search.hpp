// The CPU's cheap first test for contact of one parcel with others. The precise test is the model's. This one
// must not miss a contact, and may use the processor's vector instructions.
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

// Result and working memory of a search, one per thread.
struct SearchScratch {
  std::vector<std::uint32_t> candidates;
  CandidateRanges ranges;
};

// Fills scratch.candidates with the parcels j != i in i's search box whose squared distance is below
// filter_distance2.
using Search = void (*)(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch);

// The fastest search that this processor supports.
Search choose_search(Boundary boundary);
// The plain loop, against which the others are tested.
Search plain_search(Boundary boundary);

}  // namespace pf
