// Method `exact` on the device: clusters, which are sets of parcels whose events depend on each other.
#pragma once

#include "cuda/exact/step_context.cuh"

namespace pf::cuda {

__device__ inline Cluster& cluster_of(const StepContext& step, std::uint32_t cluster) {
  const StepMemory& memory = step.memory;
  return memory.clusters[memory.member_slot[cluster]];
}

__device__ inline void start_cluster(Cluster& cluster, std::uint32_t name) {
  cluster = {};
  cluster.members = cluster.merged = kInvalidIndex;
  cluster.parent = name;
  cluster.reassigned = kInvalidIndex;
}

__device__ inline void add_tally(const ClusterTally& cluster, ClusterTally& sum) {
  sum.num_events += cluster.num_events;
  sum.num_collisions += cluster.num_collisions;
  sum.num_hits += cluster.num_hits;
  sum.num_retired += cluster.num_retired;
  sum.max_overlap = fmaxf(sum.max_overlap, cluster.max_overlap);
  sum.impulse_sum += cluster.impulse_sum;
  sum.ball_x += cluster.ball_x;
  sum.ball_y += cluster.ball_y;
  sum.ball_torque += cluster.ball_torque;
  sum.event_hash += cluster.event_hash;
}

// The cluster that absorbed this one, or itself.
__device__ inline std::uint32_t holder_of(const StepContext& step, std::uint32_t cluster) {
  const Cluster& it = cluster_of(step, cluster);
  return it.members == kInvalidIndex ? it.parent : cluster;
}

// Sets of clusters as trees. The root is the one with the lowest name.
__device__ inline std::uint32_t find_root(const StepContext& step, std::uint32_t cluster) {
  while (true) {
    const std::uint32_t next = load_fresh(&cluster_of(step, cluster).parent);
    if (next == cluster) return cluster;
    cluster = next;
  }
}

__device__ inline void union_sets(const StepContext& step, std::uint32_t p, std::uint32_t q) {
  while (true) {
    p = find_root(step, p);
    q = find_root(step, q);
    if (p == q) return;
    const std::uint32_t low = p < q ? p : q, high = p < q ? q : p;
    if (atomicCAS(&cluster_of(step, high).parent, high, low) == high) return;
  }
}

// Representative of the cluster of parcel i. Earliest events in the window lead from parcel to parcel, each
// to an earlier event, and end at two parcels that are each other's partners, or at one whose event needs no
// other parcel.
__device__ inline std::uint32_t representative_of(const StepContext& step, std::uint32_t i) {
  const StepMemory& memory = step.memory;
  while (true) {
    const EventKey event = memory.events[i];
    const std::uint32_t partner = partner_of(event);
    if (!is_parcel(partner) || tick_of(event) >= step.c.plan.length) return i;
    if (partner_of(memory.events[partner]) == i) return i < partner ? i : partner;
    i = partner;
  }
}

// Makes parcel i a member of a cluster that solve_kernel solves.
__device__ inline void join_cluster(const StepContext& step, std::uint32_t i, std::uint32_t representative) {
  const StepMemory& memory = step.memory;
  const std::uint32_t slot = memory.member_slot[i];
  memory.owner[i] = representative;
  memory.members[slot].index = i;
  memory.members[slot].next = atomicExch(&memory.list_head[representative], slot);
  if (representative != i) return;
  start_cluster(memory.clusters[slot], i);
  // There is room: active parcels are no fewer.
  memory.representatives.items[atomicAdd(&step.state.num_representatives, 1U)] = i;
}

// Representatives of pairs, shared by a block's threads: two active parcels that are each other's partners.
struct PairSpace {
  std::uint32_t representatives[kExactBlock];
  std::uint32_t num_representatives;
};

// Second stage of a step: forms the clusters of at most kExactBlock active parcels of a slice, from `first`
// on. Those that are a pair are put into `pairs`. All threads of the block call it.
__device__ inline void form_clusters(const StepContext& step, std::uint32_t slice, std::uint32_t first,
                                     std::uint32_t num_active, PairSpace& pairs) {
  const StepMemory& memory = step.memory;
  __syncthreads();
  if (threadIdx.x == 0) pairs.num_representatives = 0;
  __syncthreads();
  const std::uint32_t k = first + threadIdx.x;
  if (k < num_active) {
    const std::uint32_t i = memory.active.items[static_cast<std::size_t>(slice) * memory.active.capacity + k];
    const EventKey event = memory.events[i];
    const std::uint32_t partner = partner_of(event);
    const bool is_pair =
        is_parcel(partner) && tick_of(event) < step.c.plan.length && partner_of(memory.events[partner]) == i;
    if (!is_pair) {
      join_cluster(step, i, representative_of(step, i));
    } else if (i < partner) {
      pairs.representatives[atomicAdd(&pairs.num_representatives, 1U)] = i;
    }
  }
  __syncthreads();
}

}  // namespace pf::cuda
