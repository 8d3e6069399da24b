// Counting sort of the parcels by cell, stable, in parallel.
#pragma once

#include <cstdint>
#include <vector>

#include "core/thread_team.hpp"
#include "core/timing.hpp"
#include "model/grid.hpp"

namespace pf {

struct ParcelArrays;

class CellSort {
 public:
  struct Input {
    const GridShape& grid;
    const Vec2i* where;  // position of each parcel; its cell is the key
    const ParcelArrays& parcels;
  };
  struct Output {
    ParcelArrays& parcels;                   // in the order of cells; within a cell in input order
    std::vector<std::uint32_t>& cell_start;  // num_cells() + 2 entries; [k], [k + 1] bound cell k
  };

  // Retired parcels come last. Times are added to Phase::sort and Phase::grid.
  void sort(ThreadTeam& team, const Input& in, const Output& out, PhaseTimes& times);

  std::uint64_t memory_bytes() const { return 4 * (keys_.capacity() + offsets_.capacity()); }

 private:
  void count(ThreadTeam& team, const GridShape& grid, const Vec2i* where);
  void accumulate(ThreadTeam& team, std::vector<std::uint32_t>& cell_start);
  void scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to);

  // Slices of the parcels with counts of their own. More of them would cost memory for each cell.
  static constexpr unsigned kMaxSlices = 4;

  std::size_t num_keys_ = 0;
  unsigned num_slices_ = 1;
  std::vector<std::uint32_t> keys_;     // one per parcel
  std::vector<std::uint32_t> offsets_;  // num_slices_ x num_keys_: counts, then destinations
  std::vector<std::uint32_t> chunk_sums_;
};

}  // namespace pf
