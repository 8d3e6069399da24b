#include "backend/exact/clusters.hpp"

#include <atomic>
#include <numeric>
#include <utility>

#include "backend/exact/parallel_loops.hpp"

namespace pf {
namespace {

using AtomicIndex = std::atomic_ref<std::uint32_t>;

// Leaves the sets of active parcels as trees in member_slot, which has no other use yet.
void connect_partners(WindowContext& window) {
  EpochMemory& memory = window.memory;
  const std::vector<std::uint32_t>& active = memory.active;
  std::vector<std::uint32_t>& parent = memory.member_slot;
  for_each_item(window, active.size(), [&](WorkerState&, std::size_t k) { parent[active[k]] = active[k]; });
  for_each_item(window, active.size(), [&](WorkerState&, std::size_t k) {
    const std::uint32_t partner = memory.calendar.event(active[k]).partner;
    if (is_parcel(partner)) union_sets(parent, active[k], partner);
  });
}

// Numbers the clusters in the order of their first active parcels, and sets owners and numbers of seeds.
void number_clusters(EpochMemory& memory) {
  memory.clusters.clear();
  for (const std::uint32_t i : memory.active) {
    const std::uint32_t root = find_root(memory.member_slot, i);
    if (memory.owner[root] == kInvalidIndex) {
      memory.owner[root] = static_cast<std::uint32_t>(memory.clusters.size());
      memory.clusters.emplace_back();
    }
    memory.owner[i] = memory.owner[root];
    ++memory.clusters[memory.owner[i]].num_seeds;
  }
}

void list_seeds(EpochMemory& memory) {
  std::uint32_t num_seeds = 0;
  for (Cluster& cluster : memory.clusters) {
    cluster.first_seed = num_seeds;
    num_seeds += cluster.num_seeds;
    cluster.num_seeds = 0;
  }
  memory.seeds.resize(num_seeds);
  for (const std::uint32_t i : memory.active) {
    Cluster& cluster = memory.clusters[memory.owner[i]];
    memory.seeds[cluster.first_seed + cluster.num_seeds++] = i;
  }
}

void add_ball_cluster(WindowContext& window) {
  EpochMemory& memory = window.memory;
  memory.ball_owner = kInvalidIndex;
  memory.solved_ball.has_changed = false;
  if (!window.has_participant()) return;
  memory.ball_owner = static_cast<std::uint32_t>(memory.clusters.size());
  memory.clusters.emplace_back().has_ball = true;
}

}  // namespace

std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (true) {
    const std::uint32_t next = AtomicIndex(parent[i]).load(std::memory_order_relaxed);
    if (next == i) return i;
    const std::uint32_t after = AtomicIndex(parent[next]).load(std::memory_order_relaxed);
    if (after != next) AtomicIndex(parent[i]).store(after, std::memory_order_relaxed);
    i = next;
  }
}

void union_sets(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b) {
  while (true) {
    a = find_root(parent, a);
    b = find_root(parent, b);
    if (a == b) return;
    if (a < b) std::swap(a, b);  // the lower index becomes the root
    std::uint32_t expected = a;
    if (AtomicIndex(parent[a]).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
  }
}

void form_clusters(WindowContext& window) {
  EpochMemory& memory = window.memory;
  connect_partners(window);
  number_clusters(memory);
  list_seeds(memory);
  add_ball_cluster(window);
  memory.todo.resize(memory.clusters.size());
  std::iota(memory.todo.begin(), memory.todo.end(), 0U);
}

}  // namespace pf
