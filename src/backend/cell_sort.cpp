#include "backend/cell_sort.hpp"

#include <algorithm>

#include "backend/parcel_arrays.hpp"
#include "core/resize.hpp"

namespace pf {

void CellSort::sort(ThreadTeam& team, const Input& in, const Output& out, PhaseTimes& times) {
  num_keys_ = in.grid.num_cells() + 1;
  resize_tightly(keys_, in.parcels.id.size());
  resize_tightly(offsets_, num_keys_ * std::min(team.size(), kMostCounts));
  resize_tightly(out.cell_start, num_keys_ + 1);
  {
    ScopedPhase timing(times, Phase::sort);
    if (team.size() == 1) {
      count_at_once(in.grid, in.where);
    } else {
      find_keys(team, in.grid, in.where);
      lay_out_counts(team.size());
      count(team);
    }
  }
  {
    ScopedPhase timing(times, Phase::grid);
    accumulate(team, out.cell_start);
  }
  ScopedPhase timing(times, Phase::sort);
  scatter(team, in.parcels, out.parcels);
}

void CellSort::count_at_once(const GridShape& grid, const Vec2i* where) {
  slices_.assign(1, {0, keys_.size(), 0, num_keys_, 0});
  std::fill_n(offsets_.data(), num_keys_, 0U);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    keys_[i] = cell_key(grid, where[i]);
    ++offsets_[keys_[i]];
  }
}

void CellSort::find_keys(ThreadTeam& team, const GridShape& grid, const Vec2i* where) {
  slices_.resize(team.size());
  team.run([&](unsigned thread) {
    const auto [begin, end] = team.share(thread, keys_.size());
    std::uint32_t lowest = UINT32_MAX, highest = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t key = cell_key(grid, where[i]);
      keys_[i] = key;
      lowest = std::min(lowest, key);
      highest = std::max(highest, key);
    }
    slices_[thread] = {begin, end, 0, 0, 0};
    if (begin != end) slices_[thread] = {begin, end, lowest, std::size_t{highest} + 1, 0};
  });
}

// Parcels lie almost in the order of the last sort, so that a slice has few keys. Where they do not, fewer
// slices have counts of all keys.
void CellSort::lay_out_counts(unsigned num_threads) {
  std::size_t num_counts = 0;
  for (Slice& slice : slices_) {
    slice.first_count = num_counts;
    num_counts += slice.end_key - slice.first_key;
  }
  if (num_counts <= offsets_.size()) return;
  slices_.resize(std::min(num_threads, kMostCounts));
  for (std::size_t s = 0; s < slices_.size(); ++s) {
    const std::size_t num = keys_.size(), num_slices = slices_.size();
    slices_[s] = {num * s / num_slices, num * (s + 1) / num_slices, 0, num_keys_, s * num_keys_};
  }
}

void CellSort::count(ThreadTeam& team) {
  team.run([&](unsigned thread) {
    if (thread >= slices_.size()) return;
    const Slice& slice = slices_[thread];
    std::uint32_t* counts = offsets_.data() + slice.first_count;
    std::fill_n(counts, slice.end_key - slice.first_key, 0U);
    for (std::size_t i = slice.begin; i < slice.end; ++i) ++counts[keys_[i] - slice.first_key];
  });
}

// Exclusive sums over (cell, slice) in that order: first over chunks of cells, then within them.
void CellSort::accumulate(ThreadTeam& team, std::vector<std::uint32_t>& cell_start) {
  chunk_sums_.assign(team.size() + 1, 0U);
  team.run([&](unsigned thread) {
    const auto [begin, end] = team.share(thread, num_keys_);
    std::uint32_t sum = 0;
    for (const Slice& slice : slices_) {
      const std::size_t last = std::min(end, slice.end_key);
      for (std::size_t key = std::max(begin, slice.first_key); key < last; ++key)
        sum += offsets_[slice.first_count + (key - slice.first_key)];
    }
    chunk_sums_[thread + 1] = sum;
  });
  for (unsigned t = 0; t < team.size(); ++t) chunk_sums_[t + 1] += chunk_sums_[t];
  team.run([&](unsigned thread) {
    const auto [begin, end] = team.share(thread, num_keys_);
    std::vector<Slice> slices;  // that have keys of the chunk
    for (const Slice& slice : slices_) {
      if (slice.first_key < end && begin < slice.end_key) slices.push_back(slice);
    }
    std::uint32_t next = chunk_sums_[thread];
    for (std::size_t key = begin; key < end; ++key) {
      cell_start[key] = next;
      for (const Slice& slice : slices) {
        if (key < slice.first_key || key >= slice.end_key) continue;
        std::uint32_t& offset = offsets_[slice.first_count + (key - slice.first_key)];
        const std::uint32_t in_slice = offset;
        offset = next;
        next += in_slice;
      }
    }
  });
  cell_start[num_keys_] = static_cast<std::uint32_t>(keys_.size());
}

void CellSort::scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to) {
  to.tick.resize(from.tick.size());
  to.last_contact_tick.resize(from.last_contact_tick.size());
  resize_tightly(to.slot, from.slot.size());
  const bool has_tick = !from.tick.empty(), has_contacts = !from.last_contact_tick.empty(),
             has_slot = !from.slot.empty();
  team.run([&](unsigned thread) {
    if (thread >= slices_.size()) return;
    const Slice& slice = slices_[thread];
    std::uint32_t* destinations = offsets_.data() + slice.first_count;
    for (std::size_t i = slice.begin; i < slice.end; ++i) {
      const std::uint32_t j = destinations[keys_[i] - slice.first_key]++;
      to.position[j] = from.position[i];
      to.velocity[j] = from.velocity[i];
      to.id[j] = from.id[i];
      if (has_tick) to.tick[j] = from.tick[i];
      if (has_contacts) to.last_contact_tick[j] = from.last_contact_tick[i];
      if (has_slot) to.slot[j] = from.slot[i];
    }
  });
}

}  // namespace pf
