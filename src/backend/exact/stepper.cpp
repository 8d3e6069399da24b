#include "backend/exact/stepper.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "backend/exact/solve.hpp"
#include "backend/exact/predict.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

constexpr std::size_t kAloneClusters = 16;
constexpr std::size_t kAtATime = 16;    // clusters that a thread takes at once
constexpr std::size_t kFetchAhead = 4;  // so many clusters before its turn, memory is asked for its parcels

using Atomic = std::atomic_ref<std::uint32_t>;

// Sets of parcels as trees in `toward`, a parcel's own index at the root; shared by threads.
std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (true) {
    const std::uint32_t next = Atomic(parent[i]).load(std::memory_order_relaxed);
    if (next == i) return i;
    const std::uint32_t after = Atomic(parent[next]).load(std::memory_order_relaxed);
    if (after != next) Atomic(parent[i]).store(after, std::memory_order_relaxed);
    i = next;
  }
}

void union_sets(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b) {
  while (true) {
    a = find_root(parent, a);
    b = find_root(parent, b);
    if (a == b) return;
    if (a < b) std::swap(a, b);  // the lower index is the root
    std::uint32_t expected = a;
    if (Atomic(parent[a]).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
  }
}

}  // namespace

// What a step does after its prediction.
template <Boundary kBoundary>
struct ExactStepper::Phases : ExactStepper::Prediction<kBoundary> {
  using Before = ExactStepper::Prediction<kBoundary>;
  using Before::end_position;
  using Before::Before;
  using Before::c;
  using Before::each;
  using Before::each_worker;
  using Before::trajectories;
  using Before::predict_all;
  using Before::problem;
  using Before::self;
  using Before::step;

  void solve(unsigned thread, std::uint32_t k) {
    ClusterSolver<kBoundary>(step, self.workers_[thread], thread, k, self.clusters_[k]).solve();
  }

  // What is left of the clusters that are to be solved, of one thread's share.
  struct alignas(64) Share {
    std::atomic<std::size_t> next;
    std::size_t end = 0;
  };

  // Asks memory for what solving the cluster begins with.
  void fetch(std::uint32_t k) const {
    const Cluster& cluster = self.clusters_[k];
    for (std::uint32_t m = 0; m < std::min(cluster.num_seeds, 4U); ++m) {
      const std::uint32_t i = self.seeds_[cluster.first_seed + m];
      const void* wanted[] = {&trajectories.position[i], &trajectories.velocity[i],  &trajectories.tick[i],
                              &trajectories.id[i],       &problem.present[i], &self.event_key_[i],
                              &self.member_slot_[i],    &self.owner_[i],     &self.event_partner_[i],
                              &self.discs_.x[i],  &self.discs_.y[i],   &self.discs_.radius[i]};
      for (const void* trajectory : wanted) __builtin_prefetch(trajectory);
    }
  }

  void solve_rest(unsigned thread, Share& rest) {
    while (true) {
      const std::size_t begin = rest.next.fetch_add(kAtATime, std::memory_order_relaxed);
      if (begin >= rest.end) return;
      const std::size_t end = std::min(rest.end, begin + kAtATime);
      for (std::size_t k = begin; k < end; ++k) {
        if (k + kFetchAhead < rest.end) fetch(self.todo_[k + kFetchAhead]);
        solve(thread, self.todo_[k]);
      }
    }
  }

  // Each cluster to do by one thread: first those whose parcels it predicted and has at hand, then what
  // others have left.
  void solve() {
    const std::size_t count = self.todo_.size();
    if (count < kAloneClusters) {
      for (const std::uint32_t k : self.todo_) solve(0, k);
      return;
    }
    const unsigned num_threads = self.team_.size();
    std::vector<Share> rests(num_threads);
    for (unsigned thread = 0; thread < num_threads; ++thread) {
      const auto [begin, end] = self.team_.share(thread, count);
      rests[thread].next = begin;
      rests[thread].end = end;
    }
    self.team_.run([&](unsigned thread) {
      for (unsigned k = 0; k < num_threads; ++k) solve_rest(thread, rests[(thread + k) % num_threads]);
    });
  }

