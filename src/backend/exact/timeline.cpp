#include "backend/exact/timeline.hpp"

#include <algorithm>
#include <cmath>

#include "backend/exact/limits.hpp"
#include "backend/exact/positions_at.hpp"

namespace pf {
namespace {

// Hits that exceeded the bound tend to recur, so the bound decays slowly.
constexpr double kKeptOfBound = 0.98;
constexpr double kCellWidth = 2.8;  // contact distances. Measured at N = 10^5, area fraction 0.2.

ExactConstants constants_now(const RunConstants& run, const ExactProgress& progress) {
  return {run, plan_of_now(run, progress)};
}

}  // namespace

void ExactTimeline::reset_time() {
  active_ = false;
  is_mid_step_ = false;
  time_s_ = 0.0;
  progress_ = {};
  forget_predictions();
}

void ExactTimeline::enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels) {
  ParcelArrays& trajectories = parcels.current;
  run_ = make_run_constants(physics, contact_clock_s);
  progress_ = {};
  progress_.now = static_cast<std::uint64_t>(std::llround(time_s_ / run_.reference_ticks.tick_s));
  forget_predictions();
  current_positions_ = trajectories.position;
  current_is_valid_ = true;
  position_.resize(trajectories.position.size());
  const auto now = static_cast<std::uint32_t>(progress_.now);
  trajectories.tick.assign(parcels.size(), now);
  trajectories.last_contact_tick.assign(contact_clock_s > 0.0 ? parcels.size() : 0,
                                        now - static_cast<std::uint32_t>(kAnchorPeriod));
  for (std::size_t i = 0; i < parcels.size(); ++i)
    trajectories.velocity[i] = entering_velocity(trajectories.velocity[i]);
  parcels.sorted = false;
  active_ = true;
  progress_.fastest_mps = fastest_parcel_mps(parcels);
  window_length_.reset(static_cast<std::uint32_t>(parcels.size()));
  epoch_length_.reset();
}

void ExactTimeline::leave(SortedParcels& parcels) {
  parcels.current.position = positions(parcels);
  for (ParcelArrays* arrays : {&parcels.current, &parcels.next}) {
    arrays->tick = {};
    arrays->last_contact_tick = {};
  }
  parcels.sorted = false;
  active_ = false;
  is_mid_step_ = false;
  forget_predictions();
}

// ---- all parcels at once

void ExactTimeline::evaluate(const ExactConstants& c, const SortedParcels& parcels, std::int32_t tick,
                             std::vector<Vec2i>& position) const {
  const ParcelArrays& trajectories = parcels.current;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    positions_at(c, {trajectories.position.data(), trajectories.velocity.data(), trajectories.tick.data()},
                 tick, begin, end, position.data());
  });
}

const std::vector<Vec2i>& ExactTimeline::positions(const SortedParcels& parcels) {
  if (!current_is_valid_) {
    current_positions_.resize(parcels.current.position.size());
    evaluate(constants_now(run_, progress_), parcels, 0, current_positions_);
    current_is_valid_ = true;
  }
  return current_positions_;
}

// Returns exactly the largest speed of a parcel that has not retired and whose speed is finite.
double ExactTimeline::fastest_parcel_mps(const SortedParcels& parcels) {
  std::vector<float> fastest2(team_.size(), 0.0F);
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    float own2 = 0.0F;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec2f v = is_retired(parcels.current.position[i]) ? Vec2f{} : parcels.current.velocity[i];
      own2 = dot(v, v) < kMaxFiniteSpeed2 ? std::max(own2, dot(v, v)) : own2;
    }
    fastest2[thread] = own2;
  });
  return std::sqrt(static_cast<double>(*std::max_element(fastest2.begin(), fastest2.end())));
}

// The same with the ball's surface.
double ExactTimeline::fastest_mps(const Physics& physics, const SortedParcels& parcels) {
  const double fastest = fastest_parcel_mps(parcels);
  return physics.ball.exists ? std::max(fastest, surface_speed_mps(physics, progress_.ball)) : fastest;
}

// Called between epochs and chords.
void ExactTimeline::anchor_all(SortedParcels& parcels) {
  ParcelArrays& trajectories = parcels.current;
  trajectories.position = positions(parcels);
  const std::uint32_t before = progress_.tick_exponent;
  const double fastest = fastest_mps(run_.physics, parcels);
  const std::uint32_t after = choose_tick_exponent(run_.reference_ticks, before, fastest);
  progress_.tick_exponent = after;
  progress_.ball_trajectory_holds = false;
  window_length_.rescale(std::ldexp(1.0, static_cast<int>(before) - static_cast<int>(after)));
  const auto now = static_cast<std::uint32_t>(progress_.now >> after);
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    std::fill(trajectories.tick.data() + begin, trajectories.tick.data() + end, now);
    std::vector<std::uint32_t>& contact = trajectories.last_contact_tick;
    for (std::size_t i = begin; i < std::min(end, contact.size()); ++i)
      contact[i] = rescaled_contact_tick(contact[i], progress_.now, before, after);
  });
}

