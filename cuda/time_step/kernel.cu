#include "cuda/architecture.cuh"
#include "cuda/check.cuh"
#include "cuda/draw_parcel.cuh"
#include "model/time_step.hpp"
#include "cuda/time_step/kernel.cuh"
#include "cuda/tally.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;
// 6 hold registers to 40: 0.0481 ns per parcel-step at 10^7 on an H200, 0.0505 with 5, 0.0549 with 4.
constexpr unsigned kBlocksPerSm = blocks_per_sm(6, kBlock);

// Sums the contacts of parcel i with everything in its search box.
template <class Contact, Boundary kBoundary>
__device__ ContactSums sum_contacts(const StepLaunch& launch, const Parcel& self, std::uint32_t i,
                                    std::int32_t reach, DeviceTally& tally) {
  ContactSums sums;
  const auto meet = [&](std::uint32_t j) {
    const Parcel other{launch.from.position[j], launch.from.velocity[j], launch.from.id[j]};
    const Vec2i offset = separation<kBoundary>(launch.constants.physics.world, self.position, other.position);
    add_contact<Contact>(launch.constants, self, other, offset, sums, tally);
  };
  const auto find = [&](auto found) {
    search<kBoundary, true>(launch.space, launch.from.position, self.position, i, reach,
                            launch.constants.filter_distance2, found);
  };
  FindList partners;
  find([&](std::uint32_t j, Vec2i) { partners.push(j); });
  if (partners.num > FindList::kMax) {  // a crowd: search again, resolving on the way
    find([&](std::uint32_t j, Vec2i) { meet(j); });
    return sums;
  }
  while (partners.num > 0) meet(partners.pop());
  return sums;
}

template <class Contact, bool kContacts, bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kBlocksPerSm)
    step_kernel(const __grid_constant__ StepLaunch launch) {
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  const StepConstants& c = launch.constants;
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  DeviceTally tally{&block_tally};
  if (i < launch.space.num_parcels) {
    const StepState& state = *launch.state;
    const Parcel self{launch.from.position[i], launch.from.velocity[i], launch.from.id[i]};
    Parcel after = self;
    if (!is_retired(self.position)) {
      ContactSums sums;
      if constexpr (kContacts) {
        const long long reach = c.contact_reach + state.max_displacement;
        sums = sum_contacts<Contact, kBoundary>(
            launch, self, i, static_cast<std::int32_t>(reach < kHalfSide ? reach : kHalfSide), tally);
      }
      after = finish_step<kBall, kBoundary>(c, state.motion, state.rounding_key, self, sums, tally);
    }
    launch.to.position[i] = after.position;
    launch.to.velocity[i] = after.velocity;
    if (launch.keys.key != nullptr) {
      launch.keys.key[i] = cell_key(launch.space.grid, after.position);
      launch.keys.index[i] = i;
    }
    if (launch.draw.position_m != nullptr)
      draw_parcel(launch.draw, c.physics.world, i, after.position, after.velocity);
  }
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
  if (threadIdx.x < kNumSlots) slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  state->totals = {};
  plan_step(c, *state);
}

__global__ void __launch_bounds__(kNumSlots)
    ball_kernel(const __grid_constant__ StepConstants c, StepState* state, TallySlot* slots) {
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

using StepKernel = void (*)(StepLaunch);

template <class Contact, bool kContacts, bool kBall>
StepKernel kernel_for(Boundary boundary) {
  switch (boundary) {
    case Boundary::walls:
      return step_kernel<Contact, kContacts, kBall, Boundary::walls>;
    case Boundary::periodic:
      return step_kernel<Contact, kContacts, kBall, Boundary::periodic>;
    default:
      return step_kernel<Contact, kContacts, kBall, Boundary::open>;
  }
}

StepKernel choose_kernel(const Physics& physics, Method method) {
  const Boundary boundary = physics.world.boundary;
  const bool ball = physics.ball.exists;
  if (!physics.parcels.contacts) {
    return ball ? kernel_for<ImpulseContact, false, true>(boundary)
                : kernel_for<ImpulseContact, false, false>(boundary);
  }
  if (method == Method::exact) return kernel_for<PushOutContact, true, false>(boundary);
  if (method == Method::spring) {
    return ball ? kernel_for<SpringContact, true, true>(boundary)
                : kernel_for<SpringContact, true, false>(boundary);
  }
  return ball ? kernel_for<ImpulseContact, true, true>(boundary)
              : kernel_for<ImpulseContact, true, false>(boundary);
}

}  // namespace

void launch_step(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.space.num_parcels == 0) return;
  const unsigned blocks = (launch.space.num_parcels + kBlock - 1) / kBlock;
  choose_kernel(launch.constants.physics, launch.method)<<<blocks, kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("step_kernel");
}

void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots,
                          cudaStream_t stream) {
  begin_request_kernel<<<1, kNumSlots, 0, stream>>>(constants, state, slots);
  PF_LAUNCHED("begin_request_kernel");
}

void launch_ball(const StepConstants& constants, StepState* state, TallySlot* slots, cudaStream_t stream) {
  ball_kernel<<<1, kNumSlots, 0, stream>>>(constants, state, slots);
  PF_LAUNCHED("ball_kernel");
}

}  // namespace pf
