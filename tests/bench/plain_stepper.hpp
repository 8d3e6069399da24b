// The rival of bench_ratio: the same physics as the gas scene, written the way one does in an hour. One
// thread, floats, no care taken of determinism. Lengths in disc diameters, masses in disc masses, elastic.
#pragma once

#include <cstdint>
#include <vector>

namespace pf::test {

// State of discs, each array as long as there are discs; x, y in [0, side].
struct PlainDiscs {
  std::vector<float> x, y;    // diameters
  std::vector<float> vx, vy;  // diameters per second

  explicit PlainDiscs(std::size_t num = 0) : x(num), y(num), vx(num), vy(num) {}
  std::size_t num() const { return x.size(); }
};

class PlainStepper {
 public:
  // side: of the square box, diameters, at least 1.
  PlainStepper(float side, PlainDiscs discs);

  void step(float dt_s);

  const PlainDiscs& discs() const { return discs_; }
  // Approaching overlaps since the start, each pair once.
  std::uint64_t num_collisions() const { return num_seen_ / 2; }

 private:
  int cell_of(float position) const;
  void sort_into_cells();
  void collide();
  void collide_one(std::uint32_t i);
  void move(float dt_s);

  float side_;
  int cells_per_side_;
  float cells_per_diameter_;
  PlainDiscs discs_;                       // in cell order after sort_into_cells
  PlainDiscs next_;                        // what the sort scatters to, then what collide writes
  std::vector<std::uint32_t> cell_;        // of each disc before the sort
  std::vector<std::uint32_t> cell_begin_;  // one entry per cell and one more
  std::vector<std::uint32_t> cursor_;      // where the next disc of each cell goes
  std::uint64_t num_seen_ = 0;             // each collision is seen from both sides
};

}  // namespace pf::test
