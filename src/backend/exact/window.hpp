// Method `exact` on the CPU: the state that the stages of a window share.
//
// An epoch begins with parcels sorted into cells and every parcel's next event predicted up to the epoch's
// end. It is cut into windows, which are solved one after the other. Ticks count from the epoch's start.
//
// A cluster is a set of parcels, perhaps with the ball, whose events in a window depend on each other. One
// thread solves it. A start trajectory is a parcel's trajectory at the window's start; these stay until the
// window is committed.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "backend/cpu_tally.hpp"
#include "backend/exact/broad_phase.hpp"
#include "backend/exact/calendar.hpp"
#include "backend/exact/event_queue.hpp"
#include "backend/exact/event_record.hpp"
#include "backend/parcel_arrays.hpp"
#include "core/thread_team.hpp"
#include "model/exact/epoch_plan.hpp"
#include "model/tally.hpp"

namespace pf {

// A trajectory that an event of the window led to, from its anchor to the parcel's next event.
struct TrajectorySegment {
  Trajectory trajectory;
  std::uint32_t end = 0;                   // tick
  std::uint32_t previous = kInvalidIndex;  // the parcel's segment before it, in the worker's list
};

struct BallTrajectorySegment {
  BallTrajectory trajectory;
  std::uint32_t end = 0;
};

// A parcel of a cluster.
struct Member {
  std::uint32_t index = 0;
  std::uint32_t version = 0;  // of `event`
  Trajectory trajectory;
  Event event;
  std::uint32_t last_contact_tick = 0;
  std::uint32_t last_segment = kInvalidIndex;  // latest completed one; start trajectories are not stored
  std::uint32_t next_generation = 0;           // see generation_at
  bool has_changed = false;
};

// A participating ball. Between windows: its trajectory and its kept event, which may be stale.
struct BallMember {
  ExactBall now;
  Event event;
  std::uint32_t version = 0;
  std::uint32_t next_generation = 0;
  bool has_changed = false;
  bool is_bent = false;      // its path has left the straight one that EpochMemory::on_path is made for
  double fastest_mps = 0.0;  // of its surface
  std::vector<BallTrajectorySegment> segments;
};

// Sums over a cluster's events. There are many clusters, so it is small.
struct ClusterTally {
  std::uint32_t num_collisions = 0, num_ball_hits = 0, num_retired = 0;
  float max_overlap = 0.0F;  // diameters
  std::int64_t impulse_sum = 0;
  BallSums ball;

  void overlap(float diameters) { max_overlap = std::max(max_overlap, diameters); }
  void impulse(std::int32_t counts) { impulse_sum += counts; }
  void begin_contact() { ++num_collisions; }
  void retired() { ++num_retired; }
  void ball_hit(const BallSums& hit) {
    ++num_ball_hits;
    ball += hit;
  }
  void add_to(CpuTally& sum) const {
    sum.num_collisions += num_collisions;
    sum.num_retired += num_retired;
    sum.impulse_sum += impulse_sum;
    sum.overlap(max_overlap);
    sum.num_ball_hits += num_ball_hits;
    sum.ball += ball;
  }
};
static_assert(EventTally<ClusterTally>);

struct Cluster {
  std::uint32_t first_seed = 0, num_seeds = 0;      // in EpochMemory::seeds
  std::uint32_t thread = 0;                         // its worker holds the members
  std::uint32_t first_member = 0, num_members = 0;  // in WorkerState::members
  std::uint32_t first_event = 0, num_events = 0;    // in WorkerState::events if they are recorded
  std::uint32_t first_note = 0, num_notes = 0;      // in WorkerState::notes
  bool has_ball = false;
  bool is_solved = false;              // false: it ran into another cluster
  bool is_merged = false;              // became part of a cluster with a lower index
  bool has_failed = false;             // too many events at one tick, or nearly so
  std::uint32_t stopped_at = kNoTick;  // tick of the first event that was one too many
  std::uint32_t last_tick = 0;         // of its events
  double fastest2 = 0.0;               // largest squared speed after an event
  std::uint64_t event_hash = 0;
  ClusterTally tally;

