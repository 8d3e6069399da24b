#include "check.cuh"
#include "model/step.hpp"
#include "step_kernel.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = 256;
constexpr unsigned kBlocksPerSm =
    6;  // holds registers to 40: 0.0481 ns per parcel-step at 10^7, 0.0505 with 5, 0.0549 with 4

// The device's Tally: what is common stays in the thread's registers until the warp is reduced; rare events
// go to the block's slot in shared memory at once.
struct DeviceTally {
  TallySlot* block;
  unsigned int num_collisions = 0;
  int impulse_sum = 0;
  float max_overlap = 0.0F;
  unsigned int travel = 0;
  float speed2 = 0.0F;

  __device__ void overlap(float diameters) { max_overlap = fmaxf(max_overlap, diameters); }
  __device__ void begin_contact() { ++num_collisions; }
  __device__ void impulse(std::int32_t counts) { impulse_sum += counts; }
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

// Adds the warp's tallies to the block's. All 32 threads must call it.
__device__ void reduce_warp(const DeviceTally& tally, TallySlot& block) {
  constexpr unsigned kAll = 0xFFFFFFFFU;
  const bool leads = threadIdx.x % 32 == 0;
  const unsigned int travel = __reduce_max_sync(kAll, tally.travel);
  const unsigned int speed2 = __reduce_max_sync(kAll, __float_as_uint(tally.speed2));
  if (leads) {
    atomicMax(&block.max_travel, travel);
    atomicMax(&block.max_speed2_bits, speed2);
  }
  if (!__any_sync(kAll, tally.max_overlap > 0.0F)) return;
  const unsigned int collisions = __reduce_add_sync(kAll, tally.num_collisions);
  const int impulse = __reduce_add_sync(kAll, tally.impulse_sum);
  const unsigned int overlap = __reduce_max_sync(kAll, __float_as_uint(tally.max_overlap));
  if (leads) {
    atomicAdd(&block.num_collisions, static_cast<unsigned long long>(collisions));
    atomicAdd(&block.impulse_sum, static_cast<unsigned long long>(static_cast<long long>(impulse)));
    atomicMax(&block.max_overlap_bits, overlap);
  }
}

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

// The partners found in the search, kept in registers: a warp's few contacts are resolved together after the
// search instead of one by one inside it.
struct PartnerList {
  static constexpr unsigned kMost = 4;
  std::uint32_t j0 = 0, j1 = 0, j2 = 0, j3 = 0;
  unsigned num = 0;

