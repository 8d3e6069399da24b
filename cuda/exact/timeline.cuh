// Method `exact` on the device from step to step: planning, ending and retrying steps, and anchoring.
#pragma once

#include "cuda/exact/commit.cuh"

namespace pf::cuda {

__device__ inline bool ends_at_anchoring(const StepContext& step) {
  const ExactState& state = step.state;
  return (step.since_reset(state.plan.length) >> state.progress.tick_exponent) % kAnchorPeriod == 0;
}

__device__ inline void reset_counters(ExactState& state) {
  state.list_overflow = 0;
  state.solve_failed = 0;
  state.too_fast_bits = 0;
  state.fastest_after_bits = 0;
  state.num_near_ball = 0;
  state.num_representatives = 0;
  state.num_taken = 0;
  state.num_conflicts[0] = state.num_conflicts[1] = 0;
  state.num_todo = 0;
  state.num_events = 0;
  state.ball_owner = kBallCluster;
  state.ball_member.has_changed = 0;
}

// Plans the next step, which ends at the latest at `until`. Called by one thread.
__device__ inline void plan_next(const RunConstants& run, std::uint64_t until, ExactState& state) {
  state.plan = plan_step(run, state.progress, until, state.max_ticks);
  const ExactConstants c{run, state.plan};
  state.ball = ball_in_step(c, state.progress);
  if (c.plan.ball != BallRole::absent) state.ball_neighbourhood = neighbourhood_of(c, state.ball.trajectory);
  reset_counters(state);
}

__device__ inline double speed_from_bits(const std::uint32_t* bits) {
  return static_cast<double>(__uint_as_float(load_fresh(bits)));
}
__device__ inline double fastest_after_mps(const ExactState& state) {
  return sqrt(speed_from_bits(&state.fastest_after_bits));
}
// Largest speed in the step: of parcels after events, and of the ball's surface where it exceeds the bound.
__device__ inline double fastest_of_all_mps(const ExactState& state) {
  const double parcels = fastest_after_mps(state), ball = speed_from_bits(&state.too_fast_bits);
  return parcels > ball ? parcels : ball;
}

__device__ inline bool is_solved(const ExactState& state) {
  return state.list_overflow == 0 && load_fresh(&state.solve_failed) == 0 &&
         fastest_of_all_mps(state) <= state.plan.max_speed_mps;
}

// Moves totals, ball and time to the end of a solved step. sum: over the tally's slots.
__device__ inline void finish_solved(const ExactLaunch& launch, const TallySlot& sum) {
  ExactState& state = *launch.state;
  add_to_totals(sum, *launch.step_state);
  state.event_hash += sum.event_hash;
  const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                      static_cast<std::int64_t>(sum.ball_torque)};
  const double at_start = sqrt(static_cast<double>(__uint_as_float(sum.max_speed2_bits)));
  const ExactConstants c{launch.run, state.plan};
  const ExactBall ball = c.plan.ball == BallRole::participant ? state.ball_member.now : state.ball;
  ExactProgress progress = state.progress;
  advance_progress(c, ball, {hits, at_start, fastest_after_mps(state), state.num_events}, progress);
  state.progress = progress;
  state.current_buffer ^= 1U;
  state.max_ticks = static_cast<std::uint32_t>(kAnchorPeriod);
  launch.step_state->ball = progress.ball;
}

// Raises the bound on speeds if it was exceeded; else halves the step.
__device__ inline void plan_retry(ExactState& state) {
  state.num_retried += 1;
  const double needed = fastest_of_all_mps(state);
  if (needed > state.plan.max_speed_mps) {
    state.progress.raised_bound_mps = kSpeedMargin * needed;
    return;
  }
  state.max_ticks = state.plan.length / 2;
  if (state.max_ticks == 0) state.unresolvable = 1;
}

// Ends a step that is committed, or one that must be retried. Called by one warp.
__device__ __noinline__ inline void finish_step(const ExactLaunch& launch, bool is_committed) {
  const TallySlot sum = sum_slots(launch.slots[threadIdx.x]);
  launch.slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  if (is_committed) {
    finish_solved(launch, sum);
  } else {
    plan_retry(*launch.state);
  }
}

// Speed of the fastest parcel that moves and is finite. The threads with ranks 0 to num_threads - 1 call it;
// synchronize() waits for all of them.
template <class Synchronize>
__device__ double fastest_parcel_mps(const ExactLaunch& launch, std::uint32_t rank, std::uint32_t num_threads,
                                     Synchronize synchronize) {
  const StepMemory& memory = launch.memory;
  ExactState& state = *launch.state;
  if (rank == 0) state.fastest_now_bits = 0;
  synchronize();
  unsigned fastest2 = 0;
  for (std::uint32_t i = rank; i < launch.space.num_parcels; i += num_threads) {
    const Vec2f v = memory.trajectories.velocity[i];
    const float speed2 = dot(v, v);
    if (!is_retired(memory.positions[state.current_buffer][i]) && speed2 < kMaxFiniteSpeed2)
      fastest2 = max(fastest2, __float_as_uint(speed2));
  }
  fastest2 = warp_max(fastest2);
  if (rank % 32 == 0) atomicMax(&state.fastest_now_bits, fastest2);
  synchronize();
  return sqrt(speed_from_bits(&state.fastest_now_bits));
}

// Anchors every parcel at its position, and chooses the length of a tick. Called like fastest_parcel_mps.
template <class Synchronize>
__device__ void anchor_all(const ExactLaunch& launch, std::uint32_t rank, std::uint32_t num_threads,
                           Synchronize synchronize) {
  const ParcelPointers& parcels = launch.memory.trajectories;
  const Physics& physics = launch.run.physics;
  ExactState& state = *launch.state;
  double fastest_mps = fastest_parcel_mps(launch, rank, num_threads, synchronize);
  if (physics.ball.exists) fastest_mps = max(fastest_mps, surface_speed_mps(physics, state.progress.ball));
  const std::uint64_t now = state.progress.now;
  const std::uint32_t before = state.progress.tick_exponent;
  const std::uint32_t exponent = choose_tick_exponent(launch.run.reference_ticks, before, fastest_mps);
  for (std::uint32_t i = rank; i < launch.space.num_parcels; i += num_threads) {
    parcels.position[i] = launch.memory.positions[state.current_buffer][i];
    parcels.tick[i] = static_cast<std::uint32_t>(now >> exponent);
    if (parcels.last_contact_tick)
      parcels.last_contact_tick[i] =
          rescaled_contact_tick(parcels.last_contact_tick[i], now, before, exponent);
  }
  synchronize();
  if (rank != 0) return;
  state.progress.tick_exponent = exponent;
  state.progress.preferred_ticks =
      ldexp(state.progress.preferred_ticks, static_cast<int>(before) - static_cast<int>(exponent));
}

}  // namespace pf::cuda
