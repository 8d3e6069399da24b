#include "app/sweep_plan.hpp"

#include <algorithm>

namespace pf {
namespace {

constexpr FrameCount kMaxFrames = {10, 60};  // the warm-up settles contacts, caches and clocks
constexpr FrameCount kMinFrames = {1, 3};
constexpr double kPointBudget_ms = 6000.0;  // slower points get fewer frames
constexpr double kMaxPoint_ms = 20'000.0;   // points with slower minimum frames are extrapolated

}  // namespace

std::vector<SweepSeries> sweep_series() {
  return {{"CPU, 1 thread, all-pairs", false, 1, Neighbors::all_pairs},
          {"CPU, all threads, all-pairs", false, 0, Neighbors::all_pairs},
          {"CPU, 1 thread, grid", false, 1, Neighbors::grid},
          {"CPU, all threads, grid", false, 0, Neighbors::grid},
          {"CUDA, all-pairs", true, 0, Neighbors::all_pairs},
          {"CUDA, grid", true, 0, Neighbors::grid}};
}

std::vector<std::int64_t> sweep_sizes(std::int64_t max) {
  std::vector<std::int64_t> sizes;
  for (std::int64_t size = 1000; size < max; size *= 10) sizes.push_back(size);
  sizes.push_back(max);
  return sizes;
}

FrameCost scaled_cost(const FrameCost& cost, std::int64_t from_size, std::int64_t size, Neighbors neighbors) {
  const double ratio = static_cast<double>(size) / static_cast<double>(from_size);
  const double physics_ratio = neighbors == Neighbors::all_pairs ? ratio * ratio : ratio;
  return {cost.physics_ms * physics_ratio, cost.render_ms * ratio, cost.overhead_ms * ratio};
}

std::optional<FrameCount> plan_frames(const std::optional<FrameCost>& expected) {
  if (!expected) return kMaxFrames;
  const double frame_ms = std::max(expected->total_ms(), 1e-3);
  if ((kMinFrames.warmup + kMinFrames.timed) * frame_ms > kMaxPoint_ms) return std::nullopt;
  const int affordable = static_cast<int>(std::min(1e6, kPointBudget_ms / frame_ms));
  FrameCount count;
  count.timed = std::clamp(affordable * 6 / 7, kMinFrames.timed, kMaxFrames.timed);
  count.warmup = std::clamp(count.timed / 6, kMinFrames.warmup, kMaxFrames.warmup);
  return count;
}

}  // namespace pf
