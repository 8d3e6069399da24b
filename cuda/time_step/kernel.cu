#include "cuda/time_step/kernel.cuh"

#include "cuda/architecture.cuh"
#include "cuda/blocks.cuh"
#include "cuda/launch.cuh"
#include "cuda/neighbour_search.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_ball.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "model/for_boundary.hpp"
#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// 12 blocks of 128 threads limit registers to 40. Gps of `impulse` at 10^5, of `spring` at 10^7 and at area
// fraction 0.65 on an H100: 8.67, 21.3, 11.3; 6 of 256 threads 8.48, 21.2, 10.9; 5 of these 7.53, 20.3, 10.6.
constexpr unsigned kBlock = 128;
constexpr unsigned kBlocksPerSm = blocks_per_sm(12, kBlock);

// Adds the contact of parcel i with parcel j to its sums, if they touch. Whether self is heated is read here
// only, and counted for the other: it matters for the pair, and few parcels touch.
template <class Contact, Boundary kBoundary>
__device__ void touch(const StepLaunch& launch, const Parcel& self, std::uint32_t i, std::uint32_t j,
                      ContactSums& sums, DeviceTally& tally) {
  const Parcel other{launch.from.position[j], launch.from.velocity[j], launch.from.id[j],
                     is_heated(launch.from, i) | is_heated(launch.from, j)};
  const Vec2i offset = separation<kBoundary>(launch.constants.physics.world, self.position, other.position);
  add_contact<Contact>(launch.constants, self, other, offset, sums, tally);
}

// Sums of a parcel with more partners than a FindList holds: a search that adds on the way. Not inlined: the
// kernel would need more registers for what is rare.
template <class Contact, Boundary kBoundary>
__device__ __noinline__ void add_crowd(const StepLaunch& launch, const SearchCircle& circle,
                                       const Parcel& self, ContactSums& sums, DeviceTally& tally) {
  search<kBoundary, true>(launch.space, launch.from.position, circle, [&](std::uint32_t j) {
    touch<Contact, kBoundary>(launch, self, circle.self, j, sums, tally);
  });
}

// Sums the contacts of parcel i with all parcels that touch it.
template <class Contact, Boundary kBoundary>
__device__ ContactSums sum_contacts(const StepLaunch& launch, const Parcel& self, std::uint32_t i,
                                    std::int32_t reach, DeviceTally& tally) {
  const SearchCircle circle{self.position, i, reach, launch.constants.filter_distance2};
  FindList partners;
  search<kBoundary, true>(launch.space, launch.from.position, circle,
                          [&](std::uint32_t j) { partners.push(j); });
  if (partners.num > FindList::kMax) {
    // Copies, since what is passed by reference cannot stay in registers.
    const SearchCircle around = circle;
    const Parcel crowded = self;
    DeviceTally of_crowd{tally.block};
    ContactSums sums;
    add_crowd<Contact, kBoundary>(launch, around, crowded, sums, of_crowd);
    tally = of_crowd;
    return sums;
  }
  ContactSums sums;
  while (partners.num > 0) touch<Contact, kBoundary>(launch, self, i, partners.pop(), sums, tally);
  return sums;
}

// The parcel after the step.
template <class Contact, bool kBall, Boundary kBoundary>
__device__ Parcel step_parcel(const StepLaunch& launch, const Parcel& self, std::uint32_t i,
                              const OfStep& of_step, DeviceTally& tally) {
  if (is_retired(self.position)) return self;
  ContactSums sums;
  if constexpr (has_contacts<Contact>)
    sums = sum_contacts<Contact, kBoundary>(launch, self, i, of_step.reach, tally);
  return finish_step<kBall, kBoundary>(launch.constants, launch.state->motion, of_step.key, self, sums,
                                       tally);
}

template <class Contact, bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kBlocksPerSm)
    step_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  __shared__ TallySlot block_tally;
  __shared__ OfStep of_step;
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  Parcel self{};  // on its way while the first warp works
  if (i < launch.num) self = {launch.from.position[i], launch.from.velocity[i], launch.from.id[i]};
  if (threadIdx.x == 0) of_step = begin_block(launch, block_tally);
  __syncthreads();
  DeviceTally tally{&block_tally};
  Parcel after{};
  if (i < launch.num) after = step_parcel<Contact, kBall, kBoundary>(launch, self, i, of_step, tally);
  if (launch.sort.is_due) {
    const std::uint32_t place = place_of(launch, self.position, i < launch.num);
    if (i < launch.num) put_in_place(launch, place, after);
  } else {
    if (i < launch.num) {
      launch.to.position[i] = after.position;
      launch.to.velocity[i] = after.velocity;
      draw_moved(launch, i, after);
    }
    set_heated_of_warp(launch.to, i, after.is_heated != 0, launch.num);
  }
  add_block(launch, tally, block_tally);
}