  // ---- clusters

  // At first, those whose earliest events are with each other, in a chain; and the ball.
  void form_clusters() {
    std::vector<std::uint32_t>& parent = self.member_slot_;
    const std::vector<std::uint32_t>& active = self.active_;
    each(active.size(), [&](WorkerState&, std::size_t k) { parent[active[k]] = active[k]; });
    each(active.size(), [&](WorkerState&, std::size_t k) {
      const std::uint32_t partner = self.event_partner_[active[k]];
      if (is_parcel(partner)) union_sets(parent, active[k], partner);
    });
    self.clusters_.clear();
    for (const std::uint32_t i : active) {
      const std::uint32_t root = find_root(parent, i);
      if (self.owner_[root] == kInvalidIndex) {
        self.owner_[root] = static_cast<std::uint32_t>(self.clusters_.size());
        self.clusters_.emplace_back();
      }
      self.owner_[i] = self.owner_[root];
      ++self.clusters_[self.owner_[i]].num_seeds;
    }
    std::uint32_t first = 0;
    for (Cluster& cluster : self.clusters_) {
      cluster.first_seed = first;
      first += cluster.num_seeds;
      cluster.num_seeds = 0;
    }
    self.seeds_.resize(first);
    for (const std::uint32_t i : active) {
      Cluster& cluster = self.clusters_[self.owner_[i]];
      self.seeds_[cluster.first_seed + cluster.num_seeds++] = i;
    }
    self.ball_owner_ = kInvalidIndex;
    self.ball_member_.has_changed = false;
    if (step.has_participant()) {
      self.ball_owner_ = static_cast<std::uint32_t>(self.clusters_.size());
      self.clusters_.emplace_back().has_ball = true;
    }
    self.todo_.resize(self.clusters_.size());
    for (std::uint32_t k = 0; k < self.todo_.size(); ++k) self.todo_[k] = k;
  }

  // visit(line, end) for the lines that events of the step led a parcel to, the latest first.
  template <class Visit>
  bool any_segment(std::uint32_t i, const Visit& visit) const {
    const WorkerState& worker = self.workers_[self.clusters_[self.owner_[i]].thread];
    const Member& member = worker.members[self.member_slot_[i]];
    if (!member.has_changed) return false;
    if (!is_retired(member.trajectory.anchor) && visit(member.trajectory, c.plan.length)) return true;
    for (std::uint32_t s = member.segments; s != kInvalidIndex; s = worker.segments[s].before) {
      if (visit(worker.segments[s].trajectory, worker.segments[s].end)) return true;
    }
    return false;
  }

  bool trajectories_collide(std::uint32_t i, std::uint32_t j) const {
    return any_segment(i, [&](const Trajectory& a, std::uint32_t a_end) {
      return any_segment(j, [&](const Trajectory& b, std::uint32_t b_end) {
        const std::uint32_t tick = collision_tick<kBoundary>(c, a, b);
        return tick != kNoTick && tick <= std::min(a_end, b_end);
      });
    });
  }

  bool collides_with_ball(std::uint32_t i) const {
    const auto meets = [&](const Trajectory& trajectory, std::uint32_t trajectory_end, const BallTrajectory& of_ball,
                           std::uint32_t end) {
      const std::uint32_t tick = ball_collision_tick<kBoundary>(c, of_ball, trajectory);
      return tick != kNoTick && tick <= std::min(trajectory_end, end);
    };
    return any_segment(i, [&](const Trajectory& trajectory, std::uint32_t end) {
      if (meets(trajectory, end, self.ball_member_.now.trajectory, c.plan.length)) return true;
      for (const BallTrajectorySegment& segment : self.ball_member_.segments) {
        if (meets(trajectory, end, segment.trajectory, segment.end)) return true;
      }
      return false;
    });
  }

