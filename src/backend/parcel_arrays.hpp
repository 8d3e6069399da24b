// The parcels of the CPU backend, in the order of their cells.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "backend/candidate_ranges.hpp"
#include "backend/cell_sort.hpp"
#include "core/resize.hpp"
#include "model/parcel.hpp"

namespace pf {

// Parcels in memory order. Positions and velocities have kSearchPadding more entries than ids.
struct ParcelArrays {
  std::vector<Vec2i> position;
  std::vector<Vec2f> velocity;
  std::vector<std::uint32_t> id;
  std::vector<std::uint8_t> is_heated;  // see Parcel
  // Method `exact` only, otherwise empty: position is that of the parcel's last event, and tick its time.
  std::vector<std::uint32_t> tick;
  std::vector<std::uint32_t> last_contact_tick;  // with parcel or wall, for the TC model only
  // Parcels of a slab (backend/domains) only, otherwise empty: 0, or the parcel's slot in the lists of those
  // near another slab.
  std::vector<std::uint32_t> slot;

  void resize(std::size_t n) {
    resize_tightly(position, n + kSearchPadding);
    resize_tightly(velocity, n + kSearchPadding);
    resize_tightly(id, n);
    resize_tightly(is_heated, n);
    tick.clear();
    last_contact_tick.clear();
    slot.clear();
  }

  Parcel operator[](std::size_t i) const { return {position[i], velocity[i], id[i], is_heated[i]}; }

  std::uint64_t memory_bytes() const {
    return sizeof(Vec2i) * position.capacity() + sizeof(Vec2f) * velocity.capacity() + is_heated.capacity() +
           4 * (id.capacity() + tick.capacity() + last_contact_tick.capacity() + slot.capacity());
  }
};

struct SortedParcels {
  ParcelArrays current;  // sorted by cell at the last sort
  ParcelArrays next;     // scratch of a sort or a step, of the same size
  CellSort cell_sort;
  GridShape grid;
  std::vector<std::uint32_t> cell_start;
  bool sorted = false;
  // Parcels with larger slots are ghosts, copies of another slab's parcels: they touch, but do not move.
  std::uint32_t last_own_slot = 0;

  std::size_t size() const { return current.id.size(); }
  bool is_ghost(std::size_t i) const { return !current.slot.empty() && current.slot[i] > last_own_slot; }

  void resize(std::size_t n) {
    current.resize(n);
    next.resize(n);
    sorted = false;
  }

  // Sorts by the cells of `where`, one position per parcel in current order.
  void sort(ThreadTeam& team, const GridShape& shape, const Vec2i* where, PhaseTimes& times) {
    grid = shape;
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
