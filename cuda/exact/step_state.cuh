// Method `exact` on the device: the state that the stages of a step share. src/backend/exact has the same
// stages for the CPU; the formulas are in src/model/exact.
//
// A step is four kernels. predict_kernel finds every parcel's earliest event. pair_kernel forms clusters, and
// solves those that are two parcels with one event. solve_kernel, a cooperative kernel, solves the other
// clusters and merges those that conflict, until none do. commit_kernel stores the solution and plans the
// next step. Plans, retried steps and the ball stay on the device, so that steps follow each other without
// the host.
//
// A slice is the part of a list that one block of solve_kernel fills and works through: no block waits for a
// counter that all share. A slot is an index into the members of all slices. A start trajectory is a parcel's
// trajectory at the step's start.
#pragma once

#include "core/index.hpp"
#include "cuda/parcel_arrays.cuh"
#include "cuda/time_step/state.cuh"
#include "model/exact/step_plan.hpp"
#include "model/tally.hpp"

namespace pf::cuda {

// A cluster's name is the index of one of its parcels, the representative. The cluster that starts with the
// ball has this name.
constexpr std::uint32_t kBallCluster = 0xFFFFFFFEU;

// A parcel of a cluster.
struct Member {
  Trajectory trajectory;
  Event event;
  std::uint32_t index, id;
  std::uint32_t next;  // slot of the cluster's next member, or kInvalidIndex
  std::uint32_t last_contact_tick;
  std::uint32_t last_segment;  // latest completed one, or kInvalidIndex; start trajectories are not stored
  float fastest_mps;           // in the step so far
  std::uint32_t has_changed;   // 1 after its first event
};

// A trajectory that an event of the step led to, from its anchor to the parcel's next event.
struct TrajectorySegment {
  Trajectory trajectory;
  std::uint32_t end;       // tick of the step
  std::uint32_t previous;  // the parcel's segment before it, or kInvalidIndex
};

struct BallTrajectorySegment {
  BallTrajectory trajectory;
  std::uint32_t end;
};

// The ball as a member of the cluster that owns it.
struct BallMember {
  ExactBall now;
  Event event;
  std::uint32_t num_segments = 0;
  std::uint32_t has_changed = 0;
};

// Sums over a cluster's events.
struct ClusterTally {
  std::uint32_t num_events = 0, num_collisions = 0, num_hits = 0, num_retired = 0;
  float max_overlap = 0.0F;  // diameters
  float fastest2 = 0.0F;     // square of the largest speed after an event
  long long impulse_sum = 0, ball_x = 0, ball_y = 0, ball_torque = 0;
  unsigned long long event_hash = 0;

