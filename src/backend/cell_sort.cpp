#include "backend/cell_sort.hpp"

#include <algorithm>

#include "backend/parcel_arrays.hpp"
#include "core/resize.hpp"

namespace pf {
namespace {

ThreadTeam::Share slice(unsigned index, unsigned num_slices, std::size_t count) {
  return {count * index / num_slices, count * (index + 1) / num_slices};
}

}  // namespace

void CellSort::sort(ThreadTeam& team, const Input& in, const Output& out, PhaseTimes& times) {
  num_keys_ = in.grid.num_cells() + 1;
  num_slices_ = std::min(team.size(), kMaxSlices);
  resize_tightly(keys_, in.parcels.id.size());
  resize_tightly(offsets_, num_keys_ * num_slices_);
  resize_tightly(out.cell_start, num_keys_ + 1);
  {
    ScopedPhase timing(times, Phase::sort);
    count(team, in.grid, in.where);
  }
  {
    ScopedPhase timing(times, Phase::grid);
    accumulate(team, out.cell_start);
  }
  ScopedPhase timing(times, Phase::sort);
  scatter(team, in.parcels, out.parcels);
}

void CellSort::count(ThreadTeam& team, const GridShape& grid, const Vec2i* where) {
  team.run([&](unsigned thread) {
    if (thread >= num_slices_) return;
    std::uint32_t* counts = offsets_.data() + thread * num_keys_;
    std::fill_n(counts, num_keys_, 0U);
    const auto [begin, end] = slice(thread, num_slices_, keys_.size());
    for (std::size_t i = begin; i < end; ++i) {
      keys_[i] = cell_key(grid, where[i]);
      ++counts[keys_[i]];
    }
  });
}

// Exclusive sums over (cell, slice) in that order: first over chunks of cells, then within them.
void CellSort::accumulate(ThreadTeam& team, std::vector<std::uint32_t>& cell_start) {
  chunk_sums_.assign(team.size() + 1, 0U);
  team.run([&](unsigned thread) {
    const auto [begin, end] = team.share(thread, num_keys_);
    std::uint32_t sum = 0;
    for (unsigned s = 0; s < num_slices_; ++s) {
      for (std::size_t key = begin; key < end; ++key) sum += offsets_[s * num_keys_ + key];
    }
    chunk_sums_[thread + 1] = sum;
  });
  for (unsigned t = 0; t < team.size(); ++t) chunk_sums_[t + 1] += chunk_sums_[t];
  team.run([&](unsigned thread) {
    const auto [begin, end] = team.share(thread, num_keys_);
    std::uint32_t next = chunk_sums_[thread];
    for (std::size_t key = begin; key < end; ++key) {
      cell_start[key] = next;
      for (unsigned s = 0; s < num_slices_; ++s) {
        std::uint32_t& offset = offsets_[s * num_keys_ + key];
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
    if (thread >= num_slices_) return;
    std::uint32_t* destinations = offsets_.data() + thread * num_keys_;
    const auto [begin, end] = slice(thread, num_slices_, from.id.size());
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t j = destinations[keys_[i]]++;
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
