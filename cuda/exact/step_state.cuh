// Method `exact` on the device: a step is a kernel in which every parcel predicts its earliest event, one
// that forms clusters and solves those of two parcels with one event (exact_pairs.cuh), a cooperative one
// that solves the others, and one that commits (backend/exact_stepper.hpp has the same in plain loops; the
// formulas are model/exact.hpp). Nothing comes back to the host between steps: plans, redone steps and the
// ball stay on the device.
#pragma once

#include "backend/draw_buffers.hpp"
#include "core/index.hpp"
#include "model/exact/step_plan.hpp"
#include "cuda/neighbour_search.cuh"
#include "cuda/time_step/state.cuh"

namespace pf {

constexpr std::uint32_t kBallCluster = 0xFFFFFFFEU;  // a cluster is called by a parcel of it, or this

// A parcel of a cluster, as far as it is solved.
struct ClusterMember {
  Trajectory trajectory;
  Event event;
  std::uint32_t index, id;
  std::uint32_t next;  // in the cluster's list
  std::uint32_t last_contact_tick;
  std::uint32_t segments;  // the latest of its earlier lines but the one at the step's begin
  float fastest_mps;       // in the step so far
  std::uint32_t has_changed;
};

// A line that an event of the step led to, from its anchor until the parcel's next event.
struct TrajectorySegment {
  Trajectory trajectory;
  std::uint32_t end;
  std::uint32_t before;
};

struct BallTrajectorySegment {
  BallTrajectory trajectory;
  std::uint32_t end;
};

// What the events of a cluster add up to; the model's Tally.
struct EventSums {
  std::uint32_t num_events = 0, num_collisions = 0, num_hits = 0, num_retired = 0;
  float max_overlap = 0.0F;
  float fastest2 = 0.0F;  // square of the largest speed after an event
  long long impulse_sum = 0, ball_x = 0, ball_y = 0, ball_torque = 0;
  unsigned long long event_hash = 0;

