// Method `exact` on the device: the step is planned; what was solved becomes the parcels' state; the step
// ends.
#pragma once

#include "cuda/exact/clusters.cuh"
#include "cuda/tally.cuh"

namespace pf {

__device__ inline bool reaches_end(const ExactState& state, std::uint64_t until) {
  return since_reset(state, state.plan.length) >= until;
}

__device__ inline bool ends_at_anchoring(const ExactState& state) {
  return (since_reset(state, state.plan.length) >> state.progress.tick_exponent) % kAnchorPeriod == 0;
}

// The parcel's position at the end of the step, also for the renderer.
__device__ inline void write_position(const ExactLaunch& launch, const ExactState& state, std::uint32_t i,
                                      Vec2i end, Vec2f velocity) {
  launch.arrays.present[state.current_buffer ^ 1U][i] = end;
  if (launch.draw.position_m != nullptr && reaches_end(state, launch.until))
    draw_parcel(launch.draw, launch.run.physics.world, i, end, velocity);
}

// Where it will be if nothing happens to it any more.
template <Boundary kBoundary>
__device__ void write_end(const ExactConstants& c, const ExactLaunch& launch, const ExactState& state,
                          std::uint32_t i, const Trajectory& trajectory) {
  const Vec2i end = position_at<kBoundary>(c, trajectory, static_cast<std::int32_t>(c.plan.length));
  write_position(launch, state, i, end, trajectory.velocity);
}

__device__ inline void add_events(const EventSums& events, EventSums& sum) {
  sum.num_events += events.num_events;
  sum.num_collisions += events.num_collisions;
  sum.num_hits += events.num_hits;
  sum.num_retired += events.num_retired;
  sum.max_overlap = fmaxf(sum.max_overlap, events.max_overlap);
  sum.impulse_sum += events.impulse_sum;
  sum.ball_x += events.ball_x;
  sum.ball_y += events.ball_y;
  sum.ball_torque += events.ball_torque;
  sum.event_hash += events.event_hash;
}

// Adds the sums of a warp's threads to the block's tally, and the number of events to the step's.
__device__ inline void reduce_warp(const EventSums& sum, TallySlot& tally, ExactState& state) {
  if (!__any_sync(kWholeWarp, sum.num_events > 0)) return;
  const bool leads = threadIdx.x % 32 == 0;
  const auto add = [&](unsigned long long& to, unsigned long long value) {
    value = sum_over_warp(value);
    if (leads && value != 0) atomicAdd(&to, value);
  };
  const unsigned events = warp_add(sum.num_events);
  const unsigned retired = warp_add(sum.num_retired);
  const unsigned overlap = warp_max(__float_as_uint(sum.max_overlap));
  if (leads) {
    atomicAdd(&state.num_events, static_cast<unsigned long long>(events));
    if (retired != 0) atomicAdd(&tally.num_retired, retired);
    atomicMax(&tally.max_overlap_bits, overlap);
  }
  add(tally.num_collisions, sum.num_collisions);
  add(tally.impulse_sum, static_cast<unsigned long long>(sum.impulse_sum));
  add(tally.event_hash, sum.event_hash);
  const unsigned hits = warp_add(sum.num_hits);
  if (hits == 0) return;
  if (leads) atomicAdd(&tally.num_hits, hits);
  add(tally.ball_x, static_cast<unsigned long long>(sum.ball_x));
  add(tally.ball_y, static_cast<unsigned long long>(sum.ball_y));
  add(tally.ball_torque, static_cast<unsigned long long>(sum.ball_torque));
}

// Commits `num` members of a segment from `first` on, every `stride`-th. Whole warps call it.
template <Boundary kBoundary>
__device__ void commit(const ExactConstants& c, const ExactLaunch& launch, ExactState& state,
                       std::uint32_t slice, std::uint32_t num, std::uint32_t first, std::uint32_t stride,
                       TallySlot& tally) {
  const ExactArrays& a = launch.arrays;
  EventSums sum;
  for (std::uint32_t k = first; k < num; k += stride) {
    const std::uint32_t place = slice * a.member_capacity + k;
    const ClusterMember member = a.members[place];
    const std::uint32_t i = member.index;
    if (a.owner[i] == i) add_events(a.records[place].sum, sum);
    if (!member.has_changed) continue;
    a.trajectories.position[i] = member.trajectory.anchor;
    a.trajectories.velocity[i] = member.trajectory.velocity;
    a.trajectories.tick[i] = member.trajectory.tick;
    if (a.trajectories.last_contact_tick) a.trajectories.last_contact_tick[i] = member.last_contact_tick;
    write_end<kBoundary>(c, launch, state, i, member.trajectory);
  }
  if (slice == 0 && first == 0 && c.plan.ball == BallRole::participant && state.ball_owner == kBallCluster)
    add_events(record_of(a, kBallCluster).sum, sum);
  reduce_warp(sum, tally, state);
}

// Plans the step from now on: its length, the bound, the ball, and empty counters. One thread.
__device__ inline void plan_next(const RunConstants& run, std::uint64_t until, ExactState& state) {
  state.plan = plan_step(run, state.progress, until, state.max_ticks);
  const ExactConstants c{run, state.plan};
  state.ball = ball_in_step(c, state.progress);
  if (c.plan.ball != BallRole::absent)
    state.ball_neighbourhood = neighbourhood_of(c, state.ball.trajectory);
  state.list_overflow = 0;
  state.solve_failed = 0;
  state.too_fast_bits = 0;
  state.fastest_after_bits = 0;
  state.num_near_ball = 0;
  state.num_representatives = 0;
  state.num_begun = 0;
  state.num_conflicts[0] = state.num_conflicts[1] = 0;
  state.num_todo = 0;
  state.num_events = 0;
  state.ball_owner = kBallCluster;
  state.ball_has_changed = 0;
}

__device__ inline double fastest_after_mps(const ExactState& state) {
  return sqrt(static_cast<double>(__uint_as_float(load_fresh(&state.fastest_after_bits))));
}
__device__ inline double fastest_of_all_mps(const ExactState& state) {
  const double parcels = fastest_after_mps(state);
  const double ball = static_cast<double>(__uint_as_float(load_fresh(&state.too_fast_bits)));
  return parcels > ball ? parcels : ball;
}

// After solving, one warp: totals, the ball and the time move on, or the step is planned anew.
__device__ __noinline__ inline void finish_step_on_device(const ExactLaunch& launch, bool finished) {
  ExactState& state = *launch.state;
  const TallySlot sum = sum_slots(launch.slots[threadIdx.x]);
  launch.slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  if (finished) {
    add_to_totals(sum, *launch.step_state);
    state.event_hash += sum.event_hash;
    const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                        static_cast<std::int64_t>(sum.ball_torque)};
    const double at_begin = sqrt(static_cast<double>(__uint_as_float(sum.max_speed2_bits)));
    const ExactConstants c{launch.run, state.plan};
    ExactProgress progress = state.progress;
    const ExactBall ball = c.plan.ball == BallRole::participant ? state.ball_now : state.ball;
    advance_progress(c, ball, {hits, at_begin, fastest_after_mps(state), state.num_events}, progress);
    state.progress = progress;
    state.current_buffer ^= 1U;
    state.max_ticks = static_cast<std::uint32_t>(kAnchorPeriod);
    launch.step_state->ball = progress.ball;
  } else {
    state.num_retried += 1;
    const double needed = fastest_of_all_mps(state);
    if (needed > state.plan.max_speed_mps) {
      state.progress.raised_bound_mps = kSpeedMargin * needed;
    } else {
      state.max_ticks = state.plan.length / 2;
      if (state.max_ticks == 0) state.unresolvable = 1;
    }
  }
}

