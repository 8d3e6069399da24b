#include "exact_kernel.cuh"

#include <algorithm>

#include "check.cuh"
#include "exact_clusters.cuh"
#include "tally.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = kExactBlock;
constexpr unsigned kPredictBlocksPerSm = 5;         // ms at 10^7: 0.63; with 4 0.74, with 3 0.93
constexpr std::uint32_t kParcelsPerSegment = 1024;  // fewer blocks for few parcels: the barrier is cheaper

// So many threads solve a cluster together, and so many blocks share a multiprocessor. Where parcels are few,
// what counts is how long one cluster takes; where they are many, how many are solved at a time. Gps at 10^5,
// 10^6, 10^7 on an H200 with 2 threads and 4 blocks: 0.45 1.32 3.99; 4, 4: 0.64 2.07 4.28; 8, 2:
// 0.74 2.24 3.76; 8, 4: 0.70 2.25 4.02; 16, 3: 0.66 2.18 3.67; 32, 2: 0.50 1.51 2.67.
constexpr unsigned kTogether = 8, kBlocksPerSm = 2;
constexpr unsigned kTogetherIfMany = 4, kBlocksPerSmIfMany = 4;
constexpr std::uint32_t kMany = 4000000;

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

// First prediction of parcel i, on the line that it has at the begin.
template <Boundary kBoundary, bool kReadOnly>
__device__ Event predict_first(const ExactConstants& c, const ExactLaunch& launch, const ExactState& state,
                               std::uint32_t i, DeviceTally& tally) {
  const ExactArrays& a = launch.arrays;
  const Line here = line_of(a, i);
  Event best;
  const float speed2 = dot(here.velocity, here.velocity);
  if (!(speed2 < 1e30F)) {
    tally.invalid(a.lines.id[i]);
    a.present[state.parity ^ 1U][i] = here.anchor;
    return best;
  }
  write_end<kBoundary>(c, launch, state, i, here);
  if (is_retired(here.anchor)) return best;
  tally.moved(0, speed2);
  const Vec2i* present = a.present[state.parity];
  const Vec2i at = present[i];
  if (c.step.physics.parcels.contacts) {
    const double in_step = c.units_per_tick * c.length;
    const double moved = (sqrtf(speed2) * (1.0F + 1e-6F) + state.progress.fastest_mps) * in_step;
    const double distance = c.step.contact_distance + moved + kRoundingMargin;
    const auto contact = static_cast<float>(c.step.contact_distance);
    const auto per_mps = static_cast<float>(in_step);
    FindList finds;
    const auto find = [&](auto found) {
      search<kBoundary, kReadOnly>(launch.space, present, at, i,
                                   saturated(distance + static_cast<double>(state.progress.travel)),
                                   filter_of(distance), found);
    };
    const auto meet = [&](std::uint32_t j) {
      keep_meeting(best, meeting<kBoundary>(c, here, line_of(a, j)), j, a.lines.id);
    };
    const auto may = [&](std::uint32_t j, Vec2i offset) {
      return may_meet(offset, a.lines.velocity[j] - here.velocity, contact, per_mps);
    };
    find([&](std::uint32_t j, Vec2i offset) {
      if (may(j, offset)) finds.push(j);
    });
    if (finds.num > FindList::kMost) {
      find([&](std::uint32_t j, Vec2i offset) {
        if (may(j, offset)) meet(j);
      });
    } else {
      while (finds.num > 0) meet(finds.pop());
    }
  }
  if (may_reach_edge<kBoundary>(c, at)) keep_edge_event<kBoundary>(c, here, best);
  if (c.ball == BallRole::frozen && is_near_ball<kBoundary>(c.step.physics.world, state, at))
    keep_earlier(best, {meeting_ball<kBoundary>(c, state.ball.line, here), kBallPartner, kBallPartner});
  return best;
}

// Adds items to a segment of the list; all threads of the block call it. Items of one call may land in any
// order.
__device__ void append(const SegmentedList& list, std::uint32_t segment, std::uint32_t item, bool wanted,
                       ExactState& state) {
  __shared__ std::uint32_t num, base;
  __syncthreads();
  if (threadIdx.x == 0) num = 0;
  __syncthreads();
  const std::uint32_t place = wanted ? atomicAdd(&num, 1U) : 0U;
  __syncthreads();
  if (threadIdx.x == 0 && num > 0) base = atomicAdd(&list.counts[segment], num);
  __syncthreads();
  if (!wanted) return;
  if (base + place < list.capacity) {
    list.items[static_cast<std::size_t>(segment) * list.capacity + base + place] = item;
  } else {
    state.failed = 1;
  }
}

