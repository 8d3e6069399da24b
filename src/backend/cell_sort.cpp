#include "backend/cell_sort.hpp"

#include <algorithm>
#include <utility>

#include "backend/parcel_arrays.hpp"
#include "core/resize.hpp"

namespace pf {

std::size_t min_parcels_together(const GridShape& grid, std::size_t num_parcels) {
  constexpr std::size_t kMinParcels = 1500, kMinRows = 4;
  const auto num_rows = static_cast<std::size_t>(std::max(grid.y.num, 1));
  return std::max(kMinParcels, kMinRows * num_parcels / num_rows);
}

void CellSort::sort(ThreadTeam& team, const Input& in, const Output& out, PhaseTimes& times) {
  num_cells_ = in.grid.num_cells();
  resize_tightly(keys_, in.parcels.id.size());
  const std::size_t num_parts = team.num_parts(keys_.size(), min_parcels_together(in.grid, keys_.size()));
  resize_tightly(offsets_, num_cells_ * std::min(team.size(), kMaxCounts) + num_parts);
  resize_tightly(out.cell_start, num_cells_ + 2);
  {
    ScopedPhase timing(times, Phase::sort);
    if (team.size() == 1) {
      count_at_once(in.grid, in.where);
    } else {
      find_cells(team, num_parts, in.grid, in.where);
      lay_out_counts(team.size());
      count(team);
    }
  }
  {
    ScopedPhase timing(times, Phase::grid);
    accumulate(team, num_parts, out.cell_start);
  }
  ScopedPhase timing(times, Phase::sort);
  scatter(team, in.parcels, out.parcels);
}

void CellSort::count_at_once(const GridShape& grid, const Vec2i* where) {
  slices_.assign(1, {0, keys_.size(), 0, num_cells_, 0});
  std::fill_n(offsets_.data(), num_cells_ + 1, 0U);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    keys_[i] = cell_key(grid, where[i]);
    ++offsets_[keys_[i]];
  }
}

void CellSort::find_cells(ThreadTeam& team, std::size_t num_slices, const GridShape& grid,
                          const Vec2i* where) {
  slices_.resize(num_slices);
  const auto num_cells = static_cast<std::uint32_t>(num_cells_);
  team.run_parts(num_slices, [&](unsigned, std::size_t k) {
    const auto [begin, end] = ThreadTeam::share(k, num_slices, keys_.size());
    std::uint32_t first_cell = num_cells, end_cell = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t key = cell_key(grid, where[i]);
      keys_[i] = key;
      first_cell = std::min(first_cell, key);
      end_cell = std::max(end_cell, key == num_cells ? 0U : key + 1);
    }
    slices_[k] = {begin, end, std::min(first_cell, end_cell), end_cell, 0};
  });
}

// Parcels lie almost in the order of the last sort, so that a slice has few cells. Where they do not, fewer
// slices have counts of all cells.
void CellSort::lay_out_counts(unsigned num_threads) {
  std::size_t num_counts = 0;
  for (Slice& slice : slices_) {
    slice.first_count = num_counts;
    num_counts += slice.num_counts();
  }
  if (num_counts <= offsets_.size()) return;
  slices_.resize(std::min(num_threads, kMaxCounts));
  for (std::size_t s = 0; s < slices_.size(); ++s) {
    const auto [begin, end] = ThreadTeam::share(s, slices_.size(), keys_.size());
    slices_[s] = {begin, end, 0, num_cells_, s * (num_cells_ + 1)};
  }
}

void CellSort::count(ThreadTeam& team) {
  team.run_parts(slices_.size(), [&](unsigned, std::size_t k) {
    const Slice slice = slices_[k];
    std::fill_n(offsets_.data() + slice.first_count, slice.num_counts(), 0U);
    for (std::size_t i = slice.begin; i < slice.end; ++i) ++offsets_[slice.count_of(keys_[i])];
  });
}

// Exclusive sums over (cell, slice) in that order: first over chunks of cells, then within them.
void CellSort::accumulate(ThreadTeam& team, std::size_t num_chunks, std::vector<std::uint32_t>& cell_start) {
  chunk_sums_.assign(num_chunks + 1, 0U);
  team.run_parts(num_chunks, [&](unsigned, std::size_t chunk) {
    const auto [begin, end] = ThreadTeam::share(chunk, num_chunks, num_cells_);
    std::uint32_t sum = 0;
    for (const Slice& slice : slices_) {
      const std::size_t last = std::min(end, slice.end_cell);
      for (std::size_t cell = std::max(begin, slice.first_cell); cell < last; ++cell)
        sum += offsets_[slice.first_count + (cell - slice.first_cell)];
    }
    chunk_sums_[chunk + 1] = sum;
  });
  for (std::size_t k = 0; k < num_chunks; ++k) chunk_sums_[k + 1] += chunk_sums_[k];
  team.run_parts(num_chunks, [&](unsigned, std::size_t chunk) {
    const auto [begin, end] = ThreadTeam::share(chunk, num_chunks, num_cells_);
    std::vector<Slice> slices;  // that have cells of the chunk
    for (const Slice& slice : slices_) {
      if (slice.first_cell < end && begin < slice.end_cell) slices.push_back(slice);
    }
    std::uint32_t next = chunk_sums_[chunk];
    for (std::size_t cell = begin; cell < end; ++cell) {
      cell_start[cell] = next;
      for (const Slice& slice : slices) {
        if (cell < slice.first_cell || cell >= slice.end_cell) continue;
        std::uint32_t& offset = offsets_[slice.first_count + (cell - slice.first_cell)];
        next += std::exchange(offset, next);
      }
    }
  });
  std::uint32_t next = chunk_sums_[num_chunks];
  cell_start[num_cells_] = next;
  for (const Slice& slice : slices_) {
    std::uint32_t& offset = offsets_[slice.count_of_retired()];
    next += std::exchange(offset, next);
  }
  cell_start[num_cells_ + 1] = next;
}

void CellSort::scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to) {
  to.tick.resize(from.tick.size());
  to.last_contact_tick.resize(from.last_contact_tick.size());
  resize_tightly(to.slot, from.slot.size());
  std::ranges::fill(to.is_heated, 0);  // few are
  const bool has_tick = !from.tick.empty(), has_contacts = !from.last_contact_tick.empty(),
             has_slot = !from.slot.empty();
  team.run_parts(slices_.size(), [&](unsigned, std::size_t k) {
    const Slice slice = slices_[k];
    // Pointers, because the compiler must assume that a written byte may alias any vector.
    const std::uint32_t *keys = keys_.data(), *from_id = from.id.data();
    const Vec2i* from_position = from.position.data();
    const Vec2f* from_velocity = from.velocity.data();
    const std::uint8_t* from_heated = from.is_heated.data();
    std::uint32_t *offsets = offsets_.data(), *to_id = to.id.data();
    Vec2i* to_position = to.position.data();
    Vec2f* to_velocity = to.velocity.data();
    std::uint8_t* to_heated = to.is_heated.data();
    for (std::size_t i = slice.begin; i < slice.end; ++i) {
      const std::uint32_t j = offsets[slice.count_of(keys[i])]++;
      to_position[j] = from_position[i];
      to_velocity[j] = from_velocity[i];
      to_id[j] = from_id[i];
      if (from_heated[i] != 0) to_heated[j] = 1;
      if (has_tick) to.tick[j] = from.tick[i];
      if (has_contacts) to.last_contact_tick[j] = from.last_contact_tick[i];
      if (has_slot) to.slot[j] = from.slot[i];
    }
  });
}

}  // namespace pf
