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
std::uint32_t root_of(std::vector<std::uint32_t>& toward, std::uint32_t i) {
  while (true) {
    const std::uint32_t next = Atomic(toward[i]).load(std::memory_order_relaxed);
    if (next == i) return i;
    const std::uint32_t after = Atomic(toward[next]).load(std::memory_order_relaxed);
    if (after != next) Atomic(toward[i]).store(after, std::memory_order_relaxed);
    i = next;
  }
}

void unite(std::vector<std::uint32_t>& toward, std::uint32_t a, std::uint32_t b) {
  while (true) {
    a = root_of(toward, a);
    b = root_of(toward, b);
    if (a == b) return;
    if (a < b) std::swap(a, b);  // the lower index is the root
    std::uint32_t expected = a;
    if (Atomic(toward[a]).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
  }
}

}  // namespace

// What a step does after its prediction.
template <Boundary kBoundary>
struct ExactStepper::Phases : ExactStepper::Prediction<kBoundary> {
  using Before = ExactStepper::Prediction<kBoundary>;
  using Before::at_end;
  using Before::Before;
  using Before::c;
  using Before::each;
  using Before::each_worker;
  using Before::lines;
  using Before::predict_all;
  using Before::problem;
  using Before::self;
  using Before::step;

  void solve(unsigned thread, std::uint32_t k) {
    ClusterSolver<kBoundary>(step, self.workers_[thread], thread, k, self.clusters_[k]).solve();
  }

  // What is left of the clusters that are to be solved, of one thread's share.
  struct alignas(64) Rest {
    std::atomic<std::size_t> next;
    std::size_t end = 0;
  };

  // Asks memory for what solving the cluster begins with.
  void fetch(std::uint32_t k) const {
    const Cluster& cluster = self.clusters_[k];
    for (std::uint32_t m = 0; m < std::min(cluster.num_seeds, 4U); ++m) {
      const std::uint32_t i = self.seeds_[cluster.first_seed + m];
      const void* wanted[] = {&lines.position[i], &lines.velocity[i],  &lines.tick[i],
                              &lines.id[i],       &problem.present[i], &self.event_key_[i],
                              &self.place_[i],    &self.owner_[i],     &self.event_partner_[i],
                              &self.discs_.x[i],  &self.discs_.y[i],   &self.discs_.radius[i]};
      for (const void* line : wanted) __builtin_prefetch(line);
    }
  }

