// Finds pairs of parcels that may touch, each once: among the parcels that follow in the order of cells.
//
// Unlike the search box of neighbour_search.hpp, what is searched does not follow a parcel: it is the rest of
// the parcel's cell, the next cell, and three cells of the next row. So cells must be as wide as the contact
// distance and twice the displacement since the sort, and half as many parcels are tested.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/neighbour_search.hpp"
#include "backend/time_step/rough_positions.hpp"

namespace pf {

struct TouchingPair {
  std::uint32_t first, second;  // places in memory order
};

// Number of parcels in a range: a bit for each of the first eight, and how many there are beyond.
struct ParcelCount {
  static constexpr std::uint32_t kMax = 8 + 254;
  std::uint8_t bits, more;
};

class PairSearch {
 public:
  // Parcels at most this far apart along each axis, position units, are in the same or neighbouring cells.
  static std::int64_t max_reach(const GridShape& grid);

  // Tabulates the ranges of all parcels. To be called after every sort.
  void prepare(ThreadTeam& team, const GridShape& grid, Boundary boundary, std::size_t num_parcels,
               const std::vector<std::uint32_t>& cell_start);
  // Appends the pairs whose first parcel is among begin .. end - 1 and whose squared distance is below
  // space.filter_distance2, with a few others. search: for parcels near a periodic edge, or in a crowd. Only
  // reads positions of parcels from begin to reach(end) + kSearchPadding. Needs AVX2.
  void find(const SearchSpace& space, Search search, const RoughPositions& rough, std::size_t begin,
            std::size_t end, std::vector<TouchingPair>& pairs) const;
  // True if partners of some parcels are found by `search`, which compares them with any.
  bool has_boxes() const { return has_boxes_; }
  // Otherwise parcels before `end` are compared with none from here on.
  std::size_t reach(std::size_t end) const;
  std::uint64_t memory_bytes() const { return sizeof(Ranges) * ranges_.capacity(); }

 private:
  // The candidates of a parcel: those that follow it in its row of cells, and those from next_first on in the
  // row above.
  struct Ranges {
    std::uint32_t next_first;
    ParcelCount own, next;
  };
  static constexpr std::uint8_t kByBox = 255;  // own.more of a parcel whose partners `search` finds

  // Returns true if partners of some are found by box.
  bool prepare_row(const GridShape& grid, Boundary boundary, const std::vector<std::uint32_t>& cell_start,
                   std::size_t row);

  std::size_t num_in_cells_ = 0;  // parcels, without the retired ones that follow
  bool has_boxes_ = false;
  std::vector<Ranges> ranges_;
};

}  // namespace pf
