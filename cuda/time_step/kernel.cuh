// The fused collide-and-integrate kernel: one thread a parcel, in the order of the last sort. It reads the
// candidates' positions from the cells its search box covers, sums the contacts, moves the parcel, and in the
// last step of a frame writes what is drawn.
//
// Aliasing: `from` and `to` must not overlap; ids do not change. Deterministic: all sums are integers. Stream
// last.
#pragma once

#include "backend/backend.hpp"
#include "cuda/neighbour_search.cuh"
#include "cuda/time_step/state.cuh"

namespace pf {

struct StepLaunch {
  StepConstants constants;
  DeviceSearch space;
  ParcelPointers from;
  ParcelPointers to;  // id unused
  StepState* state = nullptr;
  TallySlot* slots = nullptr;       // kNumSlots
  SortKeys keys;                    // of the positions after the step, in `grid`
  DrawBuffers draw;                 // device memory; null pointers: nothing is drawn
  Method method = Method::impulse;  // exact: overlaps are pushed apart and nothing else, dt_s = 0
};

// One step of all parcels; the ball stays where it is until launch_ball.
void launch_step(const StepLaunch& launch, cudaStream_t stream);

// Zeroes the request's totals and plans the ball's motion for a first step of constants.dt_s.
void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots,
                          cudaStream_t stream);

// Ends a step: adds up and clears the slots, advances the ball, plans its next motion.
void launch_ball(const StepConstants& constants, StepState* state, TallySlot* slots, cudaStream_t stream);

}  // namespace pf