__global__ void __launch_bounds__(kBlock) count_for_sort_kernel(const __grid_constant__ StepLaunch launch) {
  prepare_sort(launch, blockIdx.x * kBlock + threadIdx.x);
}

// Computes the rounding keys of the next steps, one thread each.
__device__ void plan_roundings(const StepConstants& c, unsigned long long next_step, StepState& state) {
  const unsigned k = threadIdx.x % 32;
  if (k < kMaxOpenSteps) state.rounding_key[k] = rounding_key(c.physics.seed, next_step + k);
}

__global__ void begin_request_kernel(const __grid_constant__ StepConstants c, StepState* state,
                                     TallySlot* slots) {
  begin_in_turn();
  slots[threadIdx.x] = {};
  if (threadIdx.x < kMaxOpenSteps) state->displacement[threadIdx.x] = 0;
  if (threadIdx.x < 32) plan_roundings(c, state->step, *state);
  if (threadIdx.x != 0) return;
  state->totals = {};
  if (c.physics.ball.exists) plan_ball(c, state->ball, *state);
}

// The sums that open steps are added to.
struct OpenSteps {
  unsigned long long step;
  std::uint32_t displaced_before_last;
  RequestTotals totals;
};

// Adds the sums of the open steps. has_sorted: the last one of them has.
__device__ void end_open_steps(const TallySlot* sums, unsigned num_open, bool has_sorted,
                               const OpenSteps& begun, StepState& state) {
  constexpr std::uint32_t kMax = kHalfSide;
  RequestTotals totals = begun.totals;
  for (unsigned k = 0; k < num_open; ++k) add_to_totals(sums[k], begun.step + k, totals);
  state.totals = totals;
  state.step = begun.step + num_open;
  const std::uint32_t last = min(sums[num_open - 1].max_displacement, kMax);
  state.last_displacement = static_cast<std::int32_t>(last);
  state.displaced = min((has_sorted ? 0 : begun.displaced_before_last) + last, kMax);
}

// A warp sums the slots of each open step. One more moves the ball meanwhile, if there is one.
__global__ void __launch_bounds__((kMaxOpenSteps + 1) * kNumSlots)
    end_steps_kernel(const __grid_constant__ StepConstants c, StepState* state, TallySlot* slots,
                     unsigned num_open, bool has_sorted) {
  begin_in_turn();
  __shared__ TallySlot sums[kMaxOpenSteps];
  const unsigned num_slots = num_open * kNumSlots;
  if (threadIdx.x >= num_slots) {
    move_ball(c, slots + (num_slots - kNumSlots), *state);
  } else {
    const bool adds_up = threadIdx.x >= num_slots - 32;
    OpenSteps begun;
    if (adds_up) begun = {state->step, state->displaced_before[num_open - 1], state->totals};
    const TallySlot sum = sum_slots(slots[threadIdx.x]);
    if (threadIdx.x % 32 == 0) sums[threadIdx.x / 32] = sum;
    __barrier_sync_count(1, num_slots);
    if (threadIdx.x < num_open) state->displacement[threadIdx.x] = 0;
    if (adds_up) plan_roundings(c, begun.step + num_open, *state);
    if (threadIdx.x == num_slots - 32) end_open_steps(sums, num_open, has_sorted, begun, *state);
  }
  __syncthreads();
  if (threadIdx.x < num_slots) slots[threadIdx.x] = {};
}

void launch_kernel(void (*kernel)(StepLaunch), const StepLaunch& launch, cudaStream_t stream) {
  launch_in_turn(kernel, blocks_for(launch.num, kBlock), kBlock, stream, launch);
}

}  // namespace

void launch_step(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.num == 0) return;
  if (launch.one_kernel != OneKernel::plain && !launch.space.all_pairs) {
    launch_step_of_block(launch, stream);
    return;
  }
  for_terms(launch.constants.physics, launch.method, [&]<class Contact, bool kBall, Boundary kBoundary>() {
    launch_kernel(step_kernel<Contact, kBall, kBoundary>, launch, stream);
  });
}

void launch_count(const StepLaunch& launch, cudaStream_t stream) {
  count_for_sort_kernel<<<blocks_for(launch.num, kBlock), kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("count_for_sort_kernel");
}

void launch_push_out(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.num == 0) return;
  for_boundary(launch.constants.physics.world.boundary, [&]<Boundary kBoundary>() {
    launch_kernel(step_kernel<PushOutContact, false, kBoundary>, launch, stream);
  });
}

void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots,
                          cudaStream_t stream) {
  launch_in_turn(begin_request_kernel, 1, kMaxOpenSteps * kNumSlots, stream, constants, state, slots);
}

void launch_end_steps(const StepLaunch& launch, cudaStream_t stream) {
  const unsigned num_warps = launch.num_open + (launch.constants.physics.ball.exists ? 1 : 0);
  launch_in_turn(end_steps_kernel, 1, num_warps * 32, stream, launch.constants, launch.state, launch.slots,
                 launch.num_open, launch.sort.is_due);
}

}  // namespace pf
