// Method `exact` on the device, first stage of a step: every parcel's earliest event on the start
// trajectories. First stage of a later window of the step: which parcels have an event in it.
#pragma once

#include "cuda/exact/ball_path.cuh"
#include "cuda/exact/positions.cuh"
#include "cuda/exact/region_speeds.cuh"

namespace pf::cuda {

// Consecutive threads, a team, that predict one parcel between windows, where few are predicted and the rest
// of the grid waits. Worst frame of `bullet` with 10^6 parcels, ms: 521; with 1, 8, 32 910, 580, 533.
constexpr unsigned kLanesOfParcel = 16;

// Calls visit(j, tick) for the collisions of parcel i, on its start trajectory `own`, with each other parcel.
// extent: of the search for these.
template <Boundary kBoundary, bool kReadOnly, class Visit>
__device__ void visit_collisions(const StepContext& step, std::uint32_t i, const Trajectory& own,
                                 const SearchExtent& extent, NearList<kExactBlock>::Space& near_space,
                                 Visit visit) {
  const Vec2i* positions = step.start_positions();
  const Vec2i here = positions[i];
  const SearchCircle circle{here, i, extent.reach, extent.radius * extent.radius};
  const auto may_collide_with = [&](std::uint32_t j) {
    const Vec2i offset = separation<kBoundary>(step.launch.space.world, here, positions[j]);
    return may_collide(offset, step.memory.trajectories.velocity[j] - own.velocity, step.contact_distance(),
                       step.units_in_step());
  };
  const auto keep = [&](std::uint32_t j) {
    const Trajectory other = step.start_trajectory(j);
    if (!is_retired(other.anchor)) visit(j, collision_tick<kBoundary>(step.c, own, other));
  };
  NearList<kExactBlock> near{near_space};
  search<kBoundary, kReadOnly>(step.launch.space, positions, circle, [&](std::uint32_t j) { near.push(j); });
  if (near.holds_all()) {
    near.keep_if(may_collide_with);
    for (unsigned k = 0; k < near.num; ++k) keep(near[k]);
  } else {  // a crowd: search again, testing on the way
    search<kBoundary, kReadOnly>(step.launch.space, positions, circle, [&](std::uint32_t j) {
      if (may_collide_with(j)) keep(j);
    });
  }
}

// The same for parcels that are predicted anew between windows, one by each team. is_there: the team has
// one. Each thread sees its share of the collisions. Whole warps call it.
template <Boundary kBoundary, class Visit>
__device__ void visit_collisions_by_teams(const StepContext& step, bool is_there, std::uint32_t i,
                                          const Trajectory& own, NearList<kExactBlock>::Space& near_space,
                                          Visit visit) {
  constexpr unsigned kAhead = 2;
  const DeviceSearch& space = step.launch.space;
  const Vec2i* positions = step.start_positions();
  const Vec2i here = positions[i];
  const SearchExtent extent = search_extent(step, sqrtf(dot(own.velocity, own.velocity)),
                                            static_cast<float>(step.c.plan.max_speed_mps));
  NearList<kExactBlock> near{near_space};
  const auto compare_all = [&] {
    for (unsigned k = 0; k < near.num; ++k) {
      const Trajectory other = step.start_trajectory(near[k]);
      if (!is_retired(other.anchor)) visit(near[k], collision_tick<kBoundary>(step.c, own, other));
    }
    near.num = 0;
  };
  SearchBox box{};
  if (is_there) box = box_around<kBoundary>(space, here, extent.reach);
  for (CandidateCursor<kLanesOfParcel, kAhead> cursor(space, box); cursor.has_more();) {
    std::uint32_t candidates[kAhead];
    Vec2i there[kAhead];
    Vec2f velocity[kAhead];
    cursor.next(candidates);
    for (unsigned u = 0; u < kAhead; ++u) {
      const std::uint32_t j = min(candidates[u], space.num_parcels - 1);
      there[u] = positions[j];
      velocity[u] = step.memory.trajectories.velocity[j];
    }
    for (unsigned u = 0; u < kAhead; ++u) {
      const Vec2i offset = separation<kBoundary>(space.world, here, there[u]);
      const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
      if (candidates[u] != kInvalidIndex && candidates[u] != i &&
          x * x + y * y < extent.radius * extent.radius &&
          may_collide(offset, velocity[u] - own.velocity, step.contact_distance(), step.units_in_step()))
        near.push(candidates[u]);
    }
    if (near.num + kAhead > NearList<kExactBlock>::kMax) compare_all();
  }
  compare_all();
}

// Reports parcel i as not finite.
__device__ inline void note_invalid(const StepContext& step, std::uint32_t i) {
  TallySlot& slot = step.launch.slots[blockIdx.x % kNumSlots];
  atomicAdd(&slot.num_invalid, 1U);
  atomicMax(&slot.first_invalid_id, ~step.id(i));
}

// Replaces `best` if parcel i, on its start trajectory, reaches the edge or a frozen ball before it.
template <Boundary kBoundary>
__device__ void keep_edge_and_frozen_ball(const StepContext& step, std::uint32_t i, const Trajectory& own,
                                          Event& best) {
  const Vec2i here = step.start_positions()[i];
  if (may_reach_edge<kBoundary>(step.c, here)) keep_edge_event<kBoundary>(step.c, own, best);
  if (step.c.plan.ball == BallRole::frozen && step.is_near_ball<kBoundary>(here))
    keep_earlier(best, {ball_collision_tick<kBoundary>(step.c, step.state.ball.trajectory, own), kBallPartner,
                        kBallPartner});
}

// Earliest event of parcel i. Sets speed2, (m/s)^2, to 0 if it has retired or is not finite, and writes where
// the parcel is at the step's end if no event changes its trajectory.
template <Boundary kBoundary, bool kReadOnly, bool kByRegion>
__device__ Event predict_event(const StepContext& step, std::uint32_t i,
                               NearList<kExactBlock>::Space& near_space, float& speed2) {
  const Trajectory own = step.start_trajectory(i);
  Event best;
  speed2 = 0.0F;
  if (is_retired(own.anchor)) {
    write_position(step, i, own.anchor, own.velocity);
    return best;
  }
  speed2 = dot(own.velocity, own.velocity);
  if (!(speed2 < kMaxFiniteSpeed2)) {
    note_invalid(step, i);
    speed2 = 0.0F;
    write_position(step, i, own.anchor, own.velocity);
    return best;
  }
  write_end_position<kBoundary>(step, i, own);
  if (step.c.run.physics.parcels.contacts) {
    const float speed = sqrtf(speed2);
    const auto fastest = static_cast<float>(step.state.progress.fastest_mps);
    const SearchExtent extent = kByRegion ? search_extent_here<kBoundary, kReadOnly>(step, i, speed, fastest)
                                          : search_extent(step, speed, fastest);
    visit_collisions<kBoundary, kReadOnly>(
        step, i, own, extent, near_space,
        [&](std::uint32_t j, std::uint32_t tick) { step.keep_collision(tick, j, best); });
  }
  keep_edge_and_frozen_ball<kBoundary>(step, i, own, best);
  return best;
}

// Appends active parcels to a slice, and reserves the slot of each among the members. Whole warps call it.
__device__ inline void append_active(const StepContext& step, std::uint32_t slice, std::uint32_t i,
                                     bool is_active) {
  const StepMemory& memory = step.memory;
  const unsigned active = __ballot_sync(kWholeWarp, is_active);
  if (active == 0) return;
  const unsigned lane = threadIdx.x % 32;
  std::uint32_t base = 0;
  if (lane == 0) base = atomicAdd(&memory.counts[slice].active, static_cast<unsigned>(__popc(active)));
  const std::uint32_t k = __shfl_sync(kWholeWarp, base, 0) + __popc(active & ((1U << lane) - 1U));
  if (!is_active) return;
  if (k < memory.active.capacity) {
    memory.active.items[static_cast<std::size_t>(slice) * memory.active.capacity + k] = i;
    memory.member_slot[i] = slice * memory.member_capacity + k;
  } else {
    step.state.list_overflow = 1;
  }
}

template <Boundary kBoundary>
__device__ void append_if_near_ball(const StepContext& step, std::uint32_t i) {
  const Vec2i here = step.start_positions()[i];
  if (is_retired(here) || !step.is_near_ball<kBoundary>(here)) return;
  const CommonList& near_ball = step.memory.near_ball;
  const std::uint32_t k = atomicAdd(&step.state.num_near_ball, 1U);
  if (k < near_ball.capacity) {
    near_ball.items[k] = i;
  } else {
    step.state.near_ball_overflow = 1;
  }
}

__device__ inline void note_speed(TallySlot& slot, float speed2) {
  const unsigned fastest = warp_max(__float_as_uint(speed2));
  if (threadIdx.x % 32 == 0 && fastest > load_fresh(&slot.max_speed2_bits))
    atomicMax(&slot.max_speed2_bits, fastest);
}

template <Boundary kBoundary>
__device__ bool is_near_participant(const StepContext& step, std::uint32_t i) {
  return step.has_participant() && i < step.launch.space.num_parcels &&
         step.is_near_ball<kBoundary>(step.start_positions()[i]);
}

// Returns whether parcel i hits a participating ball in the window, if nothing happens to the two before;
// then the hit is noted. The events that parcels keep are others: after each hit the ball is on a new
// trajectory.
template <Boundary kBoundary>
__device__ bool hits_participant_now(const StepContext& step, std::uint32_t i) {
  if (!is_near_participant<kBoundary>(step, i)) return false;
  const Trajectory own = step.start_trajectory(i);
  if (is_retired(own.anchor) || !(dot(own.velocity, own.velocity) < kMaxFiniteSpeed2)) return false;
  const std::uint32_t tick = hit_on_path<kBoundary>(step, {own, step.id(i)}).tick;
  if (tick >= step.state.window_end) return false;
  add_ball_hit(step, {tick, step.id(i), i, 0, own, 0});
  return true;
}

// Sets the earliest tick at which a parcel of the warp's tile that is not active keeps an event. Tiles near a
// participating ball are looked through in every window. Whole warps call it. i: the parcel of the thread, or
// beyond the last one.
template <Boundary kBoundary>
__device__ void set_earliest(const StepContext& step, std::uint32_t i, std::uint32_t tick, bool is_active) {
  static_assert(kTile == 32);
  if (is_near_participant<kBoundary>(step, i)) tick = 0;
  const std::uint32_t later = warp_min(is_active && tick != 0 ? kNoTick : tick);
  if (threadIdx.x % 32 == 0 && i < step.launch.space.num_parcels) step.memory.earliest[i / kTile] = later;
}

// Predicts for parcel i if there is one. Whole warps call it. kReadOnly: see search().
template <Boundary kBoundary, bool kReadOnly, bool kByRegion>
__device__ void predict(const StepContext& step, std::uint32_t i, std::uint32_t slice,
                        NearList<kExactBlock>::Space& near_space) {
  const StepMemory& memory = step.memory;
  bool is_active = false;
  std::uint32_t tick = kNoTick;
  float speed2 = 0.0F;
  if (i < step.launch.space.num_parcels) {
    const Event event = predict_event<kBoundary, kReadOnly, kByRegion>(step, i, near_space, speed2);
    is_active = hits_participant_now<kBoundary>(step, i) || event.tick < step.state.window_end;
    tick = event.tick;
    memory.events[i] = event_key(event.tick, event.partner);
    memory.owner[i] = kInvalidIndex;
    if (is_active) memory.list_head[i] = kInvalidIndex;
    if (step.has_participant()) append_if_near_ball<kBoundary>(step, i);
  }
  append_active(step, slice, i, is_active);
  set_earliest<kBoundary>(step, i, tick, is_active);
  note_speed(step.launch.slots[blockIdx.x % kNumSlots], speed2);
}

// ---- later windows of the step

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
__device__ EventKey predict_anew(const StepContext& step, std::uint32_t tile, bool is_wanted,
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
    const EventKey anew = predict_anew<kBoundary>(step, tile, is_wanted, near_space);
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

// Tiles that lie side by side, as those before the ball do, go to different blocks, but for so many, which
// one sector of memory holds.
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
