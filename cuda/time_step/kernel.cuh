// The kernels of the time-stepped methods. step_kernel does a whole step of a parcel in one thread, in the
// order of the last sort: it searches the cells that the parcel's search box covers, sums its contacts, moves
// it, and in the last step of a frame writes what is drawn.
//
// `from` and `to` must not overlap; ids do not change. All sums are integers, so the results do not depend on
// the order of threads. The stream comes last.
#pragma once

#include "backend/draw_buffers.hpp"
#include "cuda/neighbour_search.cuh"
#include "cuda/parcel_arrays.cuh"
#include "cuda/time_step/state.cuh"
#include "model/parcel.hpp"

namespace pf {

// Width of the cells, and widest reach of the search box before a sort pays off, in contact distances.
// Measured on an H200, area fraction 0.2, ns per parcel-step at 10^7: width 1.4 and reach 2.0 0.057, 2.0 and
// 2.5 0.052, 2.5 and 2.5 0.051, 3.0 and 2.5 0.053.
constexpr double kStepCellWidth = 2.5;
constexpr double kWidestStepReach = 2.5;

struct StepLaunch {
  StepConstants constants;
  DeviceSearch space;
  ParcelPointers from;
  ParcelPointers to;  // id unused
  StepState* state = nullptr;
  TallySlot* slots = nullptr;  // kNumSlots
  DrawBuffers draw;            // device memory; null pointers: nothing is drawn
  Method method = Method::impulse;
  const std::uint32_t* index = nullptr;  // of the parcels that are to move, `num`; null: the first ones
  std::uint32_t num = 0;
  std::uint32_t skipped_bits = 0;  // a parcel with one of them in its id does not move
};

// One step of the parcels; the ball moves in launch_ball.
void launch_step(const StepLaunch& launch, cudaStream_t stream);
// Moves overlapping parcels apart, and nothing else; dt_s = 0.
void launch_push_out(const StepLaunch& launch, cudaStream_t stream);

// Zeroes the request's totals, and plans the ball's motion for a first step of constants.dt_s.
void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots,
                          cudaStream_t stream);

// Ends a step: adds the slots to the totals and clears them, moves the ball, and plans its next motion.
void launch_ball(const StepConstants& constants, StepState* state, TallySlot* slots, cudaStream_t stream);

}  // namespace pf
