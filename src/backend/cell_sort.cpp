#include "backend/cell_sort.hpp"

#include <algorithm>

namespace pf {
namespace {

ThreadTeam::Share slice(unsigned index, unsigned num_slices, std::size_t count) {
  return {count * index / num_slices, count * (index + 1) / num_slices};
}

}  // namespace

void CellSort::sort(ThreadTeam& team, const GridShape& grid, const Vec2i* where, const ParcelArrays& from,
                    ParcelArrays& to, std::vector<std::uint32_t>& cell_start, PhaseTimes& times) {
  num_keys_ = grid.num_cells() + 1;
  num_slices_ = std::min(team.size(), kMaxSlices);
  keys_.resize(from.id.size());
  offsets_.resize(num_keys_ * num_slices_);
  cell_start.resize(num_keys_ + 1);
  {
    ScopedPhase timing(times, Phase::sort);
    count(team, grid, where, from.id.size());
  }
  {
    ScopedPhase timing(times, Phase::grid);
    accumulate(team, cell_start);
  }
  ScopedPhase timing(times, Phase::sort);
  scatter(team, from, to);
}

void CellSort::count(ThreadTeam& team, const GridShape& grid, const Vec2i* where, std::size_t num_parcels) {
  team.run([&](unsigned thread) {
    if (thread >= num_slices_) return;
    std::uint32_t* counts = offsets_.data() + thread * num_keys_;
    std::fill_n(counts, num_keys_, 0U);
    const auto [begin, end] = slice(thread, num_slices_, num_parcels);
    for (std::size_t i = begin; i < end; ++i) {
      keys_[i] = cell_key(grid, where[i]);
      ++counts[keys_[i]];
    }
  });
}

// Exclusive sums over (cell, slice) in that order, in chunks of cells: sums of the chunks first.
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
    std::uint32_t place = chunk_sums_[thread];
    for (std::size_t key = begin; key < end; ++key) {
      cell_start[key] = place;
      for (unsigned s = 0; s < num_slices_; ++s) {
        std::uint32_t& offset = offsets_[s * num_keys_ + key];
        const std::uint32_t in_slice = offset;
        offset = place;
        place += in_slice;
      }
    }
  });
  cell_start[num_keys_] = static_cast<std::uint32_t>(keys_.size());
}

void CellSort::scatter(ThreadTeam& team, const ParcelArrays& from, ParcelArrays& to) {
  to.tick.resize(from.tick.size());
  to.last_contact_tick.resize(from.last_contact_tick.size());
  const bool has_tick = !from.tick.empty(), has_contacts = !from.last_contact_tick.empty();
  team.run([&](unsigned thread) {
    if (thread >= num_slices_) return;
    std::uint32_t* places = offsets_.data() + thread * num_keys_;
    const auto [begin, end] = slice(thread, num_slices_, from.id.size());
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t place = places[keys_[i]]++;
      to.position[place] = from.position[i];
      to.velocity[place] = from.velocity[i];
      to.id[place] = from.id[i];
      if (has_tick) to.tick[place] = from.tick[i];
      if (has_contacts) to.last_contact_tick[place] = from.last_contact_tick[i];
    }
  });
}

}  // namespace pf
