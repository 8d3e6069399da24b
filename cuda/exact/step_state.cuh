// Method `exact` on the device: the state that the stages of a step share. src/backend/exact has the same
// stages for the CPU; the formulas are in src/model/exact.
//
// A step is four or five kernels. predict_kernel finds every parcel's earliest event. pair_kernel forms
// clusters, and solves those that are two parcels with one event. Of many parcels first_round_kernel solves
// the other clusters once. solve_kernel, a cooperative kernel, solves what is left and merges clusters that
// conflict, until none do. commit_kernel stores the solution and plans the next step. Plans, retried steps
// and the ball stay on the device, so that steps follow each other without the host.
//
// In a crowd a step is cut into windows, which solve_kernel works through one after the other.
// Each parcel keeps its predicted event from window to window: a window costs what happens in it. The ticks
// of all windows of a step count from the step's start. A kept event may be stale: predicted on a trajectory
// that the partner has left. docs/exact.md says why that does no harm.
//
// A slice is the part of a list that one block of solve_kernel fills and works through: no block waits for a
// counter that all share. A slot is an index into the members of all slices. A start trajectory is a parcel's
// trajectory at the window's start.
#pragma once

#include "core/index.hpp"
#include "cuda/parcel_arrays.cuh"
#include "cuda/time_step/state.cuh"
#include "model/exact/epoch_plan.hpp"
#include "model/exact/event_key.hpp"
#include "model/tally.hpp"

namespace pf::cuda {

// A cluster's name is the index of one of its parcels, the representative.

// Events of a cluster at which its window is retried up to there. If they all lie in one tick, the limit is
// raised, up to the largest one.
constexpr std::uint32_t kMaxClusterEvents = 512, kLargestClusterEvents = 131072;

constexpr double kLongestWindow = 4294967296.0;   // ticks: longer than any step
constexpr std::uint32_t kMaxBallSegments = 1024;  // in a window
constexpr double kPathMargin = 64.0;              // position units
// With at most so many expected in a window the ball is a member of a cluster; with more its path is assumed.
constexpr std::uint32_t kMaxHitsOfMember = 3;
static_assert(kMaxHitsOfMember <= 32);  // a lane for each

// A parcel of a cluster.
struct Member {
  Trajectory trajectory;
  Event event;
  std::uint32_t index, id;
  std::uint32_t next;  // slot of the cluster's next member, or kInvalidIndex
  std::uint32_t last_contact_tick;
  std::uint32_t last_segment;     // latest completed one, or kInvalidIndex; start trajectories are not stored
  float fastest_mps;              // in the window so far
  std::uint32_t has_changed;      // one of the values below
  std::uint32_t next_generation;  // see generation_at
};

// Values of Member::has_changed. kHitBall: changed, the last time by the ball. kWasDue, at the commit:
// unchanged, but its kept event did not happen.
constexpr std::uint32_t kUnchanged = 0, kChanged = 1, kHitBall = 2, kWasDue = 3;

// A trajectory that an event of the window led to, from its anchor to the parcel's next event.
struct TrajectorySegment {
  Trajectory trajectory;
  std::uint32_t end;       // tick of the step
  std::uint32_t previous;  // the parcel's segment before it, or kInvalidIndex
};

// A piece of the ball's path through a window. It begins with an event of the ball.
struct BallSegment {
  BallTrajectory trajectory;
  std::uint32_t begin;            // tick
  std::uint32_t partner;          // of the event: id of a parcel, or a code
  std::uint32_t next_generation;  // see generation_at
};

// Properties of a segment that only the tracing of the path needs.
struct SegmentCause {
  Vec2d end_velocity_mps;           // the ball's, as in ExactBall, after the event
  Trajectory before;                // if the event is a hit, of the parcel
  std::uint32_t parcel_generation;  // of the parcel on that, as BallHit::next_generation
};

// A hit that a solution has, or that is expected before there is one.
struct BallHit {
  std::uint32_t tick, id;
  // It counts if that attempt became the cluster's solution. Of an expected hit: the parcel's index, then its
  // cluster if the ball is a member; and 0.
  std::uint32_t cluster, attempt;
  Trajectory before;              // of the parcel
  std::uint32_t next_generation;  // of the parcel on that; see generation_at
  std::uint32_t segment = 0;      // of a solution: that of the path, as it was assumed, on which the hit is
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
  std::uint32_t attempt;      // that led to the solution
  ClusterTally tally;
};

// A list in slices. If a slice overflows, the step is retried with half the length.
struct SlicedList {
  std::uint32_t* items = nullptr;  // num_slices x capacity
  std::uint32_t capacity = 0;
};

// Numbers of items in a slice. While solve_kernel runs, those of a block's slice are in shared memory.
struct SliceCounts {
  std::uint32_t active, members, segments, neighbour_pairs;
  std::uint32_t alone;  // 1 if the block solves the rest of the step alone
  std::uint32_t round;
};

// A list that all blocks share.
struct CommonList {
  std::uint32_t* items = nullptr;
  std::uint32_t capacity = 0;
};

constexpr std::uint32_t kTile = 32;  // parcels

// Memory of a step, n entries each unless noted; exact/memory.cuh says where it lies.
struct StepMemory {
  ParcelPointers trajectories;  // sorted; positions are anchors
  // At the step's start, traced back along the current trajectory, and at its end.
  // ExactState::current_buffer: start.
  Vec2i* positions[2] = {};
  EventKey* events = nullptr;         // kept ones
  std::uint32_t* earliest = nullptr;  // of each tile: none but active parcels keep an earlier event
  std::uint32_t* region_speed2 =
      nullptr;                            // of each region; see exact/region_speeds.cuh; null: there are none
  std::uint32_t* owner = nullptr;         // cluster, or kInvalidIndex
  std::uint32_t* member_slot = nullptr;   // of an owned or active parcel
  std::uint32_t* list_head = nullptr;     // slot of a cluster's first member, at its representative
  SlicedList active;                      // parcels with an event in the window
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
  BallSegment* ball_paths[2] = {};       // kMaxBallSegments each; ExactState::ball_path: the one that holds
  SegmentCause* segment_causes[2] = {};  // of these segments
  BallHit* ball_hits = nullptr;
  std::uint32_t ball_hit_capacity = 0;
};

// The course after a window.
enum class AfterWindow : std::uint32_t {
  next_window,   // of the same step
  retry_window,  // from the same tick, a shorter one
  next_step,
  end_step_here,  // the step ends where the window began: too low a bound on speeds, or it cannot be solved
  retry_step,
  stop,  // a window of one tick failed
};

// Lives on the device.
struct ExactState {
  // The run, at the start of the step.
  ExactProgress progress;
  std::uint32_t current_buffer = 0;  // of StepMemory::positions
  std::uint32_t max_ticks = 0;       // limit of the step's length: halved by a retry

