// Counting sort of the parcels by cell, stable, in parallel.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/neighbour_search.hpp"
#include "core/thread_team.hpp"
#include "core/timing.hpp"
#include "model/grid.hpp"

namespace pf {

// Parcels in memory order, as many as there are ids; positions carry padding for the search.
struct ParcelArrays {
  std::vector<Vec2i> position;
  std::vector<Vec2f> velocity;
  std::vector<std::uint32_t> id;
  // Method `exact` only, else empty: position is where a parcel's last event was, tick when.
  std::vector<std::uint32_t> tick;
  std::vector<std::uint32_t> last_contact_tick;  // with a parcel or a wall, for the TC model; else empty

  void resize(std::size_t n) {
    position.resize(n + kSearchPadding);
    velocity.resize(n + kSearchPadding);
    id.resize(n);
    tick.clear();
    last_contact_tick.clear();
  }
};

class CellSort {
 public:
  // Copies from -> to in the order of the cells of `where` (from's order), parcels of one cell in their old
  // order, retired ones last.
  // cell_start: becomes num_cells() + 2 entries; [k], [k + 1] bound cell k. Times go to Phase::sort and
  // Phase::grid.
  void sort(ThreadTeam& team, const GridShape& grid, const Vec2i* where, const ParcelArrays& from,
            ParcelArrays& to, std::vector<std::uint32_t>& cell_start, PhaseTimes& times);

  std::uint64_t memory_bytes() const { return 4 * (keys_.capacity() + offsets_.capacity()); }

 private:
  void count(ThreadTeam& team, const GridShape& grid, const Vec2i* where, std::size_t num_parcels);
  void accumulate(ThreadTeam& team, std::vector<std::uint32_t>& cell_start);
  void scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to);

  // Slices of the parcels that are counted apart; more of them would cost memory for each cell.
  static constexpr unsigned kMaxSlices = 4;

  std::size_t num_keys_ = 0;
  unsigned num_slices_ = 1;
  std::vector<std::uint32_t> keys_;     // one per parcel
  std::vector<std::uint32_t> offsets_;  // num_slices_ x num_keys_: counts, then places
  std::vector<std::uint32_t> chunk_sums_;
};

}  // namespace pf
