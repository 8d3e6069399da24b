// Method `exact` on the CPU: the state that the stages of a step share.
//
// A cluster is a set of parcels, perhaps with the ball, whose events depend on each other. One thread solves
// it. A start trajectory is a parcel's trajectory at the step's start; these stay until the step is
// committed.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "backend/parcel_arrays.hpp"
#include "backend/cpu_tally.hpp"
#include "backend/exact/broad_phase.hpp"
#include "backend/exact/event_queue.hpp"
#include "backend/exact/event_record.hpp"
#include "core/thread_team.hpp"
#include "model/exact/step_plan.hpp"
#include "model/tally.hpp"

namespace pf {

// A trajectory that an event of the step led to, from its anchor to the parcel's next event.
struct TrajectorySegment {
  Trajectory trajectory;
  std::uint32_t end = 0;                   // tick of the step
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
  bool has_changed = false;
};

// The ball as a member of the cluster that owns it.
struct BallMember {
  ExactBall now;
  Event event;
  std::uint32_t version = 0;
  bool has_changed = false;
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
    ball.impulse_x += hit.impulse_x;
    ball.impulse_y += hit.impulse_y;
    ball.torque += hit.torque;
  }
  void add_to(CpuTally& sum) const {
    sum.num_collisions += num_collisions;
    sum.num_retired += num_retired;
    sum.impulse_sum += impulse_sum;
    sum.overlap(max_overlap);
    if (num_ball_hits == 0) return;
    sum.ball_hit(ball);
    sum.num_ball_hits += num_ball_hits - 1;
  }
};
static_assert(EventTally<ClusterTally>);

struct Cluster {
  std::uint32_t first_seed = 0, num_seeds = 0;      // in StepMemory::seeds
  std::uint32_t thread = 0;                         // its worker holds the members
  std::uint32_t first_member = 0, num_members = 0;  // in WorkerState::members
  std::uint32_t first_event = 0, num_events = 0;    // in WorkerState::events if they are recorded
  bool has_ball = false;
  bool is_solved = false;  // false: it ran into another cluster
  bool is_merged = false;  // became part of a cluster with a lower index
  double fastest2 = 0.0;   // largest squared speed after an event
  std::uint64_t event_hash = 0;
  ClusterTally tally;

  // Discards the solution. The next one gets members and events from the end of a worker's lists.
  void restart(unsigned by_thread, std::size_t num_worker_members, std::size_t num_worker_events) {
    thread = by_thread;
    first_member = static_cast<std::uint32_t>(num_worker_members);
    first_event = static_cast<std::uint32_t>(num_worker_events);
    num_members = num_events = 0;
    is_solved = false;
    fastest2 = 0.0;
    event_hash = 0;
    tally = {};
  }
};

// A collision of two parcels on their start trajectories.
struct PredictedCollision {
  std::uint32_t tick, first, second;
};

// Results and working memory of one thread.
struct WorkerState {
  DiscPairs pairs;
  Candidates candidates[2];
  CpuTally tally;
  std::vector<PredictedCollision> collisions;
  std::vector<std::uint32_t> selected;  // parcels for a list that all threads contribute to
  EventQueue queue;
  std::vector<Member> members;  // of all clusters that the thread solved
  std::vector<TrajectorySegment> segments;
  std::vector<IndexPair>
      neighbour_pairs;               // a changed parcel of a cluster, and one near it in another cluster
  std::vector<IndexPair> conflicts;  // clusters that must be solved as one
  std::vector<EventRecord> events;
};

struct StepInput {
  ExactConstants constants;
  const Vec2i* position = nullptr;  // at the step's start
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  bool all_pairs = false;
  std::int64_t max_displacement = 0;  // bound along an axis from the sort to the step's start, position units
  double fastest_mps = 0.0;           // bound on the parcels' speeds at the step's start
  std::uint64_t start_tick = 0;       // since the reset, ticks of the reference speed
  std::uint32_t tick_exponent = 0;    // a tick of the step lasts 2^tick_exponent of these
  std::uint32_t max_events = 100000;  // of a cluster
};

