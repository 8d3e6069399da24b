// The parcels of the CPU backend in the order of their cells, with where each cell begins.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "backend/cell_sort.hpp"

namespace pf {

struct SortedParcels {
  ParcelArrays current;  // sorted by cell at the last sort
  ParcelArrays next;     // scratch of a sort or a step, as large
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

  // Sorts by the cells of `where`, one position for each parcel in its present order.
  void sort(ThreadTeam& team, const World& world, double cell_width, const Vec2i* where, PhaseTimes& times) {
    grid = choose_grid(world, static_cast<std::uint32_t>(size()), cell_width);
    cell_sort.sort(team, grid, where, current, next, cell_start, times);
    std::swap(current, next);
    sorted = true;
  }

  std::uint64_t memory_bytes() const {
    const auto of = [](const ParcelArrays& a) {
      return sizeof(Vec2i) * a.position.capacity() + sizeof(Vec2f) * a.velocity.capacity() +
             4 * (a.id.capacity() + a.tick.capacity() + a.last_contact_tick.capacity());
    };
    return of(current) + of(next) + 4 * cell_start.capacity() + cell_sort.memory_bytes();
  }
};

}  // namespace pf
