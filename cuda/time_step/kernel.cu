#include "cuda/time_step/kernel.cuh"

#include "cuda/architecture.cuh"
#include "cuda/draw_parcel.cuh"
#include "cuda/launch.cuh"
#include "cuda/tally.cuh"
#include "cuda/time_step/device_contacts.cuh"
#include "model/for_boundary.hpp"
#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;
// 6 limit registers to 40: 0.0481 ns per parcel-step at 10^7 on an H200, 0.0505 with 5, 0.0549 with 4.
constexpr unsigned kBlocksPerSm = blocks_per_sm(6, kBlock);

// Adds the contact of a parcel with parcel j to its sums, if they touch.
template <class Contact, Boundary kBoundary>
__device__ void touch(const StepLaunch& launch, const Parcel& self, std::uint32_t j, ContactSums& sums,
                      DeviceTally& tally) {
  const Parcel other{launch.from.position[j], launch.from.velocity[j], launch.from.id[j],
                     is_heated(launch.from, j)};
  const Vec2i offset = separation<kBoundary>(launch.constants.physics.world, self.position, other.position);
  add_contact<Contact>(launch.constants, self, other, offset, sums, tally);
}

// Sums of a parcel with more partners than a FindList holds: a search that adds on the way. Not inlined: the
// kernel would need more registers for what is rare.
template <class Contact, Boundary kBoundary>
__device__ __noinline__ void add_crowd(const StepLaunch& launch, const SearchCircle& circle,
                                       const Parcel& self, ContactSums& sums, DeviceTally& tally) {
  search<kBoundary, true>(launch.space, launch.from.position, circle,
                          [&](std::uint32_t j) { touch<Contact, kBoundary>(launch, self, j, sums, tally); });
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
  while (partners.num > 0) touch<Contact, kBoundary>(launch, self, partners.pop(), sums, tally);
  return sums;
}

// The parcel after the step.
template <class Contact, bool kBall, Boundary kBoundary>
__device__ Parcel step_parcel(const StepLaunch& launch, const Parcel& self, std::uint32_t i,
                              DeviceTally& tally) {
  if (is_retired(self.position)) return self;
  const StepConstants& c = launch.constants;
  const StepState& state = *launch.state;
  ContactSums sums;
  if constexpr (has_contacts<Contact>)
    sums = sum_contacts<Contact, kBoundary>(launch, self, i, search_reach(c, state), tally);
  return finish_step<kBall, kBoundary>(c, state.motion, state.rounding_key, self, sums, tally);
}

template <class Contact, bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kBlocksPerSm)
    step_kernel(const __grid_constant__ StepLaunch launch) {
  begin_in_turn();
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  DeviceTally tally{&block_tally};
  bool is_heated_after = false;
  if (i < launch.num) {
    const Parcel self{launch.from.position[i], launch.from.velocity[i], launch.from.id[i],
                      is_heated(launch.from, i)};
    const Parcel after = step_parcel<Contact, kBall, kBoundary>(launch, self, i, tally);
    launch.to.position[i] = after.position;
    launch.to.velocity[i] = after.velocity;
    is_heated_after = after.is_heated != 0;
    if (launch.draw.position_m != nullptr)
      draw_parcel(launch.draw, launch.constants.physics.world, i, after.position, after.velocity);
  }
  set_heated_of_warp(launch.to, i, is_heated_after, launch.num);
  reduce_warp(tally, block_tally);
  __syncthreads();
  if (threadIdx.x == 0) add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
}

__device__ void plan_step(const StepConstants& c, StepState& state) {
  if (c.physics.ball.exists)
    state.motion = ball_motion(c.physics.world, c.physics.ball, state.ball, c.ball_contact_m, c.dt_s);
  state.rounding_key = rounding_key(c.physics.seed, state.step);
}

__global__ void begin_request_kernel(const __grid_constant__ StepConstants c, StepState* state,
                                     TallySlot* slots) {
  begin_in_turn();
  if (threadIdx.x < kNumSlots) slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  state->totals = {};
  plan_step(c, *state);
}

__global__ void __launch_bounds__(kNumSlots)
    ball_kernel(const __grid_constant__ StepConstants c, StepState* state, TallySlot* slots) {
  begin_in_turn();
  const TallySlot sum = sum_slots(slots[threadIdx.x]);
  slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  add_to_totals(sum, *state);
  state->last_displacement = static_cast<std::int32_t>(sum.max_displacement);
  state->max_displacement += state->last_displacement;
  if (c.physics.ball.exists) {
    const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                        static_cast<std::int64_t>(sum.ball_torque)};
    BallState ball = state->ball;
    advance_ball(c.physics.world, c.physics.ball, hits, c.impulse_unit_kg_mps, c.dt_s, ball);
    state->ball = ball;
  }
  state->step += 1;
  plan_step(c, *state);
}

void launch_kernel(void (*kernel)(StepLaunch), const StepLaunch& launch, cudaStream_t stream) {
  if (launch.num == 0) return;
  const unsigned blocks = (launch.num + kBlock - 1) / kBlock;
  launch_in_turn(kernel, blocks, kBlock, stream, launch);
}

}  // namespace

void launch_step(const StepLaunch& launch, cudaStream_t stream) {
  for_terms(launch.constants.physics, launch.method, [&]<class Contact, bool kBall, Boundary kBoundary>() {
    launch_kernel(step_kernel<Contact, kBall, kBoundary>, launch, stream);
  });
}

void launch_push_out(const StepLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.constants.physics.world.boundary, [&]<Boundary kBoundary>() {
    launch_kernel(step_kernel<PushOutContact, false, kBoundary>, launch, stream);
  });
}

void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots,
                          cudaStream_t stream) {
  launch_in_turn(begin_request_kernel, 1, kNumSlots, stream, constants, state, slots);
}

void launch_ball(const StepConstants& constants, StepState* state, TallySlot* slots, cudaStream_t stream) {
  launch_in_turn(ball_kernel, 1, kNumSlots, stream, constants, state, slots);
}

}  // namespace pf