// Working memory of steps, kept from one to the next. n: number of parcels.
struct StepMemory {
  std::vector<WorkerState> workers;  // one for each thread
  BoundingDiscs discs;               // n; of paths along the start trajectories
  // n each; a parcel's earliest event on the start trajectories: event_key and partner.
  std::vector<std::uint64_t> event_key;  // kNoEvent between steps
  std::vector<std::uint32_t> event_partner;
  std::vector<std::uint32_t> owner;        // n + kSearchPadding; cluster, kInvalidIndex between steps
  std::vector<std::uint32_t> member_slot;  // n; of an owned parcel in its worker's members
  std::vector<std::uint32_t> active;       // parcels with an event before the step's end
  std::vector<std::uint32_t> near_ball;    // parcels that may hit the ball, if it is a participant
  std::vector<std::uint32_t> seeds;        // parcels that clusters start from
  std::vector<Cluster> clusters;
  std::vector<std::uint32_t> todo;  // clusters to solve
  BallMember ball;
  std::uint32_t ball_owner = kInvalidIndex;  // cluster

  void prepare(unsigned num_threads, std::size_t num_parcels);
  std::uint64_t memory_bytes() const;
};

// Orders the events of a parcel: by tick, then by the partner's id.
inline std::uint64_t event_key(std::uint32_t tick, std::uint32_t partner_id) {
  return (static_cast<std::uint64_t>(tick) << 32U) | partner_id;
}
constexpr std::uint64_t kNoEvent = ~0ULL;

// The step in hand, as every stage gets it.
struct StepContext {
  const StepInput& input;
  const ExactConstants& c;
  ParcelArrays& trajectories;  // sorted, positions are anchors; only commit writes them
  const ExactBall& ball;       // at the step's start
  Vec2i* end_position;         // n; at the step's end
  bool records_events;
  ThreadTeam& team;
  StepMemory& memory;
  BallNeighbourhood ball_neighbourhood;
  DiscSpace space;
  DiscSearch search;

  std::size_t num_parcels() const { return trajectories.id.size(); }
  bool has_participant() const { return c.plan.ball == BallRole::participant; }
  float units_in_step() const { return static_cast<float>(c.plan.units_per_tick * c.plan.length); }
  float half_contact() const { return static_cast<float>(0.5 * c.run.contact_distance); }

  Trajectory start_trajectory(std::uint32_t i) const {
    return {trajectories.position[i], trajectories.velocity[i], trajectories.tick[i]};
  }

  // A parcel's earliest event on the start trajectories.
  Event start_event(std::uint32_t i) const {
    const std::uint64_t key = memory.event_key[i];
    if (key == kNoEvent) return {};
    return {static_cast<std::uint32_t>(key >> 32U), memory.event_partner[i], static_cast<std::uint32_t>(key)};
  }

  template <Boundary kBoundary>
  bool is_near_ball(std::uint32_t i) const {
    return is_in<kBoundary>(ball_neighbourhood, c.run.physics.world, input.position[i]);
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

  // A parcel on a new trajectory, with the disc of its path from the anchor, or from the step's start, on.
  Mover make_mover(std::uint32_t i, const Trajectory& trajectory) const {
    const std::int32_t from = std::max(anchor_time(c.plan, trajectory), 0);
    const Vec2i position = from > 0 ? trajectory.anchor : input.position[i];
    const auto units = static_cast<float>(c.plan.units_per_tick * static_cast<double>(c.plan.length - from));
    // A parcel that is faster than the bound makes the step be discarded, so its disc does not matter.
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

// Parcels' discs and cells of a step, for searches.
DiscSpace make_disc_space(const StepInput& input, const StepMemory& memory, std::size_t num_parcels);

}  // namespace pf