// ---- epochs

void ExactTimeline::begin_epoch(const StepRequest& request, SortedParcels& parcels, StepReport& report) {
  ExactProgress progress = progress_;
  if (chord_) progress.ball.velocity_mps = stepper_.ball().trajectory.velocity_mps;
  if (chord_) progress.ball.spin_radps = stepper_.ball().trajectory.spin_radps;
  epoch_.emplace(Epoch{{run_, plan_epoch(run_, progress, epoch_length_.length())}, {}});
  const ExactConstants& c = epoch_->constants;
  evaluate(c, parcels, 0, position_);
  if (run_.physics.parcels.contacts && parcels.size() > 0 && !needs_all_pairs(run_)) {
    const auto num = static_cast<std::uint32_t>(parcels.size());
    const GridShape grid = choose_grid(run_.physics.world, num, {kCellWidth * run_.contact_distance});
    parcels.sort(team_, grid, position_.data(), report.times);
    evaluate(c, parcels, 0, position_);
    current_is_valid_ = false;
    ++report.totals.num_sorts;
  }
  epoch_->input = {.position = position_.data(),
                   .cell_start = parcels.cell_start.data(),
                   .grid = parcels.grid,
                   .all_pairs = request.neighbors == Neighbors::all_pairs || needs_all_pairs(run_),
                   .fastest_mps = progress_.fastest_mps,
                   .start_tick = progress_.now,
                   .tick_exponent = progress_.tick_exponent};
  BallTrajectory ball = chord_ ? stepper_.ball().trajectory : BallTrajectory{};
  if (!chord_) ball.anchor_units = progress_.ball.position_m * (1.0 / run_.physics.world.unit_m);
  const CpuTally tally = stepper_.begin_epoch(epoch_->input, c, ball, parcels.current, report.times);
  invalid_.num_invalid = tally.num_invalid;
  invalid_.first_invalid_id = tally.first_invalid_id;
  progress_.fastest_mps = std::sqrt(static_cast<double>(tally.max_speed2));
  progress_.raised_bound_mps *= kKeptOfBound;
  if (chord_) predict_chord(parcels, report);
}

void ExactTimeline::end_epoch(SortedParcels& parcels) {
  if (epoch_->done == epoch_->constants.plan.length)
    epoch_length_.end(parcels.size());
  else
    epoch_length_.drop();
  if (chord_) stepper_.ball().trajectory.tick -= static_cast<std::int32_t>(epoch_->done);
  epoch_.reset();
  if (is_at_anchoring(progress_)) anchor_all(parcels);
}

// ---- the ball's chords

void ExactTimeline::begin_chord(std::uint64_t until, SortedParcels& parcels, StepReport& report) {
  chord_.emplace(Chord{plan_chord(run_, progress_, until), 0, {}});
  const ExactConstants c{run_, chord_->plan};
  ExactBall ball = ball_in_step(c, progress_);
  ball.trajectory.tick += static_cast<std::int32_t>(epoch_->done);
  stepper_.ball() = ball;
  predict_chord(parcels, report);
}

void ExactTimeline::predict_chord(SortedParcels& parcels, StepReport& report) {
  epoch_->constants.plan.ball = chord_->plan.ball;
  const WindowRequest request = window_request(epoch_->done, {});
  stepper_.begin_chord(epoch_->input, epoch_->constants, stepper_.ball(), request, parcels.current,
                       report.times);
}

void ExactTimeline::end_chord() {
  const ExactConstants c{run_, chord_->plan};
  ExactBall ball = stepper_.ball();
  ball.trajectory.tick -= static_cast<std::int32_t>(epoch_->done - chord_->plan.length);
  progress_.ball_trajectory_holds = false;  // that of a held ball is of a flight before
  if (!run_.physics.ball.held) finish_ball(c, ball, chord_->frozen_hits, progress_);
  chord_.reset();
}

// ---- windows

WindowRequest ExactTimeline::window_request(std::uint32_t end, const StepRequest& request) const {
  WindowRequest window{epoch_->done, end, 0, window_length_.max_cluster_events(), request.events};
  if (!chord_) return window;
  const std::uint32_t epoch_end = epoch_->constants.plan.length;
  const std::uint32_t chord_left = chord_->plan.length - chord_->done;
  const bool is_known =
      chord_->plan.ball == BallRole::participant && always_flies_straight(run_.physics.ball);
  window.ball_end = is_known || chord_left > epoch_end - epoch_->done ? epoch_end : epoch_->done + chord_left;
  return window;
}

