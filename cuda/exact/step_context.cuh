// Method `exact` on the device: the step in hand, as every stage gets it.
#pragma once

#include "cuda/architecture.cuh"
#include "cuda/exact/kernels.cuh"

namespace pf::cuda {

constexpr unsigned kExactBlock = 256;
constexpr unsigned kWholeWarp = 0xFFFFFFFFU;

// Loads that start where they stand in the program, not where their values are needed.
__device__ __forceinline__ std::uint32_t load_early(const std::uint32_t* from) {
  std::uint32_t value;
  asm volatile("ld.global.u32 %0, [%1];" : "=r"(value) : "l"(from) : "memory");
  return value;
}
__device__ __forceinline__ double load_early(const double* from) {
  double value;
  asm volatile("ld.global.f64 %0, [%1];" : "=d"(value) : "l"(from) : "memory");
  return value;
}

__device__ inline unsigned long long global_time_ns() {
  unsigned long long time;
  asm volatile("mov.u64 %0, %%globaltimer;" : "=l"(time));
  return time;
}

// A load that sees what other blocks wrote in the same kernel.
__device__ inline std::uint32_t load_fresh(const std::uint32_t* word) {
  return *const_cast<const volatile std::uint32_t*>(word);
}

__device__ inline EventKey load_fresh(const EventKey* event) {
  return *const_cast<const volatile EventKey*>(event);
}

// Returns whether there is nothing to do: a tick of a high exponent led beyond `until`.
__device__ inline bool is_over(const ExactLaunch& launch) {
  const ExactState& state = *launch.state;
  return state.progress.now >= launch.until || state.unresolvable != 0 || state.paused != 0;
}

// Constants of the step, for what reaches to its end.
__device__ __forceinline__ ExactConstants constants_of_step(const ExactLaunch& launch) {
  const StepPlan& plan = launch.state->plan;
  ExactConstants c{launch.run, plan};
  c.plan.start = load_early(&plan.start);
  c.plan.length = load_early(&plan.length);
  c.plan.max_speed_mps = load_early(&plan.max_speed_mps);
  return c;
}

// The same for what reaches to the window's end: then no later event exists.
__device__ __forceinline__ ExactConstants constants_of_window(const ExactLaunch& launch) {
  ExactConstants c = constants_of_step(launch);
  c.plan.length = load_early(&launch.state->window_end);
  return c;
}

// The constants say whether it reaches to the step's end or to the window's.
struct StepContext {
  const ExactLaunch& launch;
  const StepMemory& memory;
  const ExactConstants& c;
  ExactState& state;

  __device__ StepContext(const ExactLaunch& kernel_argument, const ExactConstants& constants)
      : launch(kernel_argument),
        memory(kernel_argument.memory),
        c(constants),
        state(*kernel_argument.state) {}

  __device__ const World& world() const { return c.run.physics.world; }
  __device__ bool has_participant() const { return c.plan.ball == BallRole::participant; }
  __device__ float contact_distance() const { return static_cast<float>(c.run.contact_distance); }
  __device__ float units_in_step() const {  // position units covered at 1 m/s
    return static_cast<float>(c.plan.units_per_tick * c.plan.length);
  }

  __device__ const Vec2i* start_positions() const { return memory.positions[state.current_buffer]; }
  __device__ Trajectory start_trajectory(std::uint32_t i) const {
    const ParcelPointers& parcels = memory.trajectories;
    return {parcels.position[i], parcels.velocity[i], parcels.tick[i]};
  }
  __device__ std::uint32_t id(std::uint32_t i) const { return memory.trajectories.id[i]; }
  __device__ std::uint32_t id_of_partner(std::uint32_t partner) const {
    return is_parcel(partner) ? id(partner) : partner;
  }
  __device__ std::uint32_t owner_of(std::uint32_t i) const { return load_fresh(&memory.owner[i]); }

  // position: of a parcel at the step's start.
  template <Boundary kBoundary>
  __device__ bool is_near_ball(Vec2i position) const {
    return is_in<kBoundary>(state.ball_neighbourhood, world(), position);
  }

  // A tick of the step, as one of the reference speed since the reset.
  __device__ std::uint64_t since_reset(std::uint32_t tick) const {
    return state.progress.now + (static_cast<std::uint64_t>(tick) << state.progress.tick_exponent);
  }

  // Replaces `best` if a collision with parcel j comes before it.
  __device__ void keep_collision(std::uint32_t tick, std::uint32_t j, Event& best,
                                 std::uint32_t generation = 0) const {
    if (tick <= best.tick && tick != kNoTick) keep_earlier(best, {tick, j, id(j), generation});
  }

  // Half side of the search box around a position whose cells hold all parcels within `radius` of it: parcels
  // have moved since the sort.
  template <class Real>
  __device__ std::int32_t search_reach(Real radius) const {
    constexpr Real kAboveRoundings = Real{1} + Real{1e-5};
    const Real reach = radius + static_cast<Real>(state.progress.max_displacement) * kAboveRoundings;
    return static_cast<std::int32_t>(reach < Real{kMaxReach} ? reach : Real{kMaxReach});
  }
  // The same if those parcels have not been faster than speed_mps since the sort.
  __device__ std::int32_t search_reach(float radius, float speed_mps) const {
    constexpr float kAboveRoundings = 1.0F + 1e-5F;
    const auto units = static_cast<float>(state.progress.units_since_sort);
    const auto roundings = static_cast<float>(state.progress.roundings_since_sort);
    const float reach = radius + (speed_mps * units + roundings) * kAboveRoundings;
    return static_cast<std::int32_t>(reach < float{kMaxReach} ? reach : float{kMaxReach});
  }
};

// A block's part of one slice, for kernels that give a slice to several blocks.
struct SlicePart {
  std::uint32_t slice = 0, part = 0, num_parts = 1;
};

}  // namespace pf::cuda
