// Method `exact` on the device through time: planning, ending and retrying windows and steps, the ball's
// chords, and anchoring.
#pragma once

#include "cuda/exact/ball_trace.cuh"
#include "cuda/exact/commit.cuh"

namespace pf::cuda {

__device__ inline bool ends_at_anchoring(const StepContext& step) {
  const ExactState& state = step.state;
  return (step.since_reset(state.plan.length) >> state.progress.tick_exponent) % kAnchorPeriod == 0;
}

__device__ inline double speed_from_bits(const std::uint32_t* bits) {
  return static_cast<double>(__uint_as_float(load_fresh(bits)));
}
__device__ inline double fastest_after_mps(const ExactState& state) {
  return sqrt(speed_from_bits(&state.fastest_after_bits));
}
// Largest speed in the window: of parcels after events, and of the ball's surface where it exceeds the bound.
__device__ inline double fastest_of_all_mps(const ExactState& state) {
  const double parcels = fastest_after_mps(state), ball = speed_from_bits(&state.too_fast_bits);
  return parcels > ball ? parcels : ball;
}

__device__ inline bool is_solved(const ExactState& state) {
  return state.list_overflow == 0 && state.near_ball_overflow == 0 && load_fresh(&state.solve_failed) == 0 &&
         fastest_of_all_mps(state) <= state.plan.max_speed_mps;
}

// ---- the ball's chords. Each function is called by one thread.

// The tick up to which windows may reach: where the step ends, or the ball's chord.
__device__ inline std::uint32_t end_of_windows(const ExactState& state) {
  if (state.plan.ball != BallRole::participant) return state.plan.length;
  return min(state.plan.length, static_cast<std::uint32_t>(state.chord_begin) + state.chord.length);
}

// Starts the chord that begins at a tick of the step, and ends at the latest at `until`.
__device__ inline void begin_chord(const RunConstants& run, std::uint64_t until, std::uint32_t tick,
                                   ExactState& state) {
  ExactProgress progress = state.progress;
  progress.now += static_cast<std::uint64_t>(tick) << progress.tick_exponent;
  state.chord = plan_chord(run, progress, until);
  state.chord_begin = static_cast<std::int32_t>(tick);
  state.chord_hits = {};
  state.ball = ball_in_step({run, state.chord}, progress);
  state.ball.trajectory.tick += state.chord_begin;
  state.has_chord = 1;
}

// Moves the ball to the end of its chord, a tick of the step.
__device__ inline void end_chord(const RunConstants& run, std::uint32_t tick, ExactState& state) {
  state.has_chord = 0;
  if (run.physics.ball.held) {
    state.progress.ball_trajectory_holds = false;  // it may be that of a flight before
    return;
  }
  ExactProgress progress = state.progress;
  progress.now += static_cast<std::uint64_t>(tick) << progress.tick_exponent;
  ExactBall ball = state.ball;
  ball.trajectory.tick -= state.chord_begin;
  finish_ball({run, state.chord}, ball, state.chord_hits, progress);
  state.progress.ball = progress.ball;
  state.progress.ball_trajectory = progress.ball_trajectory;
  state.progress.ball_trajectory_holds = progress.ball_trajectory_holds;
}

// Latest end of a chord that begins at that tick of the reference speed. ends: in order, the last one later.
__device__ inline std::uint64_t chord_until(const std::uint64_t (&ends)[kMaxChords], std::uint64_t now) {
  std::uint32_t k = 0;
  while (k + 1 < kMaxChords && ends[k] <= now) ++k;
  return ends[k];
}

// At a window's start within the step: the ball's next chord, if the one before has ended. Returns whether
// the step can go on: the ball participates.
__device__ inline bool go_on_with_chord(const ExactLaunch& launch, ExactState& state) {
  const std::uint32_t tick = state.window_begin;
  if (state.plan.ball != BallRole::participant || tick < end_of_windows(state)) return true;
  end_chord(launch.run, tick, state);
  const std::uint64_t now =
      state.progress.now + (static_cast<std::uint64_t>(tick) << state.progress.tick_exponent);
  begin_chord(launch.run, chord_until(launch.chord_ends, now), tick, state);
  return state.chord.ball == BallRole::participant;
}

// ---- windows. Each function is called by one thread.

// Plans the next window of the step: an equal part of what is left up to there.
__device__ inline void plan_window(const ExactLaunch& launch) {
  ExactState& state = *launch.state;
  const std::uint32_t left = end_of_windows(state) - state.window_begin;
  const double parts = left / state.window_ticks;
  const auto num = static_cast<std::uint32_t>(parts) + (parts > 1.0 ? 1U : 0U);
  state.window_end = state.window_begin + (num <= 1 ? left : (left + num - 1) / num);
  state.list_overflow = 0;
  state.solve_failed = 0;
  state.stopped_at = kNoTick;
  state.too_fast_bits = 0;
  state.fastest_after_bits = 0;
  state.round_events = 0;
  state.serial_events = 0;
  state.num_events_before = state.num_events;
  state.num_representatives = 0;
  state.num_taken = 0;
  state.first_round_is_done = 0;
  state.num_conflicts[0] = state.num_conflicts[1] = 0;
  state.num_todo = 0;
  start_ball_path(launch.run, launch.memory, state);
}

// The next windows are shorter if too many events of this one were applied one after the other: for each of
// them some hundreds could have been applied side by side. Or if the ball's path has many segments, which
// parcels near it are compared with. They become longer where there is room for four times as much; with
// twice as much the next one is often too long, and the slowest frames of the court of 10^6 take 5 % longer
// on an H200. The length that grows is the one that was learnt, not that of the window, which may be one of
// two equal parts of a step that was hardly too long: from there half a step would never become a whole one.
__device__ inline void learn_from_window(ExactState& state) {
  constexpr double kSerialEvents = 56.0, kEventsPerSerialOne = 500.0, kSegments = 32.0;
  constexpr double kShortest = 0.125, kRoom = 4.0, kLonger = 1.5;
  const auto num_events = static_cast<double>(state.num_events - state.num_events_before);
  const double allowed = kSerialEvents + num_events / kEventsPerSerialOne;
  const double length = state.window_end - state.window_begin;
  const std::uint32_t num_segments = max(state.num_ball_segments, state.num_solved_segments);
  const double share = fmin(allowed / (state.serial_events + 1.0), kSegments / (num_segments + 1.0));
  if (share < 1.0) {
    state.window_ticks = fmax(length * fmax(share, kShortest), 1.0);
  } else if (share > kRoom) {
    state.window_ticks = fmin(fmax(length, state.window_ticks) * kLonger, kLongestWindow);
  }
}

// After a window in which a cluster had too many events, or a list was full: a shorter one, or more events.
__device__ inline AfterWindow retry_window(const ExactLaunch& launch) {
  ExactState& state = *launch.state;
  const std::uint32_t length = state.window_end - state.window_begin;
  if (length == 1) {
    if (state.stopped_at == kNoTick || state.max_events >= kLargestClusterEvents) return AfterWindow::stop;
    state.max_events *= 4;
  }
  std::uint32_t shorter = length / 2;
  if (state.stopped_at != kNoTick && state.stopped_at - state.window_begin < length)
    shorter = state.stopped_at - state.window_begin;
  state.window_ticks = shorter > 1 ? shorter : 1;
  plan_window(launch);
  return AfterWindow::retry_window;
}

// Decides what follows a window, and plans it if that belongs to the same step.
__device__ inline AfterWindow end_window(const ExactLaunch& launch, bool is_committed) {
  ExactState& state = *launch.state;
  if (is_committed) {
    learn_from_window(state);
    state.max_events = kMaxClusterEvents;
    state.fastest_committed_bits = max(state.fastest_committed_bits, state.fastest_after_bits);
    if (state.plan.ball == BallRole::participant) state.ball = state.ball_at_end;
    state.window_begin = state.window_end;
    if (state.window_begin == state.plan.length) return AfterWindow::next_step;
    if (!go_on_with_chord(launch, state)) return AfterWindow::end_step_here;
    plan_window(launch);
    return AfterWindow::next_window;
  }
  state.num_retried += 1;
  const double needed = fastest_of_all_mps(state);
  if (needed > state.plan.max_speed_mps) {
    state.progress.raised_bound_mps = kSpeedMargin * needed;
    return state.window_begin == 0 ? AfterWindow::retry_step : AfterWindow::end_step_here;
  }
  if (state.near_ball_overflow != 0) {
    state.max_ticks = state.plan.length / 2;
    return state.max_ticks == 0 ? AfterWindow::stop : AfterWindow::retry_step;
  }
  return retry_window(launch);
}

// ---- steps

// Longest step of parcels that collide, in epochs of a CPU: search boxes grow with it. A fast ball in a slow
// gas reaches it.
constexpr double kStepInEpochs = 2.5;

// Plans the next step, which ends at the latest at `until`, the ball's next chord if it has none, and the
// first window. chord_ends: as for chord_until(). Called by one thread.
__device__ inline void plan_next(const ExactLaunch& launch, std::uint64_t until,
                                 const std::uint64_t (&chord_ends)[kMaxChords]) {
  const RunConstants& run = launch.run;
  ExactState& state = *launch.state;
  ExactProgress progress = state.progress;
  if (run.physics.ball.exists) {
    if (state.has_chord == 0) begin_chord(run, chord_until(chord_ends, progress.now), 0, state);
    progress.ball.velocity_mps = state.ball.trajectory.velocity_mps;
    progress.ball.spin_radps = state.ball.trajectory.spin_radps;
  }
  StepPlan plan = plan_step(run, progress, until, state.max_ticks);
  const double parts = plan.length / (kStepInEpochs * preferred_epoch_ticks({run, plan}));
  if (parts > 1.0 && run.physics.parcels.contacts)
    plan.length = max(1U, static_cast<std::uint32_t>(plan.length / ceil(parts)));
  if (run.physics.ball.exists) {
    plan.ball = state.chord.ball;
    const std::uint32_t left = state.chord.length - static_cast<std::uint32_t>(-state.chord_begin);
    if (plan.ball != BallRole::participant) plan.length = min(plan.length, left);
  }
  state.plan = plan;
  if (plan.ball != BallRole::absent)
    state.ball_neighbourhood = neighbourhood_of({run, plan}, state.ball.trajectory);
  state.num_near_ball = 0;
  state.near_ball_overflow = 0;
  state.fastest_committed_bits = 0;
  state.num_events = 0;
  state.window_begin = 0;
  plan_window(launch);
}

// Moves totals, ball and time to the end of a step, which may be earlier than planned: at the start of the
// window. sum: over the tally's slots.
__device__ inline void finish_solved(const ExactLaunch& launch, const TallySlot& sum) {
  ExactState& state = *launch.state;
  add_to_totals(sum, launch.step_state->step, launch.step_state->totals);
  state.event_hash += sum.event_hash;
  state.num_events_committed += state.num_events;
  const double at_start = sqrt(static_cast<double>(__uint_as_float(sum.max_speed2_bits)));
  const double after = sqrt(speed_from_bits(&state.fastest_committed_bits));
  state.chord_hits.impulse_x += static_cast<std::int64_t>(sum.ball_x);
  state.chord_hits.impulse_y += static_cast<std::int64_t>(sum.ball_y);
  state.chord_hits.torque += static_cast<std::int64_t>(sum.ball_torque);
  ExactConstants c{launch.run, state.plan};
  c.plan.length = state.window_begin;
  ExactProgress progress = state.progress;
  const double raised_bound_mps = progress.raised_bound_mps;
  advance_progress(c, {{}, at_start, after, state.num_events}, progress);
  if (c.plan.length < state.plan.length) progress.raised_bound_mps = raised_bound_mps;
  state.progress = progress;
  state.current_buffer ^= 1U;
  state.max_ticks = static_cast<std::uint32_t>(kAnchorPeriod);
  if (c.plan.ball == BallRole::absent) return;
  state.ball.trajectory.tick -= static_cast<std::int32_t>(c.plan.length);
  state.chord_begin -= static_cast<std::int32_t>(c.plan.length);
  if (state.chord_begin == 0) state.has_chord = 0;  // begins with the next step, which is planned with it
  if (static_cast<std::uint32_t>(-state.chord_begin) == state.chord.length) end_chord(launch.run, 0, state);
  launch.step_state->ball = state.progress.ball;
}

// Ends a step, or one that must be retried: its tally is dropped. Called by one warp.
__device__ __noinline__ inline void finish_step(const ExactLaunch& launch, bool is_solved) {
  const TallySlot sum = sum_slots(launch.slots[threadIdx.x]);
  launch.slots[threadIdx.x] = {};
  if (threadIdx.x == 0 && is_solved) finish_solved(launch, sum);
}

// After the deadline the request ends where a window has ended. Called by one thread.
__device__ inline AfterWindow pause_if_late(ExactState& state, AfterWindow after) {
  const bool can_pause = after == AfterWindow::next_window || after == AfterWindow::next_step;
  if (!can_pause || state.deadline_ns == 0 || global_time_ns() < state.deadline_ns) return after;
  state.paused = 1;
  return after == AfterWindow::next_window ? AfterWindow::end_step_here : after;
}

// Ends the request where the window began, if that cannot be solved.
__device__ inline AfterWindow end_if_unresolvable(ExactState& state, AfterWindow after) {
  if (after != AfterWindow::stop) return after;
  state.unresolvable = 1;
  return state.window_begin == 0 ? AfterWindow::retry_step : AfterWindow::end_step_here;
}

// Ends a window, and the step if that is its last one. Called by one warp.
__device__ inline void finish_window(const ExactLaunch& launch, bool is_committed) {
  ExactState& state = *launch.state;
  AfterWindow after = AfterWindow::stop;
  if (threadIdx.x == 0)
    after = end_if_unresolvable(state, pause_if_late(state, end_window(launch, is_committed)));
  if (threadIdx.x == 0) state.after_window = after;
  after = static_cast<AfterWindow>(__shfl_sync(kWholeWarp, static_cast<std::uint32_t>(after), 0));
  if (after == AfterWindow::next_step || after == AfterWindow::retry_step)
    finish_step(launch, after == AfterWindow::next_step);
}

// Writes where the parcels are at the start of the window, where the step is to end. The threads with ranks 0
// to num_threads - 1 call it.
template <Boundary kBoundary>
__device__ void locate_all(const ExactLaunch& launch, std::uint32_t rank, std::uint32_t num_threads) {
  const ExactConstants c = constants_of_step(launch);
  const StepContext step{launch, c};
  const ExactState& state = step.state;
  const auto tick = static_cast<std::int32_t>(state.window_begin);
  for (std::uint32_t i = rank; i < launch.space.num_parcels; i += num_threads)
    step.memory.positions[state.current_buffer ^ 1U][i] =
        place_at<kBoundary>(c, step.start_trajectory(i), tick);
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
    std::uint32_t* const contact = parcels.last_contact_tick;
    if (contact) contact[i] = rescaled_contact_tick(contact[i], now, before, exponent);
  }
  synchronize();
  if (rank != 0) return;
  state.progress.tick_exponent = exponent;
  state.progress.ball_trajectory_holds = false;
  const int shorter = static_cast<int>(before) - static_cast<int>(exponent);
  double& preferred = state.progress.preferred_ticks;
  if (preferred > 0.0) preferred = fmax(ldexp(preferred, shorter), 1.0);
  state.window_ticks = fmax(ldexp(state.window_ticks, shorter), 1.0);
}

// Prepares the retry of a window: no parcel belongs to a cluster, and any may have a due event.
__device__ inline void release_all(const ExactLaunch& launch, std::uint32_t rank, std::uint32_t num_threads) {
  for (std::uint32_t i = rank; i < launch.space.num_parcels; i += num_threads) {
    launch.memory.owner[i] = kInvalidIndex;
    launch.memory.earliest[i / kTile] = 0;
  }
}

}  // namespace pf::cuda