  // Discards the solution. The next one gets members, events and notes from the end of a worker's lists.
  void restart(unsigned by_thread, std::size_t num_worker_members, std::size_t num_worker_events,
               std::size_t num_worker_notes) {
    thread = by_thread;
    first_member = static_cast<std::uint32_t>(num_worker_members);
    first_event = static_cast<std::uint32_t>(num_worker_events);
    first_note = static_cast<std::uint32_t>(num_worker_notes);
    num_members = num_events = num_notes = 0;
    is_solved = false;
    has_failed = false;
    stopped_at = kNoTick;
    last_tick = 0;
    fastest2 = 0.0;
    event_hash = 0;
    tally = {};
  }
};

// A collision that a member on a new trajectory will have with a parcel outside its cluster, earlier than
// that parcel's kept event. It counts if the trajectory lasts to the window's end.
struct NeighbourNote {
  std::uint32_t neighbour;
  std::uint32_t member;       // slot in WorkerState::members
  std::uint32_t anchor_tick;  // of the member's trajectory
  std::uint32_t tick;
};

// Results and working memory of one thread.
struct WorkerState {
  DiscPairs pairs;
  Candidates candidates[2];
  CpuTally tally;
  std::vector<std::uint32_t> selected;  // parcels for a list that all threads contribute to
  std::vector<std::uint32_t> stale;
  std::uint32_t number = 0;  // a count of the thread's items, or the number of the next of them
  EventQueue queue;
  std::vector<Member> members;  // of all clusters that the thread solved
  std::vector<TrajectorySegment> segments;
  std::vector<NeighbourNote> notes;
  // A changed parcel of a cluster, and one near it in another cluster: found in this round, and in all.
  std::vector<IndexPair> neighbour_pairs, compared_pairs;
  std::vector<IndexPair> conflicts;  // clusters that must be solved as one
  Event ball_event;                  // of a participating ball with a member of a cluster without it
  std::vector<EventRecord> events;
};

// Parcels that are predicted one after the other at an epoch's start. Parcels of a chunk are close together.
constexpr std::uint32_t kChunkSize = 256;

struct EpochInput {
  const Vec2i* position = nullptr;  // at the epoch's start, by which the parcels are sorted
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  bool all_pairs = false;
  double fastest_mps = 0.0;         // bound on the parcels' speeds at the epoch's start
  std::uint64_t start_tick = 0;     // since the reset, ticks of the reference speed
  std::uint32_t tick_exponent = 0;  // a tick of the epoch lasts 2^tick_exponent of these
};

// Working memory of epochs and windows. n: number of parcels.
struct EpochMemory {
  std::vector<WorkerState> workers;  // one for each thread
  BoundingDiscs discs;               // n; of paths along the trajectories to the epoch's end
  std::vector<float> chunk_speed2;   // largest squared speed in each chunk at the epoch's start
  Calendar calendar;
  std::vector<std::uint32_t> owner;        // n + kSearchPadding; cluster, kInvalidIndex between windows
  std::vector<std::uint32_t> member_slot;  // n; of an owned parcel in its worker's members
  std::vector<std::uint32_t> near_ball;    // parcels that may hit the ball in the epoch
  std::vector<std::uint32_t> on_path;      // those near the straight path that it has if nothing hits it
  std::vector<std::uint32_t> due_groups;   // of the calendar, where a kept event lies in the window
  std::vector<std::uint32_t> due;          // parcels whose kept event does
  std::vector<std::uint32_t> active;       // those whose next event does
  std::vector<std::uint32_t> seeds;        // parcels that clusters start from
  std::vector<Cluster> clusters;
  std::vector<std::uint32_t> todo;  // clusters to solve
  ExactBall ball;                   // at the window's start
  Event ball_event;                 // kept, of a participating ball
  BallMember solved_ball;
  std::uint32_t ball_owner = kInvalidIndex;  // cluster
  bool knows_on_path = false;                // in this window