  PF_HD void begin_contact() { ++num_collisions; }
  PF_HD void impulse(std::int32_t counts) { impulse_sum += counts; }
  PF_HD void overlap(float diameters) { max_overlap = max_overlap < diameters ? diameters : max_overlap; }
  PF_HD void retired() { ++num_retired; }
  PF_HD void ball_hit(const BallSums& hit) {
    ++num_hits;
    ball_x += hit.impulse_x;
    ball_y += hit.impulse_y;
    ball_torque += hit.torque;
  }
};
static_assert(EventTally<ClusterTally>);

// Values of Cluster::solution.
constexpr std::uint32_t kUnsolved = 0, kSolved = 1, kSolvedAsPair = 2;

// Lies in the slot of the representative.
struct Cluster {
  std::uint32_t members;      // list of slots; kInvalidIndex after the cluster was absorbed by `parent`
  std::uint32_t merged;       // list of the members of all clusters merged into this one, to be solved next
  std::uint32_t parent;       // cluster that it was merged into, or itself
  std::uint32_t reassigned;   // round in which its members were last reassigned
  std::uint32_t solution;     // kUnsolved, kSolved or kSolvedAsPair
  std::uint32_t needs_block;  // 1 if it is too large for a warp
  ClusterTally tally;
};

// A list in slices. If a slice overflows, the step is retried with half the length.
struct SlicedList {
  std::uint32_t* items = nullptr;  // num_slices x capacity
  std::uint32_t capacity = 0;
};

// Numbers of items in a slice, kept between the kernels.
struct SliceCounts {
  std::uint32_t active, neighbour_pairs, members;
};

// A list that all blocks share.
struct CommonList {
  std::uint32_t* items = nullptr;
  std::uint32_t capacity = 0;
};

// Memory of a step, n entries each unless noted; exact/memory.cuh says where it lies.
struct StepMemory {
  ParcelPointers trajectories;          // sorted; positions are anchors
  Vec2i* positions[2] = {};             // at the step's start and end; ExactState::current_buffer: start
  std::uint32_t* event_tick = nullptr;  // earliest event on the start trajectories
  std::uint32_t* event_partner = nullptr;
  std::uint32_t* owner = nullptr;         // cluster, or kInvalidIndex
  std::uint32_t* member_slot = nullptr;   // of an owned or active parcel
  std::uint32_t* list_head = nullptr;     // slot of a cluster's first member, at its representative
  SlicedList active;                      // parcels with an event before the step's end
  std::uint32_t num_slices = 0;           // blocks of solve_kernel
  Member* members = nullptr;              // num_slices x member_capacity
  Cluster* clusters = nullptr;            // as many, and one for the ball
  TrajectorySegment* segments = nullptr;  // num_slices x segment_capacity
  uint2* neighbour_pairs = nullptr;       // num_slices x neighbour_pair_capacity
  SliceCounts* counts = nullptr;          // num_slices
  std::uint32_t member_capacity = 0, segment_capacity = 0, neighbour_pair_capacity = 0;
  CommonList representatives;  // of clusters that are not solved as pairs
  CommonList near_ball;        // parcels that may hit the ball, if it is a participant
  CommonList todo;             // clusters to solve again
  uint2* conflicts = nullptr;  // pairs of clusters
  std::uint32_t conflict_capacity = 0;
  BallTrajectorySegment* ball_segments = nullptr;
  std::uint32_t ball_segment_capacity = 0;
};

// Lives on the device.
struct ExactState {
  // The run, at the start of the step.
  ExactProgress progress;
  std::uint32_t current_buffer = 0;  // of StepMemory::positions
  std::uint32_t max_ticks = 0;       // limit of the step's length: halved by a retry

  // The step's plan.
  StepPlan plan;
  ExactBall ball;  // at the step's start
  BallNeighbourhood ball_neighbourhood;

  // The step's counters.
  std::uint32_t list_overflow = 0;  // 1 if a list was full before solve_kernel: all its blocks see the same
  std::uint32_t solve_failed = 0;   // 1 if a list was full in solve_kernel, or a cluster had too many events
  std::uint32_t too_fast_bits = 0;  // speed of the ball's surface above the assumed bound, float, m/s
  std::uint32_t fastest_after_bits = 0;  // square of the parcels' largest speed after an event, float
  std::uint32_t num_near_ball = 0;
  std::uint32_t num_representatives = 0;
  std::uint32_t num_taken = 0;          // representatives that warps took beyond their first one
  std::uint32_t num_conflicts[2] = {};  // found by all blocks; by one that solves the rest alone
  std::uint32_t num_todo = 0;
  unsigned long long num_events = 0;
  std::uint32_t ball_owner = kBallCluster;  // cluster
  BallMember ball_member;

  // Between the kernels of a step.
  std::uint32_t to_commit = 0;         // 1 if commit_kernel has to store the solution
  std::uint32_t num_committed = 0;     // blocks of commit_kernel that are done
  std::uint32_t fastest_now_bits = 0;  // square of the parcels' largest speed, when all are anchored anew

  // Sums over the request.
  unsigned long long num_rounds = 0;
  unsigned long long num_retried = 0;
  unsigned long long event_hash = 0;
  unsigned long long reconcile_ns = 0;  // time in which the first block found conflicts and merged
  std::uint32_t unresolvable = 0;       // 1 if a step of one tick failed
};

}  // namespace pf::cuda
