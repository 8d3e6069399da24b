// The rival of bench_ratio: the physics of the gas scene, written in the plainest way. One thread, floats,
// not deterministic by design, each pair searched once. Lengths in disc diameters, masses in disc masses,
// elastic.
#pragma once

#include <cstdint>
#include <vector>

namespace pf::test {

// State of discs, one array element per disc; x, y in [0, side].
struct PlainDiscs {
  std::vector<float> x, y;    // diameters
  std::vector<float> vx, vy;  // diameters per second

  explicit PlainDiscs(std::size_t num = 0) : x(num), y(num), vx(num), vy(num) {}
  std::size_t num() const { return x.size(); }
};

class PlainStepper {
 public:
  // side: of the square box, in diameters, at least 1.
  PlainStepper(float side, PlainDiscs discs);

  void step(float dt_s);

  const PlainDiscs& discs() const { return discs_; }
  // Approaching overlaps since the start; counts each pair once.
  std::uint64_t num_collisions() const { return num_collisions_; }

 private:
  int cell_of(float position) const;
  void sort_into_cells();
  void collide();
  void collide_with(std::uint32_t i, int first_cell, int last_cell);
  void collide_pair(std::uint32_t i, std::uint32_t j);
  void move(float dt_s);

  float side_;
  int cells_per_side_;
  float cells_per_diameter_;
  PlainDiscs discs_;                       // in cell order after sort_into_cells
  PlainDiscs next_;                        // output of the sort, then of collide
  std::vector<std::uint32_t> cell_;        // of each disc before the sort
  std::vector<std::uint32_t> cell_start_;  // one entry per cell and one more
  std::vector<std::uint32_t> cursor_;      // position of each cell's next disc
  std::uint64_t num_collisions_ = 0;
};

}  // namespace pf::test