template <Boundary kBoundary, bool kReadOnly>
__device__ void predict_tile(const ExactConstants& c, const ExactLaunch& launch, std::uint32_t i,
                             std::uint32_t segment, DeviceTally& tally) {
  ExactState& state = *launch.state;
  const ExactArrays& a = launch.arrays;
  bool active = false;
  if (i < launch.space.num_parcels) {
    const Event event = predict_first<kBoundary, kReadOnly>(c, launch, state, i, tally);
    active = event.tick != kNoTick;
    a.event_tick[i] = event.tick;
    a.event_partner[i] = event.partner;
    a.owner[i] = kNone;
    if (active) a.list_head[i] = kNone;
    if (c.ball == BallRole::participant) {
      const Vec2i at = a.present[state.parity][i];
      if (!is_retired(at) && is_near_ball<kBoundary>(c.step.physics.world, state, at)) {
        const std::uint32_t place = atomicAdd(&state.num_near_ball, 1U);
        if (place < a.near_ball.capacity) {
          a.near_ball.items[place] = i;
        } else {
          state.failed = 1;
        }
      }
    }
  }
  append(a.active, segment, i, active, state);
}

template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kPredictBlocksPerSm)
    predict_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  const ExactConstants& plan = launch.state->plan;
  ExactConstants c = launch.constants;
  c.begin = plan.begin;
  c.length = plan.length;
  c.max_speed_mps = plan.max_speed_mps;
  c.ball = plan.ball;
  DeviceTally tally{&block_tally};
  predict_tile<kBoundary, true>(c, launch, blockIdx.x * kBlock + threadIdx.x,
                                blockIdx.x % launch.arrays.num_segments, tally);
  reduce_warp(tally, block_tally);
  __syncthreads();
  if (threadIdx.x == 0) add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
}

// Plans the step from now on: its length, the bound, the ball, and empty counters. One thread.
__device__ void plan_next(const ExactConstants& constants, std::uint64_t until, ExactState& state) {
  state.plan = constants;
  plan_step(state.progress, until, state.longest, state.plan);
  const ExactConstants& c = state.plan;
  state.ball = ball_in_step(c, state.progress);
  if (c.ball != BallRole::absent) {
    const Vec2d centre =
        state.ball.line.anchor_units +
        travelled(c, state.ball.line.velocity_mps, -static_cast<std::int64_t>(state.ball.line.tick));
    state.ball_centre = {saturated_units(centre.x), saturated_units(centre.y)};
    const double moved = c.max_speed_mps * c.units_per_tick * c.length;
    state.ball_reach = saturated(c.ball_contact + 2.0 * moved + kRoundingMargin);
  }
  state.failed = 0;
  state.too_fast_bits = 0;
  state.fastest_after_bits = 0;
  state.num_near_ball = 0;
  state.num_conflicts = 0;
  state.num_todo = 0;
  state.num_events = 0;
  state.ball_owner = kBallCluster;
  state.ball_has_changed = 0;
}

__device__ double fastest_after_mps(const ExactState& state) {
  return sqrt(static_cast<double>(__uint_as_float(load_shared(&state.fastest_after_bits))));
}
__device__ double fastest_of_all_mps(const ExactState& state) {
  const double parcels = fastest_after_mps(state);
  const double ball = static_cast<double>(__uint_as_float(load_shared(&state.too_fast_bits)));
  return parcels > ball ? parcels : ball;
}

// After solving, one warp: totals, the ball and the time move on, or the step is planned anew.
__device__ void finish_step_on_device(const ExactLaunch& launch, bool finished) {
  ExactState& state = *launch.state;
  const TallySlot sum = sum_slots(launch.slots[threadIdx.x]);
  launch.slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  if (finished) {
    add_to_totals(sum, *launch.step_state);
    state.event_hash += sum.event_hash;
    const std::int64_t travel = state.progress.travel;
    const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                        static_cast<std::int64_t>(sum.ball_torque)};
    const double at_begin = sqrt(static_cast<double>(__uint_as_float(sum.max_speed2_bits)));
    const ExactConstants plan = state.plan;
    ExactProgress progress = state.progress;
    const ExactBall ball = plan.ball == BallRole::participant ? state.ball_now : state.ball;
    end_step(plan, ball, hits, at_begin, fastest_after_mps(state), state.num_events, progress);
    state.progress = progress;
    state.last_travel = progress.travel - travel;
    state.parity ^= 1U;
    state.longest = static_cast<std::uint32_t>(kAnchorPeriod);
    launch.step_state->ball = progress.ball;
  } else {
    state.num_redone += 1;
    const double needed = fastest_of_all_mps(state);
    if (needed > state.plan.max_speed_mps) {
      state.progress.raised_bound_mps = kSpeedMargin * needed;
    } else {
      state.longest = state.plan.length / 2 > 1 ? state.plan.length / 2 : 1;
    }
  }
}

