#include "check.cuh"
#include "model/step.hpp"
#include "step_kernel.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;

// The device's Tally: rare events go to the block's slot in shared memory at once, what every parcel has
// (travel, speed) stays in registers until the block is reduced.
struct DeviceTally {
  TallySlot* block;
  double per_impulse_unit;
  unsigned int travel = 0;
  float speed2 = 0.0F;

  __device__ void overlap(double diameters) {
    atomicMax(&block->max_overlap_bits, bit_copy<unsigned long long>(diameters > 0.0 ? diameters : 0.0));
  }
  __device__ void impulse(double mps) {
    atomicAdd(&block->impulse_sum, static_cast<unsigned long long>(round_to_int64(mps * per_impulse_unit)));
  }
  __device__ void begin_contact() { atomicAdd(&block->num_collisions, 1ULL); }
  __device__ void collision(double mps) {
    begin_contact();
    impulse(mps);
  }
  __device__ void ball_hit(const BallSums& hit) {
    atomicAdd(&block->num_hits, 1U);
    atomicAdd(&block->ball_x, static_cast<unsigned long long>(hit.impulse_x));
    atomicAdd(&block->ball_y, static_cast<unsigned long long>(hit.impulse_y));
    atomicAdd(&block->ball_torque, static_cast<unsigned long long>(hit.torque));
  }
  __device__ void moved(std::int32_t moved_units, float new_speed2) {
    travel = static_cast<unsigned int>(moved_units);
    speed2 = new_speed2;
  }
  __device__ void retired() { atomicAdd(&block->num_retired, 1U); }
  __device__ void invalid(std::uint32_t id) {
    atomicAdd(&block->num_invalid, 1U);
    atomicMax(&block->first_invalid_id, ~id);
  }
};

__device__ void add_slot(TallySlot& to, const TallySlot& from) {
  if (from.num_collisions != 0) atomicAdd(&to.num_collisions, from.num_collisions);
  if (from.impulse_sum != 0) atomicAdd(&to.impulse_sum, from.impulse_sum);
  if (from.max_overlap_bits != 0) atomicMax(&to.max_overlap_bits, from.max_overlap_bits);
  if (from.num_hits != 0) {
    atomicAdd(&to.num_hits, from.num_hits);
    atomicAdd(&to.ball_x, from.ball_x);
    atomicAdd(&to.ball_y, from.ball_y);
    atomicAdd(&to.ball_torque, from.ball_torque);
  }
  if (from.num_retired != 0) atomicAdd(&to.num_retired, from.num_retired);
  if (from.num_invalid != 0) {
    atomicAdd(&to.num_invalid, from.num_invalid);
    atomicMax(&to.first_invalid_id, from.first_invalid_id);
  }
  atomicMax(&to.max_travel, from.max_travel);
  atomicMax(&to.max_speed2_bits, from.max_speed2_bits);
}

__device__ void draw_parcel(const DrawBuffers& draw, const World& world, std::uint32_t i, Vec2i position,
                            Vec2f velocity) {
  const bool gone = is_retired(position);
  draw.position_m[i] = gone ? Vec2f{kOutOfSight_m, kOutOfSight_m} : to_float(to_metres(world, position));
  draw.speed_mps[i] = sqrtf(velocity.x * velocity.x + velocity.y * velocity.y);
}

// Sums the contacts of parcel i with everything in its search box.
template <class Contact, Boundary kBoundary>
__device__ ContactSums sum_contacts(const StepLaunch& launch, const Parcel& self, std::uint32_t i,
                                    std::int32_t reach, DeviceTally& tally) {
  const StepConstants& c = launch.constants;
  ContactSums sums;
  const auto visit = [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t j = first; j < last; ++j) {
      const Vec2i offset = separation<kBoundary>(c.physics.world, self.position, launch.from.position[j]);
      const float x = static_cast<float>(offset.x);
      const float y = static_cast<float>(offset.y);
      if (x * x + y * y < c.filter_distance2 && j != i) {
        const Parcel other{launch.from.position[j], launch.from.velocity[j], launch.from.id[j]};
        add_contact<Contact>(c, self, other, offset, sums, tally);
      }
    }
  };
  if (launch.all_pairs) {
    visit(0, launch.num_parcels);
  } else {
    visit_candidate_ranges<kBoundary>(launch.grid, launch.cell_start, self.position, reach, visit);
  }
  return sums;
}

