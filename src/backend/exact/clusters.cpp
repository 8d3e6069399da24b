#include "backend/exact/clusters.hpp"

#include <algorithm>
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

// Numbers the clusters in the order of their first active parcels, sets owners, and lists the seeds of each
// cluster in ascending order.
void number_alone(EpochMemory& memory) {
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
  std::uint32_t num_seeds = 0;
  for (Cluster& cluster : memory.clusters) {
    cluster.first_seed = num_seeds;
    num_seeds += std::exchange(cluster.num_seeds, 0);
  }
  memory.seeds.resize(num_seeds);
  for (const std::uint32_t i : memory.active) {
    Cluster& cluster = memory.clusters[memory.owner[i]];
    memory.seeds[cluster.first_seed + cluster.num_seeds++] = i;
  }
}

// Turns the counts that the workers hold into the first numbers of what each of them counted, one worker
// after the other. Returns the sum.
std::uint32_t start_numbers(std::vector<WorkerState>& workers) {
  std::uint32_t sum = 0;
  for (WorkerState& worker : workers) sum += std::exchange(worker.number, sum);
  return sum;
}

// Numbers the clusters as number_alone() does, by all threads, which takes more work in all. A cluster's root
// is its first active parcel: active parcels ascend, and their partners are active, too.
void number_together(WindowContext& window) {
  EpochMemory& memory = window.memory;
  const auto for_each_active = [&](const auto& visit) {
    for_each_item(window, memory.active.size(), [&](WorkerState& worker, std::size_t k) {
      visit(worker, memory.active[k], find_root(memory.member_slot, memory.active[k]));
    });
  };
  for (WorkerState& worker : memory.workers) worker.number = 0;
  for_each_active([](WorkerState& worker, std::uint32_t i, std::uint32_t root) {
    if (i == root) ++worker.number;
  });
  memory.clusters.resize(start_numbers(memory.workers));
  for_each_active([&](WorkerState& worker, std::uint32_t i, std::uint32_t root) {
    if (i != root) return;
    memory.clusters[worker.number] = {};
    memory.owner[i] = worker.number++;
  });
  for_each_active([&](WorkerState&, std::uint32_t i, std::uint32_t root) {
    if (i != root) memory.owner[i] = memory.owner[root];
    AtomicIndex(memory.clusters[memory.owner[root]].num_seeds).fetch_add(1, std::memory_order_relaxed);
  });
}

// Lists the seeds as number_alone() does.
void list_seeds_together(WindowContext& window) {
  EpochMemory& memory = window.memory;
  const auto for_each_cluster = [&](const auto& visit) {
    for_each_item(window, memory.clusters.size(),
                  [&](WorkerState& worker, std::size_t k) { visit(worker, memory.clusters[k]); });
  };
  for (WorkerState& worker : memory.workers) worker.number = 0;
  for_each_cluster([](WorkerState& worker, const Cluster& cluster) { worker.number += cluster.num_seeds; });
  memory.seeds.resize(start_numbers(memory.workers));
  for_each_cluster([](WorkerState& worker, Cluster& cluster) {
    cluster.first_seed = worker.number;
    worker.number += std::exchange(cluster.num_seeds, 0);
  });
  for_each_item(window, memory.active.size(), [&](WorkerState&, std::size_t k) {
    Cluster& cluster = memory.clusters[memory.owner[memory.active[k]]];
    const std::uint32_t rank = AtomicIndex(cluster.num_seeds).fetch_add(1, std::memory_order_relaxed);
    memory.seeds[cluster.first_seed + rank] = memory.active[k];
  });
  for_each_cluster([&](WorkerState&, const Cluster& cluster) {
    const auto first = memory.seeds.begin() + cluster.first_seed;
    std::sort(first, first + cluster.num_seeds);
  });
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
  constexpr std::size_t kMinTogether = 2048;
  if (window.team.size() == 1 || memory.active.size() < kMinTogether) {
    number_alone(memory);
  } else {
    number_together(window);
    list_seeds_together(window);
  }
  add_ball_cluster(window);
  memory.todo.resize(memory.clusters.size());
  std::iota(memory.todo.begin(), memory.todo.end(), 0U);
}

}  // namespace pf
