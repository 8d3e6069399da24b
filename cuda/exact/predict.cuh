// Method `exact` on the device: what each parcel meets first, on the lines of the step's begin.
#pragma once

#include "cuda/exact/commit.cuh"

namespace pf {

// First prediction of parcel i, on the line that it has at the begin.
template <Boundary kBoundary, bool kReadOnly>
__device__ Event predict_first(const ExactConstants& c, const ExactLaunch& launch, const ExactState& state,
                               std::uint32_t i, NearList<kExactBlock>::Space& near_space, float& speed2) {
  const ExactArrays& a = launch.arrays;
  const Vec2i* present = a.present[state.current_buffer];
  const Vec2i at = present[i];
  const Trajectory here = trajectory_of(a, i);
  Event best;
  speed2 = 0.0F;
  if (is_retired(here.anchor)) {
    write_position(launch, state, i, here.anchor, here.velocity);
    return best;
  }
  speed2 = dot(here.velocity, here.velocity);
  if (!(speed2 < 1e30F)) {
    TallySlot& slot = launch.slots[blockIdx.x % kNumSlots];
    atomicAdd(&slot.num_invalid, 1U);
    atomicMax(&slot.first_invalid_id, ~a.trajectories.id[i]);
    speed2 = 0.0F;
    write_position(launch, state, i, here.anchor, here.velocity);
    return best;
  }
  write_end<kBoundary>(c, launch, state, i, here);
  if (c.run.physics.parcels.contacts) {
    const auto contact = static_cast<float>(c.run.contact_distance);
    const auto per_mps = static_cast<float>(c.plan.units_per_tick * c.plan.length);
    const float fastest = sqrtf(speed2) + static_cast<float>(state.progress.fastest_mps);
    const float distance = (contact + fastest * per_mps) * kAbove + static_cast<float>(kRoundingMargin);
    const float reach = distance + static_cast<float>(state.progress.max_displacement) * kAbove;
    NearList<kExactBlock> near{near_space};
    const auto find = [&](auto found) {
      search<kBoundary, kReadOnly>(launch.space, present, at, i, saturated(reach), distance * distance,
                                   found);
    };
    const auto may = [&](std::uint32_t j) {
      const Vec2i offset = separation<kBoundary>(launch.space.world, at, present[j]);
      return may_collide(offset, a.trajectories.velocity[j] - here.velocity, contact, per_mps);
    };
    const auto meet = [&](std::uint32_t j) {
      const Trajectory there = trajectory_of(a, j);
      if (!is_retired(there.anchor)) keep_collision(best, collision_tick<kBoundary>(c, here, there), j, a.trajectories.id);
    };
    find([&](std::uint32_t j, Vec2i) { near.push(j); });
    if (near.holds_all()) {
      near.keep_if(may);
      for (unsigned k = 0; k < near.num; ++k) meet(near[k]);
    } else {  // a crowd
      find([&](std::uint32_t j, Vec2i) {
        if (may(j)) meet(j);
      });
    }
  }
  if (may_reach_edge<kBoundary>(c, at)) keep_edge_event<kBoundary>(c, here, best);
  if (c.plan.ball == BallRole::frozen && is_in<kBoundary>(state.ball_neighbourhood, c.run.physics.world, at))
    keep_earlier(best, {ball_collision_tick<kBoundary>(c, state.ball.trajectory, here), kBallPartner, kBallPartner});
  return best;
}

// Adds parcels to a segment of the active ones, and says where among the members they will be. Whole warps
// call it.
__device__ inline void append_active(const ExactArrays& a, std::uint32_t slice, std::uint32_t i,
                                     bool is_active, ExactState& state) {
  const unsigned active = __ballot_sync(kWholeWarp, is_active);
  if (active == 0) return;
  const unsigned lane = threadIdx.x % 32;
  std::uint32_t base = 0;
  if (lane == 0) base = atomicAdd(&a.counts[slice].active, static_cast<unsigned>(__popc(active)));
  const std::uint32_t place = __shfl_sync(kWholeWarp, base, 0) + __popc(active & ((1U << lane) - 1U));
  if (!is_active) return;
  if (place < a.active.capacity) {
    a.active.items[static_cast<std::size_t>(slice) * a.active.capacity + place] = i;
    a.member_slot[i] = slice * a.member_capacity + place;
  } else {
    state.list_overflow = 1;
  }
}

__device__ inline void note_speed(TallySlot& slot, float speed2) {
  const unsigned fastest = warp_max(__float_as_uint(speed2));
  if (threadIdx.x % 32 == 0 && fastest > load_fresh(&slot.max_speed2_bits))
    atomicMax(&slot.max_speed2_bits, fastest);
}

// Predicts for parcel i, or for none; whole warps call it.
template <Boundary kBoundary, bool kReadOnly>
__device__ void predict_one(const ExactConstants& c, const ExactLaunch& launch, std::uint32_t i,
                            std::uint32_t slice, NearList<kExactBlock>::Space& near_space) {
  ExactState& state = *launch.state;
  const ExactArrays& a = launch.arrays;
  bool is_active = false;
  float speed2 = 0.0F;
  if (i < launch.space.num_parcels) {
    const Event event = predict_first<kBoundary, kReadOnly>(c, launch, state, i, near_space, speed2);
    is_active = event.tick != kNoTick;
    a.event_tick[i] = event.tick;
    a.event_partner[i] = event.partner;
    a.owner[i] = kInvalidIndex;
    if (is_active) a.list_head[i] = kInvalidIndex;
    if (c.plan.ball == BallRole::participant) {
      const Vec2i at = a.present[state.current_buffer][i];
      if (!is_retired(at) && is_in<kBoundary>(state.ball_neighbourhood, c.run.physics.world, at)) {
        const std::uint32_t place = atomicAdd(&state.num_near_ball, 1U);
        if (place < a.near_ball.capacity) {
          a.near_ball.items[place] = i;
        } else {
          state.list_overflow = 1;
        }
      }
    }
  }
  append_active(a, slice, i, is_active, state);
  note_speed(launch.slots[blockIdx.x % kNumSlots], speed2);
}

}  // namespace pf