__device__ void anchor_parcel(const ExactArrays& a, const ExactState& state, std::uint32_t i) {
  const auto now = static_cast<std::uint32_t>(state.progress.now);
  a.lines.position[i] = a.present[state.parity][i];
  a.lines.tick[i] = now;
  if (a.lines.clock && now - a.lines.clock[i] > kAnchorPeriod)
    a.lines.clock[i] = now - static_cast<std::uint32_t>(kAnchorPeriod);
}

// Solves the clusters of one step, until its end: parts of it that must be redone, too.
template <Boundary kBoundary, unsigned kTeam, unsigned kBlocks>
__global__ void __launch_bounds__(kBlock, kBlocks) solve_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ ExactConstants c;
  __shared__ TallySlot block_tally;
  __shared__ TeamSpace space;
  __shared__ BlockCounts counts;
  cg::grid_group grid = cg::this_grid();
  ExactState& state = *launch.state;
  if (threadIdx.x == 0) block_tally = {};
  while (true) {
    if (threadIdx.x == 0) {
      c = state.plan;
      counts = {};
      counts.active = launch.arrays.active.counts[blockIdx.x];
    }
    __syncthreads();
    Clusters<kBoundary, kTeam> clusters{launch, c, state, space, counts};
    if (state.failed == 0) clusters.run();
    grid.sync();
    const bool finished = load_shared(&state.failed) == 0 && fastest_of_all_mps(state) <= c.max_speed_mps;
    if (finished) clusters.commit(launch, block_tally);
    __syncthreads();
    if (threadIdx.x == 0) {
      add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
      block_tally = {};
      launch.arrays.active.counts[blockIdx.x] = 0;
    }
    grid.sync();
    if (blockIdx.x == 0 && threadIdx.x < kNumSlots) finish_step_on_device(launch, finished);
    grid.sync();
    const bool anchoring = finished && state.progress.now % kAnchorPeriod == 0;
    if (anchoring) {
      for (std::uint32_t i = grid.thread_rank(); i < launch.space.num_parcels; i += grid.size())
        anchor_parcel(launch.arrays, state, i);
    }
    const bool done = state.progress.now >= launch.until;
    grid.sync();
    if (grid.thread_rank() == 0) {
      const std::uint64_t until = done ? launch.next_until : launch.until;
      if (until > state.progress.now) plan_next(launch.constants, until, state);
    }
    if (done) return;
    grid.sync();
    if (threadIdx.x == 0) c = state.plan;
    __syncthreads();
    DeviceTally tally{&block_tally};
    for (std::uint32_t tile = blockIdx.x; tile * kBlock < launch.space.num_parcels; tile += gridDim.x) {
      predict_tile<kBoundary, false>(c, launch, tile * kBlock + threadIdx.x, blockIdx.x, tally);
      reduce_warp(tally, block_tally);
      tally = DeviceTally{&block_tally};
    }
    grid.sync();
  }
}

__global__ void begin_request_kernel(const __grid_constant__ ExactLaunch launch) {
  ExactState& state = *launch.state;
  if (threadIdx.x < kNumSlots) launch.slots[threadIdx.x] = {};
  for (std::uint32_t s = threadIdx.x; s < launch.arrays.num_segments; s += blockDim.x)
    launch.arrays.active.counts[s] = 0;
  if (threadIdx.x != 0) return;
  launch.step_state->totals = {};
  state.num_rounds = 0;
  state.num_redone = 0;
  state.event_hash = 0;
  state.progress.ball = launch.step_state->ball;
  if (launch.ball_was_set) state.progress.ball_follows = false;
  state.longest = static_cast<std::uint32_t>(kAnchorPeriod);
  if (launch.until > state.progress.now) plan_next(launch.constants, launch.until, state);
}

__global__ void enter_kernel(const __grid_constant__ ExactLaunch launch, std::uint64_t now) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  const ExactArrays& a = launch.arrays;
  float speed2 = 0.0F;
  if (i < launch.space.num_parcels) {
    a.lines.tick[i] = static_cast<std::uint32_t>(now);
    if (a.lines.clock) a.lines.clock[i] = static_cast<std::uint32_t>(now - kAnchorPeriod);
    a.present[0][i] = a.lines.position[i];
    speed2 = dot(a.lines.velocity[i], a.lines.velocity[i]);
  }
  const unsigned fastest = __reduce_max_sync(0xFFFFFFFFU, __float_as_uint(speed2));
  if (threadIdx.x % 32 == 0) atomicMax(&launch.state->fastest_after_bits, fastest);
}

__global__ void enter_state_kernel(ExactState* state, std::uint64_t now) {
  *state = {};
  state->progress.now = now;
}