void ExactTimeline::adopt_outcome(const WindowOutcome& outcome, std::uint32_t asked, StepReport& report) {
  const std::uint32_t length = outcome.end - epoch_->done;
  StepTotals totals = totals_of(run_, outcome.tally);
  totals.event_hash = outcome.event_hash;
  totals.num_events = outcome.result.num_events;
  report.totals += totals;
  progress_.fastest_mps = std::max(progress_.fastest_mps, outcome.result.fastest_after_mps);
  progress_.now += static_cast<std::uint64_t>(length) << progress_.tick_exponent;
  epoch_->done += length;
  current_is_valid_ = false;
  window_length_.learn(length, length < asked, outcome);
  epoch_length_.add_events(outcome.result.num_events);
  if (!chord_) return;
  chord_->done += length;
  chord_->frozen_hits += outcome.result.frozen_hits;
}

// After a window that did not finish: a new epoch with a higher bound on speeds if that was too low, else a
// shorter window.
void ExactTimeline::retry(const WindowOutcome& outcome, std::uint32_t length) {
  const StepPlan& plan = epoch_->constants.plan;
  if (outcome.needed_bound_mps > plan.max_speed_mps) {
    progress_.raised_bound_mps = kSpeedMargin * outcome.needed_bound_mps;
    if (chord_) stepper_.ball().trajectory.tick -= static_cast<std::int32_t>(epoch_->done);
    epoch_length_.drop();
    return epoch_.reset();
  }
  is_unresolvable_ = length == 1;
  window_length_.shorten(std::max(1U, outcome.failed_at - epoch_->done));
}

// Length of a window that should take at most left_ms, judging by the last one.
std::uint32_t ExactTimeline::choose_window(std::uint64_t until, double left_ms) const {
  constexpr double kWorthwhile_ms = 1.0;
  std::uint64_t limit = epoch_->constants.plan.length - epoch_->done;
  limit = std::min(limit, ticks_until(progress_, until));
  if (chord_) limit = std::min<std::uint64_t>(limit, chord_->plan.length - chord_->done);
  const std::uint32_t length = window_length_.choose(static_cast<std::uint32_t>(limit));
  const double affordable_ms = std::max(left_ms, kWorthwhile_ms);
  if (length * ms_per_tick_ <= affordable_ms) return length;
  return std::max(1U, static_cast<std::uint32_t>(affordable_ms / ms_per_tick_));
}

// Advances by one window, or retries it.
void ExactTimeline::advance_window(std::uint32_t length, const StepRequest& request, SortedParcels& parcels,
                                   StepReport& report) {
  const Clock::time_point start = Clock::now();
  const WindowOutcome outcome =
      stepper_.solve_window(epoch_->input, epoch_->constants, window_request(epoch_->done + length, request),
                            parcels.current, report.times);
  ms_per_tick_ = milliseconds_since(start) / (outcome.finished ? outcome.end - epoch_->done : length);
  report.totals.num_rounds += outcome.num_rounds;
  report.totals.num_solved_events += outcome.num_solved;
  report.totals.largest_cluster =
      std::max<std::uint64_t>(report.totals.largest_cluster, outcome.largest_cluster);
  if (!outcome.finished) {
    ++report.totals.num_retried_steps;
    return retry(outcome, length);
  }
  adopt_outcome(outcome, length, report);
  if (chord_ && chord_->done == chord_->plan.length) end_chord();
  if (epoch_->done == epoch_->constants.plan.length || is_at_anchoring(progress_)) end_epoch(parcels);
}

// Returns whether `until` was reached before the deadline. Always makes progress.
bool ExactTimeline::advance_until(std::uint64_t until, const StepRequest& request, const Deadline& deadline,
                                  SortedParcels& parcels, StepReport& report) {
  while (progress_.now < until && !is_unresolvable_) {
    if (!epoch_) {
      begin_epoch(request, parcels, report);
      if (deadline.has_passed()) break;
    }
    if (run_.physics.ball.exists && !chord_) begin_chord(until, parcels, report);
    advance_window(choose_window(until, deadline.left_ms()), request, parcels, report);
    if (deadline.has_passed()) break;
  }
  return progress_.now >= until;
}

std::uint64_t ExactTimeline::memory_bytes() const {
  return sizeof(Vec2i) * (position_.capacity() + current_positions_.capacity()) + stepper_.memory_bytes();
}

}  // namespace pf
