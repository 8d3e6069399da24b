#include "backend/exact/solve.hpp"

#include <algorithm>
#include <atomic>

#include "backend/exact/read_ahead.hpp"
#include "backend/exact/solve_cluster.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

constexpr std::size_t kMinSharedClusters = 16;  // with fewer the calling thread solves them alone
constexpr std::size_t kBatch = 16;              // clusters that a thread takes at once
constexpr std::size_t kAhead = 4;               // clusters to prefetch

// The clusters in `todo` that one thread starts with; any thread may take them.
struct alignas(64) Share {
  std::atomic<std::size_t> next;
  std::size_t end = 0;
};

void prefetch_cluster(const WindowContext& window, std::uint32_t k) {
  const EpochMemory& memory = window.memory;
  const ParcelArrays& parcels = window.trajectories;
  const Cluster& cluster = memory.clusters[k];
  for (std::uint32_t m = 0; m < std::min(cluster.num_seeds, 4U); ++m) {
    const std::uint32_t i = memory.seeds[cluster.first_seed + m];
    const void* lines[] = {&parcels.position[i],   &parcels.velocity[i],      &parcels.tick[i],
                           &parcels.id[i],         &window.input.position[i], memory.calendar.line(i),
                           &memory.member_slot[i], &memory.owner[i],          &memory.discs.x[i],
                           &memory.discs.y[i],     &memory.discs.radius[i]};
    for (const void* line : lines) __builtin_prefetch(line);
  }
}

template <Boundary kBoundary>
void solve_one(WindowContext& window, unsigned thread, std::uint32_t k) {
  ClusterSolver<kBoundary>(window, thread, k).solve();
}

ReadAhead read_ahead(const WindowContext& window) {
  const EpochMemory& memory = window.memory;
  const ParcelArrays& parcels = window.trajectories;
  return {window.space,
          memory.todo.size(),
          {parcels.tick.data(), parcels.id.data(), memory.member_slot.data(), memory.owner.data(),
           memory.discs.x.data(), memory.discs.y.data(), memory.discs.radius.data()},
          {parcels.position.data(), parcels.velocity.data(), window.input.position, memory.calendar.line(0)}};
}

// Cluster k is solved soon.
void prepare(const WindowContext& window, ReadAhead& ahead, std::uint32_t k) {
  const Cluster& cluster = window.memory.clusters[k];
  if (ahead.is_active() && cluster.num_seeds > 0)
    ahead.reach(window.memory.seeds[cluster.first_seed]);
  else
    prefetch_cluster(window, k);
}

template <Boundary kBoundary>
void solve_share(WindowContext& window, unsigned thread, Share& share) {
  const std::vector<std::uint32_t>& todo = window.memory.todo;
  ReadAhead ahead = read_ahead(window);
  while (true) {
    const std::size_t begin = share.next.fetch_add(kBatch, std::memory_order_relaxed);
    if (begin >= share.end) return;
    const std::size_t end = std::min(share.end, begin + kBatch);
    for (std::size_t k = begin; k < end; ++k) {
      if (k + kAhead < share.end) prepare(window, ahead, todo[k + kAhead]);
      solve_one<kBoundary>(window, thread, todo[k]);
    }
  }
}

// Each thread first solves clusters whose parcels it predicted, which are in its cache, then what is left of
// the other threads' shares.
template <Boundary kBoundary>
void solve(WindowContext& window) {
  const std::vector<std::uint32_t>& todo = window.memory.todo;
  if (todo.size() < kMinSharedClusters) {
    for (const std::uint32_t k : todo) solve_one<kBoundary>(window, 0, k);
    return;
  }
  const unsigned num_threads = window.team.size();
  std::vector<Share> shares(num_threads);
  for (unsigned thread = 0; thread < num_threads; ++thread) {
    const auto [begin, end] = window.team.share(thread, todo.size());
    shares[thread].next = begin;
    shares[thread].end = end;
  }
  window.team.run([&](unsigned thread) {
    for (unsigned k = 0; k < num_threads; ++k)
      solve_share<kBoundary>(window, thread, shares[(thread + k) % num_threads]);
  });
}

}  // namespace

void solve(WindowContext& window) {
  for_boundary(window.c.run.physics.world.boundary, [&]<Boundary kBoundary>() { solve<kBoundary>(window); });
}

}  // namespace pf