__global__ void enter_done_kernel(ExactState* state) {
  state->progress.fastest_mps = sqrt(static_cast<double>(__uint_as_float(state->fastest_after_bits)));
}

template <Boundary kBoundary>
__global__ void find_present_kernel(const __grid_constant__ ExactLaunch launch) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  ExactState& state = *launch.state;
  if (i == 0) state.progress.travel = 0;
  if (i >= launch.space.num_parcels) return;
  ExactConstants c = launch.constants;
  c.begin = static_cast<std::uint32_t>(state.progress.now);
  launch.arrays.present[state.parity][i] = position_at<kBoundary>(c, line_of(launch.arrays, i), 0);
}

__global__ void key_kernel(const __grid_constant__ ExactLaunch launch, const SortKeys keys) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= launch.space.num_parcels) return;
  keys.key[i] = cell_key(launch.space.grid, launch.arrays.present[launch.state->parity][i]);
  keys.index[i] = i;
}

__global__ void copy_present_kernel(const __grid_constant__ ExactLaunch launch, Vec2i* out) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i < launch.space.num_parcels) out[i] = launch.arrays.present[launch.state->parity][i];
}

template <class Function>
void for_boundary(Boundary boundary, Function function) {
  switch (boundary) {
    case Boundary::walls:
      return function.template operator()<Boundary::walls>();
    case Boundary::periodic:
      return function.template operator()<Boundary::periodic>();
    default:
      return function.template operator()<Boundary::open>();
  }
}

template <Boundary kBoundary>
auto solve_kernel_for(std::uint32_t num_parcels) {
  return num_parcels < kMany ? solve_kernel<kBoundary, kTogether, kBlocksPerSm>
                             : solve_kernel<kBoundary, kTogetherIfMany, kBlocksPerSmIfMany>;
}

std::uint32_t most_segments(std::uint32_t num_parcels) {
  int device = 0, num_sms = 0, blocks = 0;
  PF_CUDA(cudaGetDevice(&device));
  PF_CUDA(cudaDeviceGetAttribute(&num_sms, cudaDevAttrMultiProcessorCount, device));
  int least = num_parcels < kMany ? kBlocksPerSm : kBlocksPerSmIfMany;
  for (const auto kernel :
       {solve_kernel_for<Boundary::open>(num_parcels), solve_kernel_for<Boundary::walls>(num_parcels),
        solve_kernel_for<Boundary::periodic>(num_parcels)}) {
    PF_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kBlock, 0));
    least = std::min(least, blocks);
  }
  return static_cast<std::uint32_t>(num_sms * least);
}

}  // namespace

std::uint32_t exact_num_segments(std::uint32_t num_parcels) {
  const std::uint32_t wanted = (num_parcels + kParcelsPerSegment - 1) / kParcelsPerSegment;
  return std::clamp(wanted, 1U, std::max(1U, most_segments(num_parcels)));
}

void launch_exact_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream) {
  enter_state_kernel<<<1, 1, 0, stream>>>(launch.state, now);
  const unsigned blocks = std::max(1U, blocks_for(launch.space.num_parcels));
  enter_kernel<<<blocks, kBlock, 0, stream>>>(launch, now);
  enter_done_kernel<<<1, 1, 0, stream>>>(launch.state);
  PF_LAUNCHED("enter_kernel");
}

void launch_exact_begin_request(const ExactLaunch& launch, cudaStream_t stream) {
  begin_request_kernel<<<1, kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("begin_request_kernel");
}

void launch_exact_find_present(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.constants.step.physics.world.boundary, [&]<Boundary kBoundary>() {
    find_present_kernel<kBoundary><<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("find_present_kernel");
}

void launch_exact_step(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.constants.step.physics.world.boundary, [&]<Boundary kBoundary>() {
    const unsigned blocks = std::max(1U, blocks_for(launch.space.num_parcels));
    predict_kernel<kBoundary><<<blocks, kBlock, 0, stream>>>(launch);
    PF_LAUNCHED("predict_kernel");
    ExactLaunch argument = launch;
    void* arguments[] = {&argument};
    PF_CUDA(cudaLaunchCooperativeKernel(
        reinterpret_cast<const void*>(solve_kernel_for<kBoundary>(launch.space.num_parcels)),
        dim3(launch.arrays.num_segments), dim3(kBlock), arguments, 0, stream));
  });
}

void launch_exact_write_keys(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream) {
  key_kernel<<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch, keys);
  PF_LAUNCHED("key_kernel");
}

void launch_exact_copy_present(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream) {
  copy_present_kernel<<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch, out);
  PF_LAUNCHED("copy_present_kernel");
}

}  // namespace pf