  // Adds to `conflicts` the clusters whose new lines would have met.
  void find_conflicts() {
    std::size_t num_pairs = 0;
    for (const WorkerState& worker : self.workers_) num_pairs += worker.neighbour_pairs.size();
    each_worker(num_pairs, [&](WorkerState& worker) {
      for (const WorkerState::Pair& pair : worker.neighbour_pairs) {
        const std::uint32_t a = self.owner_[pair.first], b = self.owner_[pair.second];
        if (a != b && self.clusters_[b].is_solved && trajectories_collide(pair.first, pair.second))
          worker.conflicts.push_back({a, b});
      }
      worker.neighbour_pairs.clear();
    });
    const std::uint32_t with_ball = self.ball_owner_;
    if (with_ball == kInvalidIndex || !self.ball_member_.has_changed || !self.clusters_[with_ball].is_solved) return;
    each(self.near_ball_.size(), [&](WorkerState& worker, std::size_t k) {
      const std::uint32_t i = self.near_ball_[k], owner = self.owner_[i];
      if (owner != kInvalidIndex && owner != with_ball && self.clusters_[owner].is_solved && collides_with_ball(i))
        worker.conflicts.push_back({with_ball, owner});
    });
  }

  // Makes one of each set of clusters that conflict: the one with the lowest index, which is to be solved
  // again.
  void merge() {
    if (!any_conflict()) return self.todo_.clear();
    std::vector<std::uint32_t>& parent = self.todo_;
    parent.resize(self.clusters_.size());
    for (std::uint32_t k = 0; k < parent.size(); ++k) parent[k] = k;
    std::vector<std::uint32_t> involved;
    for (WorkerState& worker : self.workers_) {
      for (const WorkerState::Pair& pair : worker.conflicts) {
        union_sets(parent, pair.first, pair.second);
        involved.push_back(pair.first);
        involved.push_back(pair.second);
      }
      worker.conflicts.clear();
    }
    std::sort(involved.begin(), involved.end());
    involved.erase(std::unique(involved.begin(), involved.end()), involved.end());
    std::vector<WorkerState::Pair> order;  // root, cluster
    for (const std::uint32_t k : involved) order.push_back({find_root(parent, k), k});
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first < b.first : a.second < b.second;
    });
    self.todo_.clear();
    for (const auto& [root, k] : order) reassign_members(root, k);
  }

  // Called for the members of a set in ascending order, so that the first is the root itself.
  void reassign_members(std::uint32_t root, std::uint32_t k) {
    Cluster& into = self.clusters_[root];
    const Cluster& from = self.clusters_[k];
    const WorkerState& worker = self.workers_[from.thread];
    if (root == k) {
      self.todo_.push_back(root);
      into.first_seed = static_cast<std::uint32_t>(self.seeds_.size());
      into.num_seeds = 0;
    }
    for (std::uint32_t m = from.first_member; m < from.first_member + from.num_members; ++m) {
      const std::uint32_t i = worker.members[m].index;
      self.owner_[i] = root;
      self.seeds_.push_back(i);
      ++into.num_seeds;
    }
    if (root == k) return;
    if (from.has_ball) {
      into.has_ball = true;
      self.ball_owner_ = root;
    }
    self.clusters_[k].is_merged_away = true;
  }

  bool any_conflict() const {
    return std::any_of(self.workers_.begin(), self.workers_.end(),
                       [](const WorkerState& worker) { return !worker.conflicts.empty(); });
  }

  // Solves all clusters; whether that came to an end within the bounds.
  bool solve_all(StepOutcome& outcome) {
    predict_all();
    form_clusters();
    while (!self.todo_.empty()) {
      ++outcome.num_rounds;
      solve();
      find_conflicts();
      merge();
    }
    bool within = true;
    for (const Cluster& cluster : self.clusters_) {
      if (cluster.is_merged_away) continue;
      within = within && cluster.num_events < problem.max_events;
      outcome.num_events += cluster.num_events;
      outcome.fastest_mps = std::max(outcome.fastest_mps, std::sqrt(cluster.fastest2));
    }
    outcome.needed_bound_mps = outcome.fastest_mps;
    if (step.has_participant())
      outcome.needed_bound_mps = std::max(outcome.needed_bound_mps, self.ball_member_.fastest_mps);
    return within && outcome.needed_bound_mps <= c.plan.max_speed_mps;
  }

  // What was solved becomes the parcels' state, if `keep`.
  void commit(bool keep) {
    each(self.clusters_.size(), [&](WorkerState& worker, std::size_t k) {
      const Cluster& cluster = self.clusters_[k];
      if (cluster.is_merged_away) return;
      const std::vector<Member>& members = self.workers_[cluster.thread].members;
      for (std::uint32_t m = cluster.first_member; m < cluster.first_member + cluster.num_members; ++m) {
        const Member& member = members[m];
        const std::uint32_t i = member.index;
        self.owner_[i] = kInvalidIndex;
        self.event_key_[i] = kNoEvent;
        if (!keep || !member.has_changed) continue;
        trajectories.position[i] = member.trajectory.anchor;
        trajectories.velocity[i] = member.trajectory.velocity;
        trajectories.tick[i] = member.trajectory.tick;
        if (!trajectories.last_contact_tick.empty()) trajectories.last_contact_tick[i] = member.last_contact_tick;
        end_position[i] = position_at<kBoundary>(c, member.trajectory, static_cast<std::int32_t>(c.plan.length));
      }
      if (keep) cluster.tally.add_to(worker.tally);
    });
  }
};

