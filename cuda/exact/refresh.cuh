// Method `exact` on the device, first stage of a later window of a step: which parcels have an event in it.
#pragma once

#include "cuda/exact/predict.cuh"

namespace pf::cuda {

// Returns whether the due event of parcel i is stale.
template <Boundary kBoundary>
__device__ bool is_stale(const StepContext& step, std::uint32_t i, EventKey event) {
  const std::uint32_t partner = partner_of(event);
  if (!is_parcel(partner)) return false;
  const EventKey of_partner = load_fresh(&step.memory.events[partner]);
  if (of_partner == event_key(tick_of(event), i)) return false;
  // The partner keeps no later event than one that is to come.
  if (tick_of(of_partner) > tick_of(event)) return true;
  const Trajectory other = step.start_trajectory(partner);
  return is_retired(other.anchor) ||
         collision_tick<kBoundary>(step.c, step.start_trajectory(i), other) != tick_of(event);
}

// The first of the events that the threads of a team hold, in all of them. Whole warps call it.
__device__ __forceinline__ Event first_of_team(Event event) {
  for (unsigned offset = kLanesOfParcel / 2; offset > 0; offset /= 2) {
    const auto other = [&](std::uint32_t value) { return __shfl_xor_sync(kWholeWarp, value, offset); };
    keep_earlier(event,
                 {other(event.tick), other(event.partner), other(event.partner_id), other(event.generation)});
  }
  return event;
}

// The part of a thread of its team in the prediction of parcel i, if the team has one. Whole warps call it.
template <Boundary kBoundary>
__device__ Event predict_share(const StepContext& step, bool is_there, std::uint32_t i,
                               NearList<kExactBlock>::Space& near_space) {
  const Trajectory own = step.start_trajectory(i);
  Event best;
  visit_collisions_by_teams<kBoundary>(
      step, is_there, i, own, near_space,
      [&](std::uint32_t j, std::uint32_t tick) { step.keep_collision(tick, j, best); });
  if (is_there && threadIdx.x % kLanesOfParcel == 0) keep_edge_and_frozen_ball<kBoundary>(step, i, own, best);
  return best;
}

// Predicts the parcels of a tile anew whose lanes have is_wanted. Returns the event of the lane's parcel, or
// kNoEventKey. A whole warp calls it.
template <Boundary kBoundary>
__device__ EventKey repredict(const StepContext& step, std::uint32_t tile, bool is_wanted,
                              NearList<kExactBlock>::Space& near_space) {
  constexpr unsigned kNumTeams = 32 / kLanesOfParcel;
  const unsigned lane = threadIdx.x % 32;
  unsigned wanted = __ballot_sync(kWholeWarp, is_wanted);
  unsigned rank = __popc(wanted & ((1U << lane) - 1U));  // of the lane's parcel among those that are left
  EventKey result = kNoEventKey;
  for (; wanted != 0; rank -= kNumTeams) {
    std::uint32_t subject = kInvalidIndex;  // of the lane's team
    for (unsigned team = 0; team < kNumTeams && wanted != 0; ++team, wanted &= wanted - 1) {
      if (team == lane / kLanesOfParcel) subject = tile * kTile + (__ffs(wanted) - 1);
    }
    const bool is_there = subject != kInvalidIndex;
    const Event best =
        first_of_team(predict_share<kBoundary>(step, is_there, is_there ? subject : 0, near_space));
    const EventKey found = event_key(best.tick, best.partner);
    const EventKey of_rank = __shfl_sync(kWholeWarp, found, rank * kLanesOfParcel % 32);
    if (is_wanted && rank < kNumTeams) result = of_rank;
  }
  return result;
}

// Lists a tile's active parcels. A whole warp calls it.
template <Boundary kBoundary>
__device__ void refresh_tile(const StepContext& step, std::uint32_t tile, std::uint32_t slice,
                             NearList<kExactBlock>::Space& near_space) {
  const StepMemory& memory = step.memory;
  const std::uint32_t window_end = step.state.window_end;
  const std::uint32_t i = tile * kTile + threadIdx.x % 32;
  EventKey event = i < step.launch.space.num_parcels ? memory.events[i] : kNoEventKey;
  const bool is_wanted = tick_of(event) < window_end && is_stale<kBoundary>(step, i, event);
  if (__any_sync(kWholeWarp, is_wanted)) {
    const EventKey anew = repredict<kBoundary>(step, tile, is_wanted, near_space);
    if (is_wanted) memory.events[i] = event = anew;
  }
  const bool is_active = hits_participant_now<kBoundary>(step, i) || tick_of(event) < window_end;
  if (is_active) memory.list_head[i] = kInvalidIndex;
  append_active(step, slice, i, is_active);
  set_earliest<kBoundary>(step, i, tick_of(event), is_active);
}

// Tiles of a block that have due events, in shared memory.
struct DueTiles {
  static constexpr unsigned kPerThread = 12;
  std::uint32_t tiles[kPerThread * kExactBlock];
  std::uint32_t num, num_taken;
};

// Tiles that lie side by side, as those before the ball do, go to different blocks, except groups of this
// size, which one sector of memory holds.
constexpr std::uint32_t kTilesTogether = 8;

// Lists tiles of the block's share with due events: the first kPerThread of each thread from `first` on. All
// threads of the block call it.
__device__ inline void list_due_tiles(const StepContext& step, std::uint32_t first, std::uint32_t block,
                                      std::uint32_t num_blocks, DueTiles& due) {
  const std::uint32_t num_tiles = (step.launch.space.num_parcels + kTile - 1) / kTile;
  const std::uint32_t window_end = step.state.window_end;
  __syncthreads();
  if (threadIdx.x == 0) due.num = due.num_taken = 0;
  __syncthreads();
  std::uint32_t tiles[DueTiles::kPerThread];
  bool is_due[DueTiles::kPerThread];
#pragma unroll
  for (unsigned u = 0; u < DueTiles::kPerThread; ++u) {
    const std::uint32_t k = first + u * kExactBlock + threadIdx.x;
    tiles[u] = (k / kTilesTogether * num_blocks + block) * kTilesTogether + k % kTilesTogether;
    is_due[u] = tiles[u] < num_tiles && step.memory.earliest[tiles[u]] < window_end;
  }
#pragma unroll
  for (unsigned u = 0; u < DueTiles::kPerThread; ++u) {
    if (is_due[u]) due.tiles[atomicAdd(&due.num, 1U)] = tiles[u];
  }
  __syncthreads();
}

// Lists all active parcels, and predicts due events that are stale anew. The grid calls it. Where there is a
// ball the first block has no share: it expects hits while the others solve pairs.
template <Boundary kBoundary>
__device__ void refresh(const StepContext& step, DueTiles& due, NearList<kExactBlock>::Space& near_space) {
  const std::uint32_t num_idle = step.has_participant() && gridDim.x > 1 ? 1 : 0;
  if (blockIdx.x < num_idle) return;
  const std::uint32_t num_blocks = gridDim.x - num_idle, block = blockIdx.x - num_idle;
  const std::uint32_t num_tiles = (step.launch.space.num_parcels + kTile - 1) / kTile;
  const std::uint32_t num_groups = (num_tiles + kTilesTogether - 1) / kTilesTogether;
  const std::uint32_t num_mine = (num_groups + num_blocks - 1 - block) / num_blocks * kTilesTogether;
  for (std::uint32_t first = 0; first < num_mine; first += DueTiles::kPerThread * kExactBlock) {
    list_due_tiles(step, first, block, num_blocks, due);
    while (true) {
      std::uint32_t k = 0;
      if (threadIdx.x % 32 == 0) k = atomicAdd(&due.num_taken, 1U);
      k = __shfl_sync(kWholeWarp, k, 0);
      if (k >= due.num) break;
      refresh_tile<kBoundary>(step, due.tiles[k], blockIdx.x, near_space);
    }
  }
}

}  // namespace pf::cuda
