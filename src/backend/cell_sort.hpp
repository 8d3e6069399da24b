// Counting sort of the parcels by cell, stable, in parallel.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/thread_team.hpp"
#include "core/timing.hpp"
#include "model/grid.hpp"

namespace pf {

struct ParcelArrays;

// Parcels in memory order that a thread takes at a time, at least, if others may take some of its share: four
// mean rows of cells, since a part of them is bound to those beside it by a row.
std::size_t min_parcels_together(const GridShape& grid, std::size_t num_parcels);

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

  static constexpr unsigned kMaxCounts = 4;  // of a cell; more would cost memory
  // Slices of parcels that the last sort has sorted side by side.
  std::size_t num_slices() const { return slices_.size(); }

 private:
  // Consecutive parcels that are sorted together, and the cells that those of them may be in that are not
  // retired.
  struct Slice {
    std::size_t begin, end;
    std::size_t first_cell, end_cell;
    std::size_t first_count;  // index in offsets_: of the count of first_cell, and so on; retired ones last

    std::size_t num_counts() const { return end_cell - first_cell + 1; }
    std::size_t count_of(std::uint32_t key) const {  // retired parcels have the highest key of all
      return first_count + std::min(key - first_cell, end_cell - first_cell);
    }
    std::size_t count_of_retired() const { return first_count + end_cell - first_cell; }
  };

  void count_at_once(const GridShape& grid, const Vec2i* where);  // by one thread
  void find_cells(ThreadTeam& team, std::size_t num_slices, const GridShape& grid, const Vec2i* where);
  void lay_out_counts(unsigned num_threads);
  void count(ThreadTeam& team);
  void accumulate(ThreadTeam& team, std::size_t num_chunks, std::vector<std::uint32_t>& cell_start);
  void scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to);

  std::size_t num_cells_ = 0;
  std::vector<Slice> slices_;
  std::vector<std::uint32_t> keys_;     // one per parcel: its cell, num_cells_ if it is retired
  std::vector<std::uint32_t> offsets_;  // of all slices: counts of their cells, then destinations
  std::vector<std::uint32_t> chunk_sums_;
};

}  // namespace pf
