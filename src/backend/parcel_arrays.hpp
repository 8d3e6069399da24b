// The parcels of the CPU backend, in the order of their cells.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "backend/candidate_ranges.hpp"
#include "backend/cell_sort.hpp"

namespace pf {

// Parcels in memory order. Positions and velocities have kSearchPadding more entries than ids.
struct ParcelArrays {
  std::vector<Vec2i> position;
  std::vector<Vec2f> velocity;
  std::vector<std::uint32_t> id;
  // Method `exact` only, otherwise empty: position is that of the parcel's last event, and tick its time.
  std::vector<std::uint32_t> tick;
  std::vector<std::uint32_t> last_contact_tick;  // with parcel or wall, for the TC model only

  void resize(std::size_t n) {
    position.resize(n + kSearchPadding);
    velocity.resize(n + kSearchPadding);
    id.resize(n);
    tick.clear();
    last_contact_tick.clear();
  }

  std::uint64_t memory_bytes() const {
    return sizeof(Vec2i) * position.capacity() + sizeof(Vec2f) * velocity.capacity() +
           4 * (id.capacity() + tick.capacity() + last_contact_tick.capacity());
  }
};

struct SortedParcels {
  ParcelArrays current;  // sorted by cell at the last sort
  ParcelArrays next;     // scratch of a sort or a step, of the same size
  CellSort cell_sort;
  GridShape grid;
  std::vector<std::uint32_t> cell_start;
  bool sorted = false;

  std::size_t size() const { return current.id.size(); }

  void resize(std::size_t n) {
    current.resize(n);
    next.resize(n);
    sorted = false;
  }

  // Sorts by the cells of `where`, one position per parcel in current order.
  void sort(ThreadTeam& team, const World& world, double cell_width, const Vec2i* where, PhaseTimes& times) {
    grid = choose_grid(world, static_cast<std::uint32_t>(size()), cell_width);
    cell_sort.sort(team, {grid, where, current}, {next, cell_start}, times);
    std::swap(current, next);
    sorted = true;
  }

  std::uint64_t memory_bytes() const {
    return current.memory_bytes() + next.memory_bytes() + 4 * cell_start.capacity() +
           cell_sort.memory_bytes();
  }
};

}  // namespace pf
