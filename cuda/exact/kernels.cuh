// Method `exact` on the device: the kernels' argument, and the functions that launch them.
#pragma once

#include "backend/draw_buffers.hpp"
#include "cuda/cell_sort.cuh"
#include "cuda/exact/step_state.cuh"
#include "cuda/neighbour_search.cuh"

namespace pf::cuda {

constexpr std::uint32_t kMaxChords = 4;  // requested steps that are taken as one where there is a ball

// Argument of all kernels.
struct ExactLaunch {
  RunConstants run;
  DeviceSearch space;
  StepMemory memory;
  ExactState* state = nullptr;
  StepState* step_state = nullptr;  // receives the request's totals and the ball
  TallySlot* slots = nullptr;       // kNumSlots
  DrawBuffers draw;                 // device memory; null pointers: nothing is drawn
  bool ball_was_set = false;        // from outside, since the last request of `exact`
  bool goes_on = false;             // the last request ended within a step
  std::uint64_t budget_ns = 0;      // of the request; 0: none
  // Ticks of the reference speed at which the step ends, and the one after it; 0: there is none.
  std::uint64_t until = 0, next_until = 0;
  // Latest ends of a ball's chords, ascending, up to `until`; and the first end of the step after
  // it.
  std::uint64_t chord_ends[kMaxChords] = {}, next_chord_ends[kMaxChords] = {};
  std::int64_t sort_displacement = 0;  // since the sort; beyond it a step stops for another; 0: never
};

// Blocks of solve_kernel on a multiprocessor. With one no registers spill, so that an event takes less time:
// worst frame of `bullet` of 10^6 408 ms instead of 512, of the court of 10^7 188 instead of 229. With two a
// gas of kManyParcels and more, which has thousands of clusters in a step, is 8 % faster (10^7 on an H200).
constexpr unsigned kFewBlocks = 1, kMoreBlocks = 2;
using SolveKernel = void (*)(ExactLaunch);
// With kFewBlocks on a multiprocessor, or kMoreBlocks. Those of each boundary take a compiler minutes: they
// have a file of their own.
template <Boundary kBoundary>
SolveKernel solve_kernel_of(bool are_few);

// Blocks of solve_kernel, all on the device together, and at most as many as num_parcels need.
std::uint32_t exact_num_slices(std::uint32_t num_parcels, bool has_ball);

// Anchors every parcel at its position, at tick `now` of the reference speed.
void launch_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream);
// Zeroes the request's totals, takes the ball from step_state, plans the first step.
void launch_begin_exact_request(const ExactLaunch& launch, cudaStream_t stream);

// The stages of one step, in this order. They take it to `until`. With sort_displacement they may stop on the
// way; then parcels are sorted and the stages are launched again.
void launch_predict(const ExactLaunch& launch, cudaStream_t stream);
void launch_solve(const ExactLaunch& launch, cudaStream_t stream);  // clusters, pairs, solving, reconciling
// A part of launch_solve: clusters that are many and not solved as pairs.
void launch_first_round(const ExactLaunch& launch, cudaStream_t stream);
void launch_commit(const ExactLaunch& launch, cudaStream_t stream);

// The first and the last kernel of a sort: the first counts the parcels by cell; the last, after the scatter,
// computes positions at the current tick and sets the displacement since the sort to 0.
void launch_count(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream);
void launch_locate(const ExactLaunch& launch, cudaStream_t stream);
// Draws the present state if the request ended before its last step.
void launch_draw_paused(const ExactLaunch& launch, cudaStream_t stream);
// out[i] = position of parcel i.
void launch_copy_positions(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream);

}  // namespace pf::cuda