  void solve_rest(unsigned thread, Rest& rest) {
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
    std::vector<Rest> rests(num_threads);
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
    std::vector<std::uint32_t>& toward = self.place_;
    const std::vector<std::uint32_t>& active = self.active_;
    each(active.size(), [&](ExactWorker&, std::size_t k) { toward[active[k]] = active[k]; });
    each(active.size(), [&](ExactWorker&, std::size_t k) {
      const std::uint32_t partner = self.event_partner_[active[k]];
      if (is_parcel(partner)) unite(toward, active[k], partner);
    });
    self.clusters_.clear();
    for (const std::uint32_t i : active) {
      const std::uint32_t root = root_of(toward, i);
      if (self.owner_[root] == kNone) {
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
    self.ball_owner_ = kNone;
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
  bool any_line(std::uint32_t i, const Visit& visit) const {
    const ExactWorker& worker = self.workers_[self.clusters_[self.owner_[i]].thread];
    const Member& member = worker.members[self.place_[i]];
    if (!member.has_changed) return false;
    if (!is_retired(member.line.anchor) && visit(member.line, c.length)) return true;
    for (std::uint32_t s = member.segments; s != kNone; s = worker.segments[s].before) {
      if (visit(worker.segments[s].line, worker.segments[s].end)) return true;
    }
    return false;
  }

  bool would_have_met(std::uint32_t i, std::uint32_t j) const {
    return any_line(i, [&](const Line& a, std::uint32_t a_end) {
      return any_line(j, [&](const Line& b, std::uint32_t b_end) {
        const std::uint32_t tick = meeting<kBoundary>(c, a, b);
        return tick != kNoTick && tick <= std::min(a_end, b_end);
      });
    });
  }

  bool would_have_met_ball(std::uint32_t i) const {
    const auto meets = [&](const Line& line, std::uint32_t line_end, const BallLine& of_ball,
                           std::uint32_t end) {
      const std::uint32_t tick = meeting_ball<kBoundary>(c, of_ball, line);
      return tick != kNoTick && tick <= std::min(line_end, end);
    };
    return any_line(i, [&](const Line& line, std::uint32_t end) {
      if (meets(line, end, self.ball_member_.now.line, c.length)) return true;
      for (const BallSegment& segment : self.ball_member_.segments) {
        if (meets(line, end, segment.line, segment.end)) return true;
      }
      return false;
    });
  }

  // Adds to `conflicts` the clusters whose new lines would have met.
  void compare() {
    std::size_t num_pairs = 0;
    for (const ExactWorker& worker : self.workers_) num_pairs += worker.border.size();
    each_worker(num_pairs, [&](ExactWorker& worker) {
      for (const ExactWorker::Pair& pair : worker.border) {
        const std::uint32_t a = self.owner_[pair.first], b = self.owner_[pair.second];
        if (a != b && self.clusters_[b].is_solved && would_have_met(pair.first, pair.second))
          worker.conflicts.push_back({a, b});
      }
      worker.border.clear();
    });
    const std::uint32_t with_ball = self.ball_owner_;
    if (with_ball == kNone || !self.ball_member_.has_changed || !self.clusters_[with_ball].is_solved) return;
    each(self.near_ball_.size(), [&](ExactWorker& worker, std::size_t k) {
      const std::uint32_t i = self.near_ball_[k], owner = self.owner_[i];
      if (owner != kNone && owner != with_ball && self.clusters_[owner].is_solved && would_have_met_ball(i))
        worker.conflicts.push_back({with_ball, owner});
    });
  }

  // Makes one of each set of clusters that conflict: the one with the lowest index, which is to be solved
  // again.
  void merge() {
    if (!any_conflict()) return self.todo_.clear();
    std::vector<std::uint32_t>& toward = self.todo_;
    toward.resize(self.clusters_.size());
    for (std::uint32_t k = 0; k < toward.size(); ++k) toward[k] = k;
    std::vector<std::uint32_t> involved;
    for (ExactWorker& worker : self.workers_) {
      for (const ExactWorker::Pair& pair : worker.conflicts) {
        unite(toward, pair.first, pair.second);
        involved.push_back(pair.first);
        involved.push_back(pair.second);
      }
      worker.conflicts.clear();
    }
    std::sort(involved.begin(), involved.end());
    involved.erase(std::unique(involved.begin(), involved.end()), involved.end());
    std::vector<ExactWorker::Pair> order;  // root, cluster
    for (const std::uint32_t k : involved) order.push_back({root_of(toward, k), k});
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first < b.first : a.second < b.second;
    });
    self.todo_.clear();
    for (const auto& [root, k] : order) take_over(root, k);
  }

  // Called for the members of a set in ascending order, so that the first is the root itself.
  void take_over(std::uint32_t root, std::uint32_t k) {
    Cluster& into = self.clusters_[root];
    const Cluster& from = self.clusters_[k];
    const ExactWorker& worker = self.workers_[from.thread];
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
                       [](const ExactWorker& worker) { return !worker.conflicts.empty(); });
  }

