#include "backend/exact/stepper.hpp"

#include <algorithm>
#include <cmath>

#include "backend/exact/clusters.hpp"
#include "backend/exact/commit.hpp"
#include "backend/exact/predict.hpp"
#include "backend/exact/reconcile.hpp"
#include "backend/exact/refresh.hpp"
#include "backend/exact/solve.hpp"

namespace pf {
namespace {

// Adds the time since the last call to a phase. Reads the clock once a stage: a window of few parcels takes
// only some microseconds.
class StageTimer {
 public:
  explicit StageTimer(PhaseTimes& times) : times_(times) {}
  void add_to(Phase phase) {
    const Clock::time_point now = Clock::now();
    times_[phase] += std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
  }

 private:
  PhaseTimes& times_;
  Clock::time_point last_ = Clock::now();
};

DiscSpace disc_space(const EpochInput& input, const ExactConstants& c, const EpochMemory& memory,
                     std::size_t num_parcels) {
  DiscSpace space;
  space.x = memory.discs.x.data();
  space.y = memory.discs.y.data();
  space.radius = memory.discs.radius.data();
  space.owner = memory.owner.data();
  space.cell_start = input.cell_start;
  space.grid = input.grid;
  space.num_parcels = static_cast<std::uint32_t>(num_parcels);
  space.all_pairs = input.all_pairs;
  set_reaches(c, input.fastest_mps, 0, space);
  return space;
}

std::uint64_t num_solved_events(const EpochMemory& memory) {
  std::uint64_t num = 0;
  for (const std::uint32_t k : memory.todo) num += memory.clusters[k].num_events;
  return num;
}

// Sums up the solved clusters. Returns whether all stayed within the window's bounds.
bool sum_up(const WindowContext& window, WindowOutcome& outcome) {
  StepResult& result = outcome.result;
  for (const Cluster& cluster : window.memory.clusters) {
    if (cluster.is_merged) continue;
    if (cluster.has_failed) outcome.failed_at = std::min(outcome.failed_at, cluster.stopped_at);
    result.num_events += cluster.num_events;
    outcome.largest_cluster = std::max(outcome.largest_cluster, cluster.num_events);
    result.fastest_after_mps = std::max(result.fastest_after_mps, std::sqrt(cluster.fastest2));
    outcome.event_hash += cluster.event_hash;
  }
  outcome.needed_bound_mps = result.fastest_after_mps;
  if (window.has_participant())
    outcome.needed_bound_mps = std::max(outcome.needed_bound_mps, window.memory.solved_ball.fastest_mps);
  return outcome.failed_at == kNoTick && outcome.needed_bound_mps <= window.c.plan.max_speed_mps;
}

void append_events(const EpochMemory& memory, std::vector<EventRecord>& events) {
  for (const Cluster& cluster : memory.clusters) {
    if (cluster.is_merged) continue;
    const auto first = memory.workers[cluster.thread].events.begin() + cluster.first_event;
    events.insert(events.end(), first, first + cluster.num_events);
  }
}

void commit_all(WindowContext& window, std::vector<EventRecord>* events, WindowOutcome& outcome) {
  const EpochMemory& memory = window.memory;
  commit(window);
  if (events != nullptr) append_events(memory, *events);
  for (const WorkerState& worker : memory.workers) outcome.tally.add(worker.tally);
  outcome.result.frozen_hits = outcome.tally.ball;
}

}  // namespace

WindowContext ExactStepper::context(const EpochInput& input, const ExactConstants& constants,
                                    const WindowRequest& request, ParcelArrays& trajectories) {
  return {.input = input,
          .c = constants,
          .trajectories = trajectories,
          .begin = request.begin,
          .end = request.end,
          .ball_end = request.ball_end,
          .max_events = request.max_events,
          .records_events = request.events != nullptr,
          .team = team_,
          .memory = memory_,
          .ball_neighbourhood = ball_neighbourhood_,
          .space = space_,
          .search = choose_disc_search(constants.run.physics.world.boundary)};
}

CpuTally ExactStepper::begin_epoch(const EpochInput& input, const ExactConstants& constants,
                                   const BallTrajectory& ball, ParcelArrays& trajectories,
                                   PhaseTimes& times) {
  StageTimer timer(times);
  memory_.prepare_epoch(team_.size(), trajectories.id.size());
  memory_.prepare_window();
  ball_neighbourhood_ = neighbourhood_of(constants, ball);
  space_ = disc_space(input, constants, memory_, trajectories.id.size());
  WindowContext window = context(input, constants, {0, constants.plan.length, 0, 0, nullptr}, trajectories);
  predict_epoch(window);
  CpuTally tally;
  for (const WorkerState& worker : memory_.workers) tally.add(worker.tally);
  timer.add_to(Phase::predict);
  return tally;
}

void ExactStepper::begin_chord(const EpochInput& input, const ExactConstants& constants,
                               const ExactBall& ball, const WindowRequest& request,
                               ParcelArrays& trajectories, PhaseTimes& times) {
  StageTimer timer(times);
  memory_.ball = ball;
  WindowContext window = context(input, constants, request, trajectories);
  predict_ball_events(window);
  timer.add_to(Phase::predict);
}

WindowOutcome ExactStepper::solve_window(const EpochInput& input, const ExactConstants& constants,
                                         const WindowRequest& request, ParcelArrays& trajectories,
                                         PhaseTimes& times) {
  StageTimer timer(times);
  memory_.prepare_window();
  WindowContext window = context(input, constants, request, trajectories);
  refresh(window);
  timer.add_to(Phase::predict);
  form_clusters(window);
  WindowOutcome outcome;
  while (!memory_.todo.empty()) {
    ++outcome.num_rounds;
    solve(window);
    outcome.num_solved += num_solved_events(memory_);
    if (cut(window)) solve(window);
    timer.add_to(Phase::solve);
    find_conflicts(window);
    merge(window);
    timer.add_to(Phase::reconcile);
  }
  outcome.end = window.end;
  outcome.finished = sum_up(window, outcome);
  if (outcome.finished)
    commit_all(window, request.events, outcome);
  else
    discard(window);
  timer.add_to(Phase::commit);
  return outcome;
}

}  // namespace pf
