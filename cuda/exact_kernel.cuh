// Method `exact` on the device: a step is one kernel in which every parcel predicts its earliest event, and
// one cooperative kernel that does the rounds (backend/exact_stepper.hpp has the same in plain loops; the
// formulas are model/exact.hpp). Nothing comes back to the host between steps: plans, redone steps and the
// ball stay on the device.
#pragma once

#include "backend/draw_buffers.hpp"
#include "model/exact_plan.hpp"
#include "search.cuh"
#include "step_state.cuh"

namespace pf {

// Items found by the blocks of the cooperative kernel, each in a segment of its own: no block waits for a
// common counter. Found beyond `capacity` a segment, the step is too long for the lists and is redone.
struct SegmentedList {
  std::uint32_t* items = nullptr;   // num_segments x capacity
  std::uint32_t* counts = nullptr;  // num_segments
  std::uint32_t capacity = 0;
  std::uint32_t slot = 0;  // which of the lists it is
};

// A parcel as it was at the step's begin.
struct SavedLine {
  std::uint32_t index;
  Line line;
  std::uint32_t clock;
};

struct RoundLists {
  SegmentedList active[2], lowered, changed, flagged, near_ball;
  SavedLine* saved = nullptr;  // num_segments x saved_capacity
  std::uint32_t* num_saved = nullptr;
  std::uint32_t saved_capacity = 0;
};

// What the rounds work on; n entries each where nothing else is said.
struct ExactArrays {
  ParcelPointers lines;    // sorted; positions are anchors
  Vec2i* present[2] = {};  // at the step's begin and, in the other, at its end: ExactState::parity
  std::uint32_t* event_tick = nullptr;
  std::uint32_t* event_partner = nullptr;
  std::uint32_t* bound = nullptr;
  std::uint32_t* mark = nullptr;   // when last touched by a round, and how: see exact_kernel.cu
  RoundLists lists;                // a segment for each block of the cooperative kernel
  RoundLists alone;                // one segment, for the block that does the last rounds alone
  std::uint32_t num_segments = 0;  // blocks of the cooperative kernel
};

// Lives on the device.
struct ExactState {
  ExactProgress progress;
  ExactConstants plan;  // of the step in hand
  ExactBall ball;
  Vec2i ball_centre;  // at the step's begin
  std::int32_t ball_reach = 0;
  std::uint32_t longest = 0;  // ticks that the step may take
  std::uint32_t parity = 0;
  std::uint32_t stamp = 2;       // of the coming round; never comes back
  std::uint32_t step_stamp = 2;  // of the step's first round
  std::uint32_t finished = 0;    // whether the rounds came to their end
  std::uint32_t failed = 0;      // stamp of a round in which a list was full; 0: none
  std::uint32_t pending[3] = {};
  std::uint32_t ball_changed_in = 0;  // stamp of the round
  unsigned long long ball_key[2] = {};
  std::uint32_t ball_lowered[2] = {};
  double ball_fastest_mps = 0.0;
  std::uint32_t fastest_after_bits = 0;  // square of the largest speed after an event, float
  unsigned long long num_rounds = 0;     // of the request
  unsigned long long num_redone = 0;
  unsigned long long event_hash = 0;
  std::int64_t last_travel = 0;  // of the last step
};

struct ExactLaunch {
  ExactConstants constants;
  DeviceSearch space;
  ExactArrays arrays;
  ExactState* state = nullptr;
  StepState* step_state = nullptr;  // receives the request's totals and the ball
  TallySlot* slots = nullptr;       // kNumSlots
  DrawBuffers draw;                 // null pointers: nothing is drawn
  bool ball_was_set = false;        // from outside, since the last request
  std::uint64_t until = 0;          // tick at which the step ends
  std::uint64_t next_until = 0;     // and the one after it; 0: none
};

// Blocks of the cooperative kernel that are on the device together, at most what n parcels need.
std::uint32_t exact_num_segments(std::uint32_t num_parcels);

// Anchors every parcel where it is: ticks, clocks, present positions, the largest speed.
void launch_exact_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream);
// Zeroes the request's totals; takes the ball from step_state.
void launch_exact_begin_request(const ExactLaunch& launch, cudaStream_t stream);
// Present positions of parcels that were just sorted; travel starts at zero.
void launch_exact_find_present(const ExactLaunch& launch, cudaStream_t stream);
// One step, to `until`.
void launch_exact_step(const ExactLaunch& launch, cudaStream_t stream);
// Keys and indices of a sort by the present positions.
void launch_exact_write_keys(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream);
// out[i] = present position of parcel i.
void launch_exact_copy_present(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream);

}  // namespace pf
