// Method `exact` on the CPU: what the phases of a step share.
//
// A cluster is what one thread solves on its own: parcels, and perhaps the ball, whose events hang together.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "backend/cell_sort.hpp"
#include "backend/cpu_tally.hpp"
#include "backend/exact/broad_phase.hpp"
#include "backend/exact/event_record.hpp"
#include "model/exact/step_plan.hpp"

namespace pf {

// A line that an event of the step led to, from its anchor until the parcel's next event.
struct TrajectorySegment {
  Trajectory trajectory;
  std::uint32_t end = 0;         // tick of the step
  std::uint32_t before = kInvalidIndex;  // the parcel's previous one, in the worker's list
};

struct BallTrajectorySegment {
  BallTrajectory trajectory;
  std::uint32_t end = 0;
};

struct Member {
  std::uint32_t index = 0;
  std::uint32_t version = 0;  // counts what `event` was: entries of the queue with another are void
  Trajectory trajectory;
  Event event;
  std::uint32_t last_contact_tick = 0;
  std::uint32_t segments = kInvalidIndex;  // the latest of its earlier lines but the one at the step's begin
  bool has_changed = false;
};

struct BallMember {
  ExactBall now;
  Event event;
  std::uint32_t version = 0;
  bool has_changed = false;
  double fastest_mps = 0.0;  // of its surface
  std::vector<BallTrajectorySegment> segments;
};

// What a cluster's events add to the step's tally. There are many clusters: it is as small as it can be.
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

struct Cluster {
  std::uint32_t first_seed = 0, num_seeds = 0;      // in ExactStep::seeds
  std::uint32_t thread = 0;                         // whose worker has its members
  std::uint32_t first_member = 0, num_members = 0;  // in Worker::members
  std::uint32_t first_event = 0, num_events = 0;    // num: resolved; in Worker::events if they are recorded
  bool has_ball = false;
  bool is_solved = false;       // else it ran into another
  bool is_merged_away = false;  // into one with a lower index
  double fastest2 = 0.0;        // largest squared speed that an event led to
  std::uint64_t event_hash = 0;
  ClusterTally tally;
};

// What one thread collects, and its working memory.
struct WorkerState {
  struct Entry {                    // of the queue of events, earliest first
    std::uint32_t tick, low, high;  // low, high: ids of the two
    std::uint32_t member, version;
  };
  struct Pair {
    std::uint32_t first, second;
  };
  struct Hit {  // of two parcels on the lines of the begin
    std::uint32_t tick, first, second;
  };

  DiscPairs pairs;
  Candidates candidates[2];
  CpuTally tally;
  std::vector<Hit> hits;
  std::vector<std::uint32_t> found;
  std::vector<Entry> queue;
  std::vector<Member> members;    // of all clusters that it solved
  std::vector<TrajectorySegment> segments;  // of these members
  std::vector<Pair> neighbour_pairs;       // a changed parcel of a cluster, and one near it of another
  std::vector<Pair> conflicts;    // clusters that have to be solved as one
  std::vector<EventRecord> events;
};

struct StepInput {
  ExactConstants constants;
  const Vec2i* present = nullptr;  // positions at the begin
  const std::uint32_t* cell_start = nullptr;
  GridShape grid;
  bool all_pairs = false;
  std::int64_t max_displacement = 0;             // bound on displacements along an axis from the sort to the begin
  double fastest_mps = 0.0;            // largest parcel speed at the begin
  std::uint64_t start_tick = 0;        // since the reset, in ticks of the reference speed
  std::uint32_t tick_exponent = 0;            // those of the step are 2^coarse of them
  std::uint32_t max_events = 100000;  // of a cluster
};

// The step that is being made: the lines at its begin, which stay as they are until all is solved, and what
// is known of each parcel.
template <Boundary kBoundary>
struct ExactStep {
  const StepInput& problem;
  const ExactConstants& c;
  const ParcelArrays& trajectories;  // sorted; positions are anchors
  const ExactBall& ball;      // at the begin
  bool recording = false;     // of events
  // A parcel's earliest event along the lines of the begin: tick and partner id as event_key, and partner.
  std::vector<std::uint64_t>& event_key;
  std::vector<std::uint32_t>& event_partner;
  std::vector<std::uint32_t>& owner;  // cluster, or kNone
  std::vector<std::uint32_t>& place;  // of an owned parcel in its worker's members
  const std::uint32_t& ball_owner;    // cluster of a participant
  std::vector<std::uint32_t>& near_ball;
  std::vector<std::uint32_t>& seeds;
  BallMember& ball_member;  // of the cluster that owns the ball
  DiscSpace space = {};     // on the lines of the begin
  DiscSearch discs = choose_disc_search(kBoundary);
  Vec2i ball_centre = {};       // at the begin, position units
  std::int32_t ball_reach = 0;  // half side of the box around it that holds all parcels that may meet it

  std::size_t size() const { return trajectories.id.size(); }
  Trajectory trajectory(std::uint32_t i) const { return {trajectories.position[i], trajectories.velocity[i], trajectories.tick[i]}; }
  bool has_participant() const { return c.plan.ball == BallRole::participant; }

  bool is_near_ball(std::uint32_t i) const {
    const Vec2i from = separation<kBoundary>(c.run.physics.world, ball_centre, problem.present[i]);
    return std::abs(static_cast<std::int64_t>(from.x)) <= ball_reach &&
           std::abs(static_cast<std::int64_t>(from.y)) <= ball_reach;
  }

  // Sequentially consistent: of two clusters that take a parcel each and then look at the other's, one sees
  // it.
  std::uint32_t owner_of(std::uint32_t i) const { return std::atomic_ref<std::uint32_t>(owner[i]).load(); }
  static std::uint32_t take(std::uint32_t& of, std::uint32_t cluster) {  // its owner afterwards
    std::uint32_t seen = kInvalidIndex;
    return std::atomic_ref<std::uint32_t>(of).compare_exchange_strong(seen, cluster) ? cluster : seen;
  }

  float half_contact() const { return static_cast<float>(0.5 * c.run.contact_distance); }

  // Of a parcel on a line of the step, from its anchor or the begin on.
  Disc disc_of(std::uint32_t i, const Trajectory& now) const {
    const std::int32_t since = std::max(anchor_time(c, now), 0);
    const Vec2i from = since > 0 ? now.anchor : problem.present[i];
    const auto units = static_cast<float>(c.plan.units_per_tick * static_cast<double>(c.plan.length - since));
    const double speed2 = dot(now.velocity, now.velocity);
    const bool within = speed2 <= c.plan.max_speed_mps * c.plan.max_speed_mps;  // else the step is given up
    return bounding_disc(from, within ? now.velocity * units : Vec2f{}, half_contact());
  }

  // Whom parcels on other lines than at the begin may meet.
  void search(std::uint32_t i, const Trajectory& now, Candidates& candidates) const {
    candidates.overlapping.clear();
    candidates.owned.clear();
    if (c.run.physics.parcels.contacts) discs.reach(space, {i, disc_of(i, now)}, candidates);
  }
  void search(const Mover (&movers)[2], Candidates (&candidates)[2]) const {
    if (c.run.physics.parcels.contacts) discs.reach_of_two(space, movers, candidates);
  }
};

// Orders the events of a parcel: by tick, then by the partner's id.
inline std::uint64_t event_key(std::uint32_t tick, std::uint32_t partner_id) {
  return (static_cast<std::uint64_t>(tick) << 32U) | partner_id;
}
constexpr std::uint64_t kNoEvent = ~0ULL;

}  // namespace pf