  __device__ void push(std::uint32_t j) {
    j3 = j2;
    j2 = j1;
    j1 = j0;
    j0 = j;
    ++num;
  }
  __device__ std::uint32_t pop() {
    const std::uint32_t j = j0;
    j0 = j1;
    j1 = j2;
    j2 = j3;
    --num;
    return j;
  }
};

// Calls found(j) for every parcel j but i that the filter lets through.
template <Boundary kBoundary, class Found>
__device__ void search(const StepLaunch& launch, Vec2i position, std::uint32_t i, std::int32_t reach,
                       Found found) {
  const float filter = launch.constants.filter_distance2;
  const auto visit = [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t j = first; j < last; ++j) {
      const int2 there = __ldg(reinterpret_cast<const int2*>(launch.from.position) + j);
      const Vec2i offset =
          separation<kBoundary>(launch.constants.physics.world, position, {there.x, there.y});
      const float x = static_cast<float>(offset.x);
      const float y = static_cast<float>(offset.y);
      if (x * x + y * y < filter && j != i) found(j);
    }
  };
  if (launch.all_pairs) {
    visit(0, launch.num_parcels);
  } else {
    visit_candidate_ranges<kBoundary>(launch.grid, launch.cell_start, position, reach, visit);
  }
}

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
  PartnerList partners;
  search<kBoundary>(launch, self.position, i, reach, [&](std::uint32_t j) { partners.push(j); });
  if (partners.num > PartnerList::kMost) {  // a crowd: search again, resolving on the way
    search<kBoundary>(launch, self.position, i, reach, meet);
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
  if (i < launch.num_parcels) {
    const StepState& state = *launch.state;
    const Parcel self{launch.from.position[i], launch.from.velocity[i], launch.from.id[i]};
    Parcel after = self;
    if (!is_retired(self.position)) {
      ContactSums sums;
      if constexpr (kContacts) {
        const long long reach = c.contact_reach + state.travel;
        sums = sum_contacts<Contact, kBoundary>(
            launch, self, i, static_cast<std::int32_t>(reach < INT32_MAX / 2 ? reach : INT32_MAX / 2), tally);
      }
      after = finish_step<kBall, kBoundary>(c, state.motion, state.rounding_key, self, sums, tally);
    }
    launch.to.position[i] = after.position;
    launch.to.velocity[i] = after.velocity;
    if (launch.keys.key != nullptr) {
      launch.keys.key[i] = cell_key(launch.grid, after.position);
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
  if (c.physics.ball.present)
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

__device__ void add_to_totals(const TallySlot& sum, StepState& state) {
  RequestTotals& totals = state.totals;
  totals.num_collisions += sum.num_collisions;
  totals.impulse_sum += static_cast<long long>(sum.impulse_sum);
  totals.max_overlap = fmaxf(totals.max_overlap, __uint_as_float(sum.max_overlap_bits));
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

__device__ unsigned long long sum_over_warp(unsigned long long value) {
  for (int lane = 16; lane > 0; lane /= 2) value += __shfl_xor_sync(0xFFFFFFFFU, value, lane);
  return value;
}

// One slot a thread; the sum ends up in every thread.
__device__ TallySlot sum_slots(const TallySlot& slot) {
  static_assert(kNumSlots == 32, "one warp reduces the slots");
  constexpr unsigned kAll = 0xFFFFFFFFU;
  TallySlot sum;
  sum.num_collisions = sum_over_warp(slot.num_collisions);
  sum.impulse_sum = sum_over_warp(slot.impulse_sum);
  sum.ball_x = sum_over_warp(slot.ball_x);
  sum.ball_y = sum_over_warp(slot.ball_y);
  sum.ball_torque = sum_over_warp(slot.ball_torque);
  sum.num_hits = __reduce_add_sync(kAll, slot.num_hits);
  sum.num_retired = __reduce_add_sync(kAll, slot.num_retired);
  sum.num_invalid = __reduce_add_sync(kAll, slot.num_invalid);
  sum.first_invalid_id = __reduce_max_sync(kAll, slot.first_invalid_id);
  sum.max_overlap_bits = __reduce_max_sync(kAll, slot.max_overlap_bits);
  sum.max_travel = __reduce_max_sync(kAll, slot.max_travel);
  sum.max_speed2_bits = __reduce_max_sync(kAll, slot.max_speed2_bits);
  return sum;
}

__global__ void __launch_bounds__(kNumSlots)
    ball_kernel(const __grid_constant__ StepConstants c, StepState* state, TallySlot* slots) {
  const TallySlot sum = sum_slots(slots[threadIdx.x]);
  slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  add_to_totals(sum, *state);
  state->last_travel = static_cast<std::int32_t>(sum.max_travel);
  state->travel += state->last_travel;
  if (c.physics.ball.present) {
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
  const bool ball = physics.ball.present;
  if (!physics.parcels.contacts) {
    return ball ? kernel_for<ImpulseContact, false, true>(boundary)
                : kernel_for<ImpulseContact, false, false>(boundary);
  }
  if (method == Method::spring) {
    return ball ? kernel_for<SpringContact, true, true>(boundary)
                : kernel_for<SpringContact, true, false>(boundary);
  }
  return ball ? kernel_for<ImpulseContact, true, true>(boundary)
              : kernel_for<ImpulseContact, true, false>(boundary);
}

}  // namespace

void launch_step(const StepLaunch& launch, cudaStream_t stream) {
  if (launch.num_parcels == 0) return;
  const unsigned blocks = (launch.num_parcels + kBlock - 1) / kBlock;
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
