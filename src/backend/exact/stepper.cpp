#include "backend/exact/stepper.hpp"

#include <algorithm>
#include <cmath>

#include "backend/exact/clusters.hpp"
#include "backend/exact/commit.hpp"
#include "backend/exact/predict.hpp"
#include "backend/exact/reconcile.hpp"
#include "backend/exact/solve.hpp"

namespace pf {
namespace {

// Adds the time since the last call to a phase. Reads the clock once a stage: a step of few parcels takes
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

// Sums up the solved clusters. Returns whether all stayed within the step's bounds.
bool sum_up(const StepContext& step, StepOutcome& outcome) {
  bool is_within = true;
  StepResult& result = outcome.result;
  for (const Cluster& cluster : step.memory.clusters) {
    if (cluster.is_merged) continue;
    is_within = is_within && cluster.num_events < step.input.max_events;
    result.num_events += cluster.num_events;
    result.fastest_after_mps = std::max(result.fastest_after_mps, std::sqrt(cluster.fastest2));
    outcome.event_hash += cluster.event_hash;
  }
  outcome.needed_bound_mps = result.fastest_after_mps;
  if (step.has_participant())
    outcome.needed_bound_mps = std::max(outcome.needed_bound_mps, step.memory.ball.fastest_mps);
  return is_within && outcome.needed_bound_mps <= step.c.plan.max_speed_mps;
}

void append_events(const StepMemory& memory, std::vector<EventRecord>& events) {
  for (const Cluster& cluster : memory.clusters) {
    if (cluster.is_merged) continue;
    const auto first = memory.workers[cluster.thread].events.begin() + cluster.first_event;
    events.insert(events.end(), first, first + cluster.num_events);
  }
}

void commit_all(StepContext& step, const StepTarget& target, StepOutcome& outcome) {
  const StepMemory& memory = step.memory;
  commit(step);
  if (step.has_participant()) target.ball = memory.ball.now;
  if (target.events != nullptr) append_events(memory, *target.events);
  for (const WorkerState& worker : memory.workers) outcome.tally.add(worker.tally);
  outcome.result.fastest_at_start_mps = std::sqrt(static_cast<double>(outcome.tally.max_speed2));
  outcome.result.frozen_hits = outcome.tally.ball;
}

}  // namespace

StepOutcome ExactStepper::step(const StepInput& input, const StepTarget& target, PhaseTimes& times) {
  StageTimer timer(times);
  const ExactConstants& c = input.constants;
  const std::size_t num_parcels = target.trajectories.id.size();
  memory_.prepare(team_.size(), num_parcels);
  StepContext step{.input = input,
                   .c = c,
                   .trajectories = target.trajectories,
                   .ball = target.ball,
                   .end_position = target.end_position,
                   .records_events = target.events != nullptr,
                   .team = team_,
                   .memory = memory_,
                   .ball_neighbourhood = neighbourhood_of(c, target.ball.trajectory),
                   .space = make_disc_space(input, memory_, num_parcels),
                   .search = choose_disc_search(c.run.physics.world.boundary)};
  predict(step);
  timer.add_to(Phase::predict);
  form_clusters(step);
  StepOutcome outcome;
  while (!memory_.todo.empty()) {
    ++outcome.num_rounds;
    solve(step);
    timer.add_to(Phase::solve);
    find_conflicts(step);
    merge(step);
    timer.add_to(Phase::reconcile);
  }
  outcome.finished = sum_up(step, outcome);
  if (outcome.finished)
    commit_all(step, target, outcome);
  else
    discard(step);
  timer.add_to(Phase::commit);
  return outcome;
}

}  // namespace pf