  // The ball's chord: a piece of its flight that is straight in the model (model/exact/epoch_plan.hpp).
  StepPlan chord;
  std::uint32_t has_chord = 0;
  std::int32_t chord_begin = 0;  // tick of the step
  BallSums chord_hits;           // on a frozen ball

  // The step's plan.
  StepPlan plan;
  BallNeighbourhood ball_neighbourhood;

  // The step's counters.
  std::uint32_t num_near_ball = 0;
  std::uint32_t near_ball_overflow = 0;      // 1 if there was no room for all
  std::uint32_t fastest_committed_bits = 0;  // as fastest_after_bits, of the windows before
  unsigned long long num_events = 0;

  // The window's plan.
  std::uint32_t window_begin = 0, window_end = 0;  // ticks of the step
  std::uint32_t max_events = kMaxClusterEvents;    // of a cluster; with more the window is retried
  double window_ticks = kLongestWindow;            // longest window, by what was learnt
  ExactBall ball;                                  // at the window's start

  // The window's counters.
  std::uint32_t list_overflow = 0;  // 1 if a list was full before solve_kernel: all its blocks see the same
  std::uint32_t solve_failed = 0;   // 1 if a list was full in solve_kernel, or a cluster had too many events
  std::uint32_t stopped_at = 0;     // the first tick at which a cluster had too many
  std::uint32_t too_fast_bits = 0;  // speed of the ball's surface above the assumed bound, float, m/s
  std::uint32_t fastest_after_bits = 0;      // square of the parcels' largest speed after an event, float
  std::uint32_t round_events = 0;            // of the cluster with the most in the round, in all attempts
  std::uint32_t serial_events = 0;           // the same, summed over rounds
  unsigned long long num_events_before = 0;  // num_events at the window's start
  std::uint32_t num_representatives = 0;
  std::uint32_t num_taken = 0;            // representatives that warps took beyond their first one
  std::uint32_t first_round_is_done = 0;  // 1 if first_round_kernel has solved all but the ball's cluster
  std::uint32_t num_conflicts[2] = {};    // found by all blocks; by one that solves the rest alone
  std::uint32_t num_todo = 0;

  // The path of a ball, as solutions of this window assume it. A frozen ball has one segment.
  std::uint32_t ball_path = 0;
  std::uint32_t num_ball_segments = 0;
  std::uint32_t path_is_straight = 0;  // 1 if it stays within kPathMargin of its first segment
  std::uint32_t path_has_changed = 0;
  std::uint32_t num_same_segments = 0;  // leading ones that were on the path before, too
  std::uint32_t path_is_checked = 0;    // 1 if parcels outside clusters do not hit the ball on the path
  std::uint32_t round = 0;
  // 1 if the ball joins the cluster of the first parcel that hits it. Then that cluster's name, as long as it
  // is in none kInvalidIndex, and the path by its solution, which lies in the other one of
  // StepMemory::ball_paths.
  std::uint32_t ball_joins = 0;
  std::uint32_t ball_owner = kInvalidIndex;
  std::uint32_t num_solved_segments = 0;
  std::uint32_t solved_path_is_straight = 0;
  std::uint32_t num_ball_hits = 0;    // of all solutions in the window
  std::uint32_t num_wall_events = 0;  // of the ball
  unsigned long long wall_event_hash = 0;
  ExactBall ball_at_end;

  AfterWindow after_window = AfterWindow::next_step;

  // Between the kernels of a step.
  std::uint32_t to_commit = 0;         // 1 if commit_kernel has to store the solution
  std::uint32_t num_committed = 0;     // blocks of commit_kernel that are done
  std::uint32_t fastest_now_bits = 0;  // square of the parcels' largest speed, when all are anchored anew

  // Sums over the request.
  unsigned long long num_rounds = 0;
  unsigned long long num_retried = 0;
  unsigned long long num_events_committed = 0, num_events_solved = 0;  // the latter in all rounds
  std::uint32_t largest_cluster = 0;                                   // events in a window
  unsigned long long event_hash = 0;
  unsigned long long reconcile_ns = 0;  // time in which the first block found conflicts and merged
  std::uint32_t unresolvable = 0;       // 1 if a step of one tick failed
  unsigned long long deadline_ns = 0;   // of the device's clock; 0: none
  std::uint32_t paused = 0;             // 1 if the request ended at the deadline
};

}  // namespace pf::cuda
