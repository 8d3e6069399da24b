// Method `exact` on the device, first stage of a step: every parcel's earliest event on the start
// trajectories.
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

}  // namespace pf::cuda
