// Method `exact` on the CPU: the steps of a request, which are pieces of time.
#include "backend/exact/limits.hpp"
#include "backend/exact/timeline.hpp"

namespace pf {

// Returns whether the ball was set in motion from outside, too fast for the ticks of a gas that has cooled.
bool ExactTimeline::ball_needs_finer_ticks() const {
  if (!ball_is_new_ || progress_.tick_exponent == 0 || !run_.physics.ball.exists) return false;
  return surface_speed_mps(run_.physics, progress_.ball) >
         tick_speed_mps(run_.reference_ticks, progress_.tick_exponent);
}

BallState ExactTimeline::ball_now() const {
  if (!chord_ || run_.physics.ball.held) return progress_.ball;
  const std::int64_t now = epoch_ ? epoch_->done : 0;
  return ball_in_chord(run_.physics, chord_->plan, stepper_.ball().trajectory, now, progress_.ball);
}

void ExactTimeline::adopt(const Physics& physics, const StepRequest& request) {
  const RunConstants run = make_run_constants(physics, request.contact_clock_s);
  const bool clock_changed =
      run.reference_ticks.contact_duration_ticks != run_.reference_ticks.contact_duration_ticks;
  if (clock_changed || request.neighbors != neighbors_) forget_predictions();
  run_ = run;
  neighbors_ = request.neighbors;
}

// The steps that have ended by now, of a request that did not wait for each of them.
void ExactTimeline::count_ended_steps(const StepRequest& request, double start_s, StepReport& report) {
  time_s_ = start_s;
  report.totals.num_steps = 0;
  for (std::uint32_t k = 1; k < request.num_steps; ++k) {
    const double end_s = end_of_step_s(request, k);
    if (tick_at(end_s) > progress_.now) return;
    time_s_ = end_s;
    ++report.totals.num_steps;
  }
}

// Without a ball, steps leave no trace.
void ExactTimeline::advance_steps(const StepRequest& request, SortedParcels& parcels, StepReport& report) {
  const Deadline deadline(request.budget_ms);
  const bool ends_each = run_.physics.ball.exists || request.budget_ms > 0.0;
  const double start_s = time_s_;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    const double end_s = end_of_step_s(request, k);
    const bool ends_here = ends_each || k == request.num_steps;
    const std::uint64_t before = progress_.now;
    if (ends_here && !advance_until(tick_at(end_s), request, deadline, parcels, report)) {
      is_mid_step_ = is_mid_step_ || chord_ || progress_.now > before;
      if (!ends_each) count_ended_steps(request, start_s, report);
      return;
    }
    is_mid_step_ = false;
    time_s_ = end_s;
    ++report.totals.num_steps;
    if (deadline.has_passed()) return;
  }
}

void ExactTimeline::advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels,
                            BallState& ball, StepReport& report) {
  if (!is_mid_step_) progress_.ball = ball;
  is_unresolvable_ = false;
  adopt(physics, request);
  if (request.num_done == 0) series_start_s_ = time_s_;
  check_is_countable(series_start_s_ + (request.num_done + request.num_steps) * request.dt_s,
                     run_.reference_ticks.tick_s);
  if (ball_needs_finer_ticks()) {
    forget_predictions();
    anchor_all(parcels);
  }
  ball_is_new_ = false;
  advance_steps(request, parcels, report);
  report.totals += invalid_;
  ball = ball_now();
}

}  // namespace pf
