#include "backend/processor.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <vector>

#include "core/timing.hpp"
#include "core/vec2.hpp"

namespace pf {
namespace {

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    const std::size_t name = line.find_first_not_of(": \t", line.find(':'));
    if (name != std::string::npos) return line.substr(name);
  }
  return "unknown processor";
}

}  // namespace

std::string processor_with_threads(unsigned num_threads) {
  return processor_name() + ", " + std::to_string(num_threads) + (num_threads == 1 ? " thread" : " threads");
}

double min_step_bytes(std::size_t num_parcels, std::size_t num_cells, const StepTotals& totals) {
  constexpr double kStep = 2.0 * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(std::uint32_t);
  constexpr double kSort = kStep + sizeof(std::uint32_t);  // as a step, plus written ids
  const auto n = static_cast<double>(num_parcels);
  const double per_sort = n * kSort + 8.0 * static_cast<double>(num_cells);
  return static_cast<double>(totals.num_steps) * n * kStep + static_cast<double>(totals.num_sorts) * per_sort;
}

double measure_copy_bandwidth(ThreadTeam& team, std::size_t num_bytes) {
  constexpr int kRepeats = 5;
  std::vector<std::byte> from(num_bytes), to(num_bytes);
  double best_ms = 1e30;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const Clock::time_point start = Clock::now();
    team.run([&](unsigned thread) {
      const auto [begin, end] = team.share(thread, num_bytes);
      std::copy(from.begin() + static_cast<std::ptrdiff_t>(begin),
                from.begin() + static_cast<std::ptrdiff_t>(end),
                to.begin() + static_cast<std::ptrdiff_t>(begin));
    });
    best_ms = std::min(best_ms, milliseconds_since(start));
  }
  return 2e3 * static_cast<double>(num_bytes) / best_ms;
}

}  // namespace pf
