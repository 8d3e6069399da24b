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
  // Consecutive parcels that one thread sorts, and the keys that they may have.
  struct Slice {
    std::size_t begin, end;
    std::size_t first_key, end_key;
    std::size_t first_count;  // index in offsets_ of the count of first_key
  };

  void count_at_once(const GridShape& grid, const Vec2i* where);  // by one thread
  void find_keys(ThreadTeam& team, const GridShape& grid, const Vec2i* where);
  void lay_out_counts(unsigned num_threads);
  void count(ThreadTeam& team);
  void accumulate(ThreadTeam& team, std::vector<std::uint32_t>& cell_start);
  void scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to);

  static constexpr unsigned kMostCounts = 4;  // of a cell; more would cost memory

  std::size_t num_keys_ = 0;
  std::vector<Slice> slices_;
  std::vector<std::uint32_t> keys_;     // one per parcel
  std::vector<std::uint32_t> offsets_;  // of all slices: counts of their keys, then destinations
  std::vector<std::uint32_t> chunk_sums_;
};

}  // namespace pf
