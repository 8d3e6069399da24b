// Plan of a sweep: its points, the number of frames of each, and the extrapolation of slow ones.
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

// 1,000, 10,000 ... and max.
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

// Extrapolates the cost at from_size to size: physics as N^2 (all-pairs) or N (grid), the rest as N.
FrameCost scaled_cost(const FrameCost& cost, std::int64_t from_size, std::int64_t size, Neighbors neighbors);

// Number of frames for a point. expected: cost of a frame; none: unknown, as for the first point of a series.
// Returns none if even the minimum number of frames would take more than 20 s.
std::optional<FrameCount> plan_frames(const std::optional<FrameCost>& expected);

}  // namespace pf