// Anchors every line anew at the present moment, in ticks that suit the speeds. All threads of the grid, or
// of one block, call it; sync() lets them wait for each other.
template <class Sync>
__device__ void anchor_all(const ExactLaunch& launch, std::uint32_t rank, std::uint32_t num_threads,
                           Sync sync) {
  ExactState& state = *launch.state;
  const ExactArrays& a = launch.arrays;
  const Physics& physics = launch.run.physics;
  if (rank == 0) state.fastest_now_bits = 0;
  sync();
  unsigned fastest2 = 0;
  for (std::uint32_t i = rank; i < launch.space.num_parcels; i += num_threads) {
    const Vec2f v = a.trajectories.velocity[i];
    const float speed2 = dot(v, v);
    if (!is_retired(a.present[state.current_buffer][i]) && speed2 < 1e30F)
      fastest2 = max(fastest2, __float_as_uint(speed2));
  }
  fastest2 = warp_max(fastest2);
  if (rank % 32 == 0) atomicMax(&state.fastest_now_bits, fastest2);
  sync();
  double fastest_mps = sqrt(static_cast<double>(__uint_as_float(load_fresh(&state.fastest_now_bits))));
  if (physics.ball.exists) fastest_mps = max(fastest_mps, surface_speed_mps(physics, state.progress.ball));
  const std::uint64_t now = state.progress.now;
  const std::uint32_t before = state.progress.tick_exponent;
  const std::uint32_t tick_exponent = choose_tick_exponent(launch.run.reference_ticks, before, fastest_mps);
  for (std::uint32_t i = rank; i < launch.space.num_parcels; i += num_threads) {
    a.trajectories.position[i] = a.present[state.current_buffer][i];
    a.trajectories.tick[i] = static_cast<std::uint32_t>(now >> tick_exponent);
    if (a.trajectories.last_contact_tick) a.trajectories.last_contact_tick[i] = rescaled_contact_tick(a.trajectories.last_contact_tick[i], now, before, tick_exponent);
  }
  sync();
  if (rank != 0) return;
  state.progress.tick_exponent = tick_exponent;
  state.progress.preferred_ticks =
      ldexp(state.progress.preferred_ticks, static_cast<int>(before) - static_cast<int>(tick_exponent));
}

__device__ inline bool is_solved(const ExactState& state) {
  return state.list_overflow == 0 && load_fresh(&state.solve_failed) == 0 &&
         fastest_of_all_mps(state) <= state.plan.max_speed_mps;
}

}  // namespace pf