void ExactStepper::prepare(std::size_t num_parcels) {
  if (owner_.size() != num_parcels + kSearchPadding) owner_.assign(num_parcels + kSearchPadding, kInvalidIndex);
  discs_.resize(num_parcels);
  workers_.resize(team_.size());
  for (WorkerState& worker : workers_) {
    worker.tally = {};
    worker.members.clear();
    worker.segments.clear();
    worker.events.clear();
  }
  if (event_key_.size() != num_parcels) event_key_.assign(num_parcels, kNoEvent);
  event_partner_.resize(num_parcels);
  member_slot_.resize(num_parcels);
}

template <Boundary kBoundary>
StepOutcome ExactStepper::run(const StepInput& problem, ParcelArrays& trajectories, ExactBall& ball,
                               Vec2i* end_position, std::vector<EventRecord>* events) {
  StepOutcome outcome;
  Phases<kBoundary> phases(*this, problem, trajectories, ball, end_position, events != nullptr);
  outcome.finished = phases.solve_all(outcome);
  phases.commit(outcome.finished);
  if (!outcome.finished) return outcome;
  if (phases.step.has_participant()) ball = ball_member_.now;
  for (const Cluster& cluster : clusters_) {
    if (cluster.is_merged_away) continue;
    outcome.event_hash += cluster.event_hash;
    if (events == nullptr) continue;
    const auto first = workers_[cluster.thread].events.begin() + cluster.first_event;
    events->insert(events->end(), first, first + cluster.num_events);
  }
  for (const WorkerState& worker : workers_) outcome.tally.add(worker.tally);
  outcome.fastest_at_start_mps = std::sqrt(static_cast<double>(outcome.tally.max_speed2));
  return outcome;
}

StepOutcome ExactStepper::step(const StepInput& problem, ParcelArrays& trajectories, ExactBall& ball,
                                Vec2i* end_position, std::vector<EventRecord>* events) {
  prepare(trajectories.id.size());
  return for_boundary(problem.constants.run.physics.world.boundary, [&]<Boundary kBoundary>() {
    return run<kBoundary>(problem, trajectories, ball, end_position, events);
  });
}

std::uint64_t ExactStepper::memory_bytes() const {
  std::uint64_t bytes =
      8 * event_key_.capacity() +
      4 * (event_partner_.capacity() + owner_.capacity() + member_slot_.capacity() + active_.capacity() +
           near_ball_.capacity() + seeds_.capacity() + todo_.capacity()) +
      sizeof(Cluster) * clusters_.capacity() + discs_.memory_bytes();
  for (const WorkerState& worker : workers_)
    bytes += sizeof(Member) * worker.members.capacity() + sizeof(TrajectorySegment) * worker.segments.capacity();
  return bytes;
}

}  // namespace pf
