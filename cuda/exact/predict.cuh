// Method `exact` on the device, first stage of a step: every parcel's earliest event on the start
// trajectories.
#pragma once

#include "cuda/exact/commit.cuh"

namespace pf::cuda {

// Replaces `best` if a collision of parcel i, on its start trajectory `own`, comes before it.
template <Boundary kBoundary, bool kReadOnly>
__device__ void keep_earliest_collision(const StepContext& step, std::uint32_t i, const Trajectory& own,
                                        NearList<kExactBlock>::Space& near_space, Event& best) {
  const Vec2i* positions = step.start_positions();
  const Vec2i here = positions[i];
  const ExactState& state = step.state;
  const float speed = sqrtf(dot(own.velocity, own.velocity));
  const float radius = search_radius(step.c, speed + static_cast<float>(state.progress.fastest_mps));
  const SearchCircle circle{here, i, step.search_reach(radius), radius * radius};
  const auto may_collide_with = [&](std::uint32_t j) {
    const Vec2i offset = separation<kBoundary>(step.launch.space.world, here, positions[j]);
    return may_collide(offset, step.memory.trajectories.velocity[j] - own.velocity, step.contact_distance(),
                       step.units_in_step());
  };
  const auto keep = [&](std::uint32_t j) {
    const Trajectory other = step.start_trajectory(j);
    if (!is_retired(other.anchor))
      step.keep_collision(collision_tick<kBoundary>(step.c, own, other), j, best);
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

// Reports parcel i as not finite.
__device__ inline void note_invalid(const StepContext& step, std::uint32_t i) {
  TallySlot& slot = step.launch.slots[blockIdx.x % kNumSlots];
  atomicAdd(&slot.num_invalid, 1U);
  atomicMax(&slot.first_invalid_id, ~step.id(i));
}

// Earliest event of parcel i. Sets speed2, (m/s)^2, to 0 if it has retired or is not finite, and writes where
// the parcel is at the step's end if no event changes its trajectory.
template <Boundary kBoundary, bool kReadOnly>
__device__ Event predict_event(const StepContext& step, std::uint32_t i,
                               NearList<kExactBlock>::Space& near_space, float& speed2) {
  const Vec2i here = step.start_positions()[i];
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
  if (step.c.run.physics.parcels.contacts)
    keep_earliest_collision<kBoundary, kReadOnly>(step, i, own, near_space, best);
  if (may_reach_edge<kBoundary>(step.c, here)) keep_edge_event<kBoundary>(step.c, own, best);
  if (step.c.plan.ball == BallRole::frozen && step.is_near_ball<kBoundary>(here))
    keep_earlier(best, {ball_collision_tick<kBoundary>(step.c, step.state.ball.trajectory, own), kBallPartner,
                        kBallPartner});
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
    step.state.list_overflow = 1;
  }
}

__device__ inline void note_speed(TallySlot& slot, float speed2) {
  const unsigned fastest = warp_max(__float_as_uint(speed2));
  if (threadIdx.x % 32 == 0 && fastest > load_fresh(&slot.max_speed2_bits))
    atomicMax(&slot.max_speed2_bits, fastest);
}

// Predicts for parcel i if there is one. Whole warps call it. kReadOnly: see search().
template <Boundary kBoundary, bool kReadOnly>
__device__ void predict(const StepContext& step, std::uint32_t i, std::uint32_t slice,
                        NearList<kExactBlock>::Space& near_space) {
  const StepMemory& memory = step.memory;
  bool is_active = false;
  float speed2 = 0.0F;
  if (i < step.launch.space.num_parcels) {
    const Event event = predict_event<kBoundary, kReadOnly>(step, i, near_space, speed2);
    is_active = event.tick != kNoTick;
    memory.event_tick[i] = event.tick;
    memory.event_partner[i] = event.partner;
    memory.owner[i] = kInvalidIndex;
    if (is_active) memory.list_head[i] = kInvalidIndex;
    if (step.has_participant()) append_if_near_ball<kBoundary>(step, i);
  }
  append_active(step, slice, i, is_active);
  note_speed(step.launch.slots[blockIdx.x % kNumSlots], speed2);
}

}  // namespace pf::cuda
