// The CPU's cheap first test: which parcels may touch one parcel. The precise test is the model's; this one
// only must not miss, so it may use what the processor has.
#pragma once

#include <cstdint>
#include <vector>

#include "model/exact.hpp"
#include "model/grid.hpp"

namespace pf {

// Entries after the last parcel that a search may read (and ignores).
constexpr std::size_t kSearchPadding = 8;
constexpr std::uint32_t kNone = 0xFFFFFFFFU;

struct SearchSpace {
  const Vec2i* position = nullptr;  // num_parcels + kSearchPadding
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  World world;
  std::uint32_t num_parcels = 0;
  std::int32_t reach = 0;         // half side of the search box, position units
  float filter_distance2 = 0.0F;  // position units squared
  bool all_pairs = false;
  // Of the searches for those that meet (may_meet, model/exact.hpp):
  const Vec2f* velocity = nullptr;       // num_parcels + kSearchPadding, at the step's begin
  float contact = 0.0F;                  // position units
  float units_in_step_per_mps = 0.0F;    // position units that a speed of 1 m/s covers in the step
  const std::uint32_t* owner = nullptr;  // num_parcels + kSearchPadding; kNone: on the line of the begin
  Vec2i line_begin = {};  // where the parcel would have been at the begin on the line that it has now
  Vec2f line_velocity = {};
};

// What a search leaves, and its working memory; one per thread.
struct SearchScratch {
  static constexpr int kMostRanges = 64;
  struct Range {
    std::uint32_t first, last;
  };
  std::vector<std::uint32_t> finds;
  Range ranges[kMostRanges];
  int num_ranges = 0;
};

enum class Wanted : std::uint8_t {
  near,           // squared distance below filter_distance2
  meeting_later,  // of higher index, and may_meet on the lines of the begin: each pair is found once
  reachable,      // near, and either owned or may_meet, i being on the line given
};

// Fills scratch.finds with the wanted parcels j != i of i's search box.
using Search = void (*)(const SearchSpace& space, std::uint32_t i, SearchScratch& scratch);

// The fastest search that this processor runs.
Search choose_search(Boundary boundary, Wanted wanted = Wanted::near);
// The plain loop, which the others are tested against.
Search plain_search(Boundary boundary, Wanted wanted = Wanted::near);

}  // namespace pf
