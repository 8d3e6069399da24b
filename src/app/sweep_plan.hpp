// Which points a sweep has, how long each is run, and what is put in place of those that take too long.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "backend/backend.hpp"

namespace pf {

struct SweepSeries {
  std::string name;
  bool cuda = false;
  int threads = 0;  // of the CPU backend; 0: all
  Neighbors neighbors = Neighbors::grid;
};

std::vector<SweepSeries> sweep_series();

// 1,000, 10,000 ... up to max; max itself comes last if it is no power of ten.
std::vector<std::int64_t> sweep_sizes(std::int64_t max);

// Means over the timed frames, milliseconds.
struct FrameCost {
  double physics_ms = 0.0;
  double render_ms = 0.0;
  double overhead_ms = 0.0;
  double total_ms() const { return physics_ms + render_ms + overhead_ms; }
};

struct FrameCount {
  int warmup = 0;
  int timed = 0;
};

// The cost at `size` from that measured at `from_size`: physics as N^2 (all-pairs) or N (grid), the rest as
// N.
FrameCost scaled_cost(const FrameCost& cost, std::int64_t from_size, std::int64_t size, Neighbors neighbors);

// Frames for a point whose frames are expected to cost `expected` (none: unknown, the first of its series),
// or none if even the fewest would take more than 20 s.
std::optional<FrameCount> plan_frames(const std::optional<FrameCost>& expected);

}  // namespace pf