  PF_HD void begin_contact() { ++num_collisions; }
  PF_HD void impulse(std::int32_t counts) { impulse_sum += counts; }
  PF_HD void overlap(float diameters) { max_overlap = max_overlap < diameters ? diameters : max_overlap; }
  PF_HD void ball_hit(const BallSums& hit) {
    ++num_hits;
    ball_x += hit.impulse_x;
    ball_y += hit.impulse_y;
    ball_torque += hit.torque;
  }
};

constexpr std::uint32_t kSolved = 1, kSolvedAsPair = 2;

// Stands beside the member that the cluster is called by.
struct ClusterRecord {
  std::uint32_t members;      // list of those that it was solved with; kNone if another absorbed it: `toward`
  std::uint32_t merged;       // list of those that it is to be solved with, being one with others
  std::uint32_t parent;       // the cluster that it became part of, or itself
  std::uint32_t claimed;      // round in which it was last merged
  std::uint32_t is_solved;    // 0, kSolved or kSolvedAsPair
  std::uint32_t wants_block;  // too large for a warp
  EventSums sum;
};

// Items found for or by the blocks of the cooperative kernel, each in a segment of its own: no block waits
// for a common counter. Found beyond `capacity` a segment, the step is too long for the lists and is redone.
struct SlicedList {
  std::uint32_t* items = nullptr;  // num_segments x capacity
  std::uint32_t capacity = 0;
};

// How many items a segment has, outside of the cooperative kernel.
struct SliceCounts {
  std::uint32_t active, neighbour_pairs, members;
};

// Lists common to all blocks.
struct CommonList {
  std::uint32_t* items = nullptr;
  std::uint32_t capacity = 0;
};

// What the clusters are made of; n entries each where nothing else is said.
struct ExactArrays {
  ParcelPointers trajectories;    // sorted; positions are anchors
  Vec2i* present[2] = {};  // at the step's begin and, in the other, at its end: ExactState::parity
  std::uint32_t* event_tick = nullptr;  // along the lines of the begin
  std::uint32_t* event_partner = nullptr;
  std::uint32_t* owner = nullptr;      // cluster, or kNone
  std::uint32_t* member_slot = nullptr;      // of an owned parcel among the members
  std::uint32_t* list_head = nullptr;  // of a cluster's first members
  SlicedList active;                // parcels with an event before the end
  std::uint32_t num_slices = 0;      // blocks of the cooperative kernel
  ClusterMember* members = nullptr;    // num_segments x member_capacity
  ClusterRecord* records = nullptr;    // as many; and one for the ball
  TrajectorySegment* segments = nullptr;     // num_segments x segment_capacity
  uint2* neighbour_pairs = nullptr;  // num_segments x border_capacity: parcels of two clusters, near each other
  SliceCounts* counts = nullptr;  // num_segments
  std::uint32_t member_capacity = 0, segment_capacity = 0, neighbour_pair_capacity = 0;
  CommonList representatives;  // those that clusters are called by, but for solved pairs
  CommonList near_ball;
  CommonList todo;             // clusters to solve again
  uint2* conflicts = nullptr;  // pairs of clusters
  std::uint32_t conflict_capacity = 0;
  BallTrajectorySegment* ball_segments = nullptr;
  std::uint32_t ball_segment_capacity = 0;
};

// Lives on the device.
struct ExactState {
  ExactProgress progress;
  StepPlan plan;  // of the step in hand
  ExactBall ball;       // at the begin, then at the end
  BallNeighbourhood ball_neighbourhood;
  std::uint32_t max_ticks = 0;  // ticks that the step may take
  std::uint32_t current_buffer = 0;
  std::uint32_t list_overflow = 0;       // a list was full before solve_kernel: all its blocks know it
  std::uint32_t solve_failed = 0;         // a list was full in solve_kernel, or a cluster had too many events
  std::uint32_t too_fast_bits = 0;  // largest speed above the assumed bound, float, m/s
  std::uint32_t num_near_ball = 0;
  std::uint32_t num_representatives = 0, num_begun = 0;  // the latter: of these, beyond the first of each warp
  std::uint32_t num_conflicts[2] = {};           // of all blocks; of one that solves the rest alone
  std::uint32_t num_todo = 0;
  std::uint32_t to_commit = 0;              // the step is solved as far as `until`
  std::uint32_t num_committed = 0;          // blocks that have done their part
  std::uint32_t ball_owner = kBallCluster;  // the cluster that has the ball
  // The ball as a member of a cluster.
  ExactBall ball_now;
  Event ball_event;
  std::uint32_t num_ball_segments = 0;
  std::uint32_t ball_has_changed = 0;
  std::uint32_t fastest_after_bits = 0;  // square of the largest speed after an event, float
  std::uint32_t fastest_now_bits = 0;    // of all parcels' speeds, when lines are anchored anew
  unsigned long long num_events = 0;     // of the step
  unsigned long long num_rounds = 0;     // of the request
  unsigned long long num_retried = 0;
  unsigned long long event_hash = 0;
  std::uint32_t unresolvable = 0;  // a step of one tick failed
};

struct ExactLaunch {
  RunConstants run;
  DeviceSearch space;
  ExactArrays arrays;
  ExactState* state = nullptr;
  StepState* step_state = nullptr;  // receives the request's totals and the ball
  TallySlot* slots = nullptr;       // kNumSlots
  DrawBuffers draw;                 // null pointers: nothing is drawn
  bool ball_was_set = false;        // from outside, since the last request
  std::uint64_t until = 0;          // tick at which the step ends
  std::uint64_t next_until = 0;     // and the one after it; 0: none
  std::int64_t farthest = 0;  // travel at which a step stops on its way, for a sort, position units; 0: none
};

// Blocks of the cooperative kernel that are on the device together, at most what n parcels need.
std::uint32_t exact_num_slices(std::uint32_t num_parcels);

// Anchors every parcel where it is: ticks, clocks, present positions, the largest speed.
void launch_exact_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream);
// Zeroes the request's totals; takes the ball from step_state.
void launch_exact_begin_request(const ExactLaunch& launch, cudaStream_t stream);
// Present positions of parcels that were just sorted; travel starts at zero.
void launch_exact_locate(const ExactLaunch& launch, cudaStream_t stream);
// One step, to `until`; or, with launch.farthest, a part of the way that is to be gone on with.
void launch_exact_step(const ExactLaunch& launch, cudaStream_t stream);
// Keys and indices of a sort by the present positions.
void launch_exact_write_keys(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream);
// out[i] = present position of parcel i.
void launch_exact_copy_positions(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream);

}  // namespace pf
