// Kernels of method `exact` between steps.
#include "cuda/exact/region_speeds.cuh"
#include "cuda/exact/timeline.cuh"

#include "cuda/blocks.cuh"
#include "cuda/check.cuh"
#include "model/for_boundary.hpp"

namespace pf::cuda {
namespace {

constexpr unsigned kBlock = kExactBlock;

__device__ std::uint32_t parcel_of_thread() { return blockIdx.x * kBlock + threadIdx.x; }

__global__ void begin_request_kernel(const __grid_constant__ ExactLaunch launch) {
  ExactState& state = *launch.state;
  const RunConstants& run = launch.run;
  if (threadIdx.x < kNumSlots) launch.slots[threadIdx.x] = {};
  for (std::uint32_t s = threadIdx.x; s < launch.memory.num_slices; s += blockDim.x)
    launch.memory.counts[s] = {};
  if (threadIdx.x == 0) {
    launch.step_state->totals = {};
    state.num_rounds = 0;
    state.num_retried = 0;
    state.largest_cluster = 0;
    state.num_events_committed = state.num_events_solved = 0;
    state.paused = 0;
    state.deadline_ns = launch.budget_ns == 0 ? 0 : global_time_ns() + launch.budget_ns;
    if (!launch.goes_on) state.has_chord = 0;
    state.event_hash = 0;
    state.reconcile_ns = 0;
    state.unresolvable = 0;
    state.progress.ball = launch.step_state->ball;
    if (launch.ball_was_set) state.progress.ball_trajectory_holds = false;
  }
  __syncthreads();
  const ExactProgress& progress = state.progress;
  const bool needs_finer_ticks = launch.ball_was_set && progress.tick_exponent != 0 &&
                                 run.physics.ball.exists &&
                                 surface_speed_mps(run.physics, progress.ball) >
                                     tick_speed_mps(run.reference_ticks, progress.tick_exponent);
  if (needs_finer_ticks) anchor_all(launch, threadIdx.x, blockDim.x, [] { __syncthreads(); });
  __syncthreads();
  if (threadIdx.x != 0) return;
  state.max_ticks = static_cast<std::uint32_t>(kAnchorPeriod);
  if (launch.until > state.progress.now) plan_next(launch, launch.until, launch.chord_ends);
}

__global__ void reset_state_kernel(ExactState* state, std::uint64_t now) {
  *state = {};
  state->progress.now = now;
}

__global__ void anchor_kernel(const __grid_constant__ ExactLaunch launch, std::uint64_t now) {
  const std::uint32_t i = parcel_of_thread();
  const ParcelPointers& parcels = launch.memory.trajectories;
  float speed2 = 0.0F;
  if (i < launch.space.num_parcels) {
    parcels.tick[i] = static_cast<std::uint32_t>(now);
    if (parcels.last_contact_tick)
      parcels.last_contact_tick[i] = static_cast<std::uint32_t>(now - kAnchorPeriod);
    launch.memory.positions[0][i] = parcels.position[i];
    const Vec2f velocity = entering_velocity(parcels.velocity[i]);
    parcels.velocity[i] = velocity;
    const float any_speed2 = dot(velocity, velocity);
    if (!is_retired(parcels.position[i]) && any_speed2 < kMaxFiniteSpeed2) speed2 = any_speed2;
  }
  const unsigned fastest2 = warp_max(__float_as_uint(speed2));
  if (threadIdx.x % 32 == 0) atomicMax(&launch.state->fastest_after_bits, fastest2);
}

__global__ void set_speed_kernel(ExactState* state) {
  state->progress.fastest_mps = fastest_after_mps(*state);
}

__global__ void count_kernel(const __grid_constant__ ExactLaunch launch, const SortKeys keys) {
  const std::uint32_t i = parcel_of_thread();
  const bool is_parcel = i < launch.space.num_parcels;
  const Vec2i* position = launch.memory.positions[launch.state->current_buffer];
  count_in_cell(launch.space.grid, keys, i, is_parcel ? position[i] : Vec2i{}, is_parcel);
}

template <Boundary kBoundary>
__global__ void locate_kernel(const __grid_constant__ ExactLaunch launch) {
  const std::uint32_t i = parcel_of_thread();
  ExactState& state = *launch.state;
  if (i == 0) {
    state.progress.max_displacement = 0;
    state.progress.units_since_sort = state.progress.roundings_since_sort = 0.0;
  }
  if (i >= launch.space.num_parcels) return;
  ExactConstants c{launch.run, {scaled(launch.run.reference_ticks, state.progress.tick_exponent)}};
  c.plan.start = static_cast<std::uint32_t>(state.progress.now >> state.progress.tick_exponent);
  const StepContext step{launch, c};
  const Trajectory trajectory = step.start_trajectory(i);
  const Vec2i position = place_at<kBoundary>(c, trajectory, 0);
  launch.memory.positions[state.current_buffer][i] = position;
  const float speed2 = dot(trajectory.velocity, trajectory.velocity);
  if (is_retired(position) || !(speed2 < kMaxFiniteSpeed2)) return;
  raise_bounds<kBoundary>(step, position, static_cast<std::int32_t>(kRoundingMargin), speed2);
}

__global__ void copy_positions_kernel(const __grid_constant__ ExactLaunch launch, Vec2i* out) {
  const std::uint32_t i = parcel_of_thread();
  if (i < launch.space.num_parcels) out[i] = launch.memory.positions[launch.state->current_buffer][i];
}

}  // namespace

void launch_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream) {
  reset_state_kernel<<<1, 1, 0, stream>>>(launch.state, now);
  PF_LAUNCHED("reset_state_kernel");
  anchor_kernel<<<blocks_for(launch.space.num_parcels, kBlock), kBlock, 0, stream>>>(launch, now);
  PF_LAUNCHED("anchor_kernel");
  set_speed_kernel<<<1, 1, 0, stream>>>(launch.state);
  PF_LAUNCHED("set_speed_kernel");
}

void launch_begin_exact_request(const ExactLaunch& launch, cudaStream_t stream) {
  begin_request_kernel<<<1, kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("begin_request_kernel");
}

void launch_count(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream) {
  count_kernel<<<blocks_for(launch.space.num_parcels, kBlock), kBlock, 0, stream>>>(launch, keys);
  PF_LAUNCHED("count_kernel");
}

void launch_locate(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    locate_kernel<kBoundary><<<blocks_for(launch.space.num_parcels, kBlock), kBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("locate_kernel");
}

void launch_copy_positions(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream) {
  copy_positions_kernel<<<blocks_for(launch.space.num_parcels, kBlock), kBlock, 0, stream>>>(launch, out);
  PF_LAUNCHED("copy_positions_kernel");
}

}  // namespace pf::cuda