template <class Contact, bool kContacts, bool kBall, Boundary kBoundary>
__global__ void __launch_bounds__(kBlock) step_kernel(const __grid_constant__ StepLaunch launch) {
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  const StepConstants& c = launch.constants;
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  DeviceTally tally{&block_tally, c.per_impulse_unit};
  if (i < launch.num_parcels) {
    const StepState& state = *launch.state;
    const Parcel self{launch.from.position[i], launch.from.velocity[i], launch.from.id[i]};
    Parcel after = self;
    if (!is_retired(self.position)) {
      ContactSums sums;
      if constexpr (kContacts) {
        const long long reach = c.contact_reach + state.travel;
        sums = sum_contacts<Contact, kBoundary>(launch, self, i,
                                                static_cast<std::int32_t>(reach < INT32_MAX / 2 ? reach : INT32_MAX / 2),
                                                tally);
      }
      after = finish_step<kBall, kBoundary>(c, state.motion, state.rounding_key, self, sums, tally);
    }
    launch.to.position[i] = after.position;
    launch.to.velocity[i] = after.velocity;
    if (launch.draw.position_m != nullptr) draw_parcel(launch.draw, c.physics.world, i, after.position, after.velocity);
  }
  const unsigned int travel = __reduce_max_sync(0xFFFFFFFFU, tally.travel);
  const unsigned int speed2 = __reduce_max_sync(0xFFFFFFFFU, __float_as_uint(tally.speed2));
  if (threadIdx.x % 32 == 0) {
    atomicMax(&block_tally.max_travel, travel);
    atomicMax(&block_tally.max_speed2_bits, speed2);
  }
  __syncthreads();
  if (threadIdx.x == 0) add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
}

__device__ void plan_step(const StepConstants& c, StepState& state) {
  state.motion = ball_motion(c.physics.world, c.physics.ball, state.ball, c.ball_contact_m, c.dt_s);
  state.rounding_key = rounding_key(c.physics.seed, state.step);
}

__global__ void begin_request_kernel(const __grid_constant__ StepConstants c, StepState* state, TallySlot* slots) {
  if (threadIdx.x < kNumSlots) slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  state->totals = {};
  plan_step(c, *state);
}

__device__ void add_to_totals(const TallySlot& sum, StepState& state) {
  RequestTotals& totals = state.totals;
  totals.num_collisions += sum.num_collisions;
  totals.impulse_sum += static_cast<long long>(sum.impulse_sum);
  totals.max_overlap = fmax(totals.max_overlap, bit_copy<double>(sum.max_overlap_bits));
  totals.ball_x += static_cast<long long>(sum.ball_x);
  totals.ball_y += static_cast<long long>(sum.ball_y);
  totals.ball_torque += static_cast<long long>(sum.ball_torque);
  totals.num_hits += sum.num_hits;
  totals.num_retired += sum.num_retired;
  totals.max_speed2 = __uint_as_float(sum.max_speed2_bits);
  if (totals.num_invalid == 0 && sum.num_invalid != 0) {
    totals.first_invalid_step = state.step;
    totals.first_invalid_id = ~sum.first_invalid_id;
  }
  totals.num_invalid += sum.num_invalid;
}

__global__ void __launch_bounds__(kNumSlots)
    ball_kernel(const __grid_constant__ StepConstants c, StepState* state, TallySlot* slots) {
  __shared__ TallySlot sum;
  if (threadIdx.x == 0) sum = {};
  __syncthreads();
  add_slot(sum, slots[threadIdx.x]);
  slots[threadIdx.x] = {};
  __syncthreads();
  if (threadIdx.x != 0) return;
  StepState after = *state;
  add_to_totals(sum, after);
  after.last_travel = static_cast<std::int32_t>(sum.max_travel);
  after.travel += after.last_travel;
  if (c.physics.ball.present) {
    const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                        static_cast<std::int64_t>(sum.ball_torque)};
    advance_ball(c.physics.world, c.physics.ball, hits, c.impulse_unit_kg_mps, c.dt_s, after.ball);
  }
  after.step += 1;
  plan_step(c, after);
  *state = after;
}

using StepKernel = void (*)(StepLaunch);

template <class Contact, bool kContacts, bool kBall>
StepKernel kernel_for(Boundary boundary) {
  switch (boundary) {
    case Boundary::walls: return step_kernel<Contact, kContacts, kBall, Boundary::walls>;
    case Boundary::periodic: return step_kernel<Contact, kContacts, kBall, Boundary::periodic>;
    default: return step_kernel<Contact, kContacts, kBall, Boundary::open>;
  }
}

StepKernel choose_kernel(const Physics& physics, Method method) {
  const Boundary boundary = physics.world.boundary;
  const bool ball = physics.ball.present;
  if (!physics.parcels.contacts) {
    return ball ? kernel_for<ImpulseContact, false, true>(boundary) : kernel_for<ImpulseContact, false, false>(boundary);
  }
  if (method == Method::spring) {
    return ball ? kernel_for<SpringContact, true, true>(boundary) : kernel_for<SpringContact, true, false>(boundary);
  }
  return ball ? kernel_for<ImpulseContact, true, true>(boundary) : kernel_for<ImpulseContact, true, false>(boundary);
}

}  // namespace

void launch_step(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.num_parcels == 0) return;
  const unsigned blocks = (launch.num_parcels + kBlock - 1) / kBlock;
  choose_kernel(launch.constants.physics, launch.method)<<<blocks, kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("step_kernel");
}

void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots, cudaStream_t stream) {
  begin_request_kernel<<<1, kNumSlots, 0, stream>>>(constants, state, slots);
  PF_LAUNCHED("begin_request_kernel");
}

void launch_ball(const StepConstants& constants, StepState* state, TallySlot* slots, cudaStream_t stream) {
  ball_kernel<<<1, kNumSlots, 0, stream>>>(constants, state, slots);
  PF_LAUNCHED("ball_kernel");
}

}  // namespace pf