  void prepare_epoch(unsigned num_threads, std::size_t num_parcels);
  void prepare_window();
  std::uint64_t memory_bytes() const;
};

// The window in hand, as every stage gets it.
struct WindowContext {
  const EpochInput& input;
  const ExactConstants& c;
  ParcelArrays& trajectories;    // sorted, positions are anchors; only commit writes them
  std::uint32_t begin = 0;       // ticks
  std::uint32_t end = 0;         // the first tick after the window
  std::uint32_t ball_end = 0;    // the ball's trajectory is not known from this tick on
  std::uint32_t max_events = 0;  // of a cluster; a window in which one has more is cut
  bool records_events = false;
  ThreadTeam& team;
  EpochMemory& memory;
  BallNeighbourhood ball_neighbourhood;
  DiscSpace space;
  DiscSearch search;

  std::size_t num_parcels() const { return trajectories.id.size(); }
  bool has_participant() const { return c.plan.ball == BallRole::participant; }
  bool has_frozen_ball() const { return c.plan.ball == BallRole::frozen; }
  float units_in_epoch() const { return static_cast<float>(c.plan.units_per_tick * c.plan.length); }
  float half_contact() const { return static_cast<float>(0.5 * c.run.contact_distance); }

  Trajectory start_trajectory(std::uint32_t i) const {
    return {trajectories.position[i], trajectories.velocity[i], trajectories.tick[i]};
  }

  template <Boundary kBoundary>
  bool is_near_ball(std::uint32_t i) const {
    return is_in<kBoundary>(ball_neighbourhood, c.run.physics.world, input.position[i]);
  }

  // Tick at which a parcel and the ball collide, or kNoTick.
  template <Boundary kBoundary>
  std::uint32_t ball_tick(const BallTrajectory& ball, const Trajectory& parcel) const {
    const std::uint32_t tick = ball_collision_tick<kBoundary>(c, ball, parcel);
    return tick < ball_end ? tick : kNoTick;
  }

  // Ownership is sequentially consistent: if two clusters each claim a parcel and then look at the other's
  // parcel, at least one of them sees the other's claim.
  std::uint32_t owner_of(std::uint32_t i) const {
    return std::atomic_ref<std::uint32_t>(memory.owner[i]).load();
  }
  // Claims a parcel for a cluster if it is free. Returns its owner afterwards.
  std::uint32_t claim(std::uint32_t i, std::uint32_t cluster) const {
    std::uint32_t owner = kInvalidIndex;
    return std::atomic_ref<std::uint32_t>(memory.owner[i]).compare_exchange_strong(owner, cluster) ? cluster
                                                                                                   : owner;
  }

  // A parcel with the disc of its path from its anchor, or from the window's start, to the epoch's end.
  template <Boundary kBoundary>
  Mover make_mover(std::uint32_t i, const Trajectory& trajectory) const {
    if (is_retired(trajectory.anchor)) return {i, {0.0F, 0.0F, std::nanf("")}};
    const std::int32_t anchored = anchor_time(c.plan, trajectory);
    const auto now = static_cast<std::int32_t>(begin);
    const Vec2i position = anchored >= now ? trajectory.anchor : position_at<kBoundary>(c, trajectory, now);
    const std::int32_t from = std::max(anchored, now);
    const auto units = static_cast<float>(c.plan.units_per_tick * static_cast<double>(c.plan.length - from));
    // A parcel that is faster than the bound makes the window be discarded, so its disc does not matter.
    const double speed2 = dot(trajectory.velocity, trajectory.velocity);
    const bool is_bounded = speed2 <= c.plan.max_speed_mps * c.plan.max_speed_mps;
    return {i, bounding_disc(position, is_bounded ? trajectory.velocity * units : Vec2f{}, half_contact())};
  }

  void find_candidates(const Mover& mover, Candidates& candidates) const {
    candidates.overlapping.clear();
    candidates.owned.clear();
    if (c.run.physics.parcels.contacts) search.find_candidates(space, mover, candidates);
  }
};

}  // namespace pf