  // Solves all clusters; whether that came to an end within the bounds.
  bool solve_all(ExactOutcome& outcome) {
    predict_all();
    form_clusters();
    while (!self.todo_.empty()) {
      ++outcome.num_rounds;
      solve();
      compare();
      merge();
    }
    bool within = true;
    for (const Cluster& cluster : self.clusters_) {
      if (cluster.is_merged_away) continue;
      within = within && cluster.num_events < problem.most_events;
      outcome.num_events += cluster.num_events;
      outcome.fastest_mps = std::max(outcome.fastest_mps, std::sqrt(cluster.fastest2));
    }
    outcome.needed_bound_mps = outcome.fastest_mps;
    if (step.has_participant())
      outcome.needed_bound_mps = std::max(outcome.needed_bound_mps, self.ball_member_.fastest_mps);
    return within && outcome.needed_bound_mps <= c.max_speed_mps;
  }

  // What was solved becomes the parcels' state, if `keep`.
  void commit(bool keep) {
    each(self.clusters_.size(), [&](ExactWorker& worker, std::size_t k) {
      const Cluster& cluster = self.clusters_[k];
      if (cluster.is_merged_away) return;
      const std::vector<Member>& members = self.workers_[cluster.thread].members;
      for (std::uint32_t m = cluster.first_member; m < cluster.first_member + cluster.num_members; ++m) {
        const Member& member = members[m];
        const std::uint32_t i = member.index;
        self.owner_[i] = kNone;
        self.event_key_[i] = kNoEvent;
        if (!keep || !member.has_changed) continue;
        lines.position[i] = member.line.anchor;
        lines.velocity[i] = member.line.velocity;
        lines.tick[i] = member.line.tick;
        if (!lines.clock.empty()) lines.clock[i] = member.clock;
        at_end[i] = position_at<kBoundary>(c, member.line, static_cast<std::int32_t>(c.length));
      }
      if (keep) cluster.tally.add_to(worker.tally);
    });
  }
};

void ExactStepper::prepare(std::size_t num_parcels) {
  if (owner_.size() != num_parcels + kSearchPadding) owner_.assign(num_parcels + kSearchPadding, kNone);
  discs_.resize(num_parcels);
  workers_.resize(team_.size());
  for (ExactWorker& worker : workers_) {
    worker.tally = {};
    worker.members.clear();
    worker.segments.clear();
    worker.events.clear();
  }
  if (event_key_.size() != num_parcels) event_key_.assign(num_parcels, kNoEvent);
  event_partner_.resize(num_parcels);
  place_.resize(num_parcels);
}

template <Boundary kBoundary>
ExactOutcome ExactStepper::run(const ExactProblem& problem, ParcelArrays& lines, ExactBall& ball,
                               Vec2i* at_end, std::vector<EventRecord>* events) {
  ExactOutcome outcome;
  Phases<kBoundary> phases(*this, problem, lines, ball, at_end, events != nullptr);
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
  for (const ExactWorker& worker : workers_) outcome.tally.add(worker.tally);
  outcome.fastest_at_begin_mps = std::sqrt(static_cast<double>(outcome.tally.max_speed2));
  return outcome;
}

ExactOutcome ExactStepper::step(const ExactProblem& problem, ParcelArrays& lines, ExactBall& ball,
                                Vec2i* at_end, std::vector<EventRecord>* events) {
  prepare(lines.id.size());
  return for_boundary(problem.constants.step.physics.world.boundary, [&]<Boundary kBoundary>() {
    return run<kBoundary>(problem, lines, ball, at_end, events);
  });
}

std::uint64_t ExactStepper::memory_bytes() const {
  std::uint64_t bytes =
      8 * event_key_.capacity() +
      4 * (event_partner_.capacity() + owner_.capacity() + place_.capacity() + active_.capacity() +
           near_ball_.capacity() + seeds_.capacity() + todo_.capacity()) +
      sizeof(Cluster) * clusters_.capacity() + discs_.memory_bytes();
  for (const ExactWorker& worker : workers_)
    bytes += sizeof(Member) * worker.members.capacity() + sizeof(Segment) * worker.segments.capacity();
  return bytes;
}

}  // namespace pf
