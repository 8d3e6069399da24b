#include "backend/exact/timeline.hpp"

#include <algorithm>
#include <cmath>

#include "backend/exact/limits.hpp"
#include "backend/exact/positions_at.hpp"

namespace pf {
namespace {

// Contact distances. Measured at N = 10^5, area fraction 0.2.
constexpr double kCellWidth = 2.8;
constexpr double kSortReach = 3.5;  // parcels are sorted again when search boxes become wider

}  // namespace

void ExactTimeline::reset_time() {
  active_ = false;
  time_s_ = 0.0;
  progress_ = {};
}

void ExactTimeline::enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels) {
  ParcelArrays& trajectories = parcels.current;
  const double tick_s = tick_seconds(physics.world, physics.reference_speed_mps);
  progress_ = {};
  progress_.now = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
  position_ = trajectories.position;
  end_position_.resize(trajectories.position.size());
  const auto now = static_cast<std::uint32_t>(progress_.now);
  trajectories.tick.assign(parcels.size(), now);
  trajectories.last_contact_tick.assign(contact_clock_s > 0.0 ? parcels.size() : 0,
                                        now - static_cast<std::uint32_t>(kAnchorPeriod));
  parcels.sorted = false;
  active_ = true;
  progress_.fastest_mps = fastest_parcel_mps(parcels);
}

void ExactTimeline::leave(SortedParcels& parcels) {
  parcels.current.position = position_;
  for (ParcelArrays* arrays : {&parcels.current, &parcels.next}) {
    arrays->tick = {};
    arrays->last_contact_tick = {};
  }
  parcels.sorted = false;
  active_ = false;
}

// Returns exactly the largest speed of a parcel that has not retired and whose speed is finite.
double ExactTimeline::fastest_parcel_mps(const SortedParcels& parcels) const {
  float fastest2 = 0.0F;
  for (std::size_t i = 0; i < parcels.size(); ++i) {
    const Vec2f v = parcels.current.velocity[i];
    const float speed2 = dot(v, v);
    if (!is_retired(position_[i]) && speed2 < kMaxFiniteSpeed2) fastest2 = std::max(fastest2, speed2);
  }
  return std::sqrt(static_cast<double>(fastest2));
}

// The same with the ball's surface.
double ExactTimeline::fastest_mps(const Physics& physics, const SortedParcels& parcels) const {
  const double fastest = fastest_parcel_mps(parcels);
  return physics.ball.exists ? std::max(fastest, surface_speed_mps(physics, progress_.ball)) : fastest;
}

void ExactTimeline::anchor_all(const RunConstants& run, SortedParcels& parcels) {
  ParcelArrays& trajectories = parcels.current;
  trajectories.position = position_;
  const std::uint32_t before = progress_.tick_exponent;
  const std::uint32_t after =
      choose_tick_exponent(run.reference_ticks, before, fastest_mps(run.physics, parcels));
  progress_.tick_exponent = after;
  progress_.preferred_ticks =
      std::ldexp(progress_.preferred_ticks, static_cast<int>(before) - static_cast<int>(after));
  std::fill(trajectories.tick.begin(), trajectories.tick.end(),
            static_cast<std::uint32_t>(progress_.now >> after));
  for (std::uint32_t& tick : trajectories.last_contact_tick)
    tick = rescaled_contact_tick(tick, progress_.now, before, after);
}

// Sets the current positions: those at the step's start.
void ExactTimeline::locate(const ExactConstants& c, const SortedParcels& parcels) {
  const ParcelArrays& trajectories = parcels.current;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    positions_at(c, {trajectories.position.data(), trajectories.velocity.data(), trajectories.tick.data()}, 0,
                 begin, end, position_.data());
  });
}

void ExactTimeline::sort_if_due(const ExactConstants& c, SortedParcels& parcels, StepReport& report) {
  if (!c.run.physics.parcels.contacts || parcels.size() == 0 || needs_all_pairs(c.run)) return;
  const double contact = c.run.contact_distance;
  const double reach = contact + 2.0 * progress_.fastest_mps * c.plan.units_per_tick * c.plan.length +
                       static_cast<double>(progress_.max_displacement);
  const bool is_wide = progress_.max_displacement > 0 && reach > kSortReach * contact;
  if (parcels.sorted && !is_wide) return;
  parcels.sort(team_, c.run.physics.world, kCellWidth * contact, position_.data(), report.times);
  locate(c, parcels);
  progress_.max_displacement = 0;
  ++report.totals.num_sorts;
}

StepInput ExactTimeline::step_input(const ExactConstants& c, Neighbors neighbors,
                                    const SortedParcels& parcels) const {
  return {.constants = c,
          .position = position_.data(),
          .cell_start = parcels.cell_start.data(),
          .grid = parcels.grid,
          .all_pairs = neighbors == Neighbors::all_pairs || needs_all_pairs(c.run),
          .max_displacement = progress_.max_displacement,
          .fastest_mps = progress_.fastest_mps,
          .start_tick = progress_.now,
          .tick_exponent = progress_.tick_exponent};
}

// After a step that did not finish: raises the bound on speeds if that was too low, else returns a lower
// limit of the step's length.
std::uint32_t ExactTimeline::plan_retry(const StepPlan& failed, const StepOutcome& outcome,
                                        std::uint32_t max_ticks) {
  if (outcome.needed_bound_mps > failed.max_speed_mps) {
    progress_.raised_bound_mps = kSpeedMargin * outcome.needed_bound_mps;
    return max_ticks;
  }
  if (failed.length == 1) throw_unresolvable(failed.tick_s);
  return failed.length / 2;
}

void ExactTimeline::finish_step(const ExactConstants& c, const ExactBall& ball, const StepOutcome& outcome,
                                StepReport& report) {
  StepTotals totals = totals_of(c.run, outcome.tally);
  totals.event_hash = outcome.event_hash;
  report.totals += totals;
  advance_progress(c, ball, outcome.result, progress_);
  std::swap(position_, end_position_);
}

// Advances by one step, which ends in the tick of `until` or before it.
void ExactTimeline::advance_step(const RunConstants& run, std::uint64_t until, const StepRequest& request,
                                 SortedParcels& parcels, StepReport& report) {
  std::uint32_t max_ticks = kAnchorPeriod;
  while (true) {
    const ExactConstants c{run, plan_step(run, progress_, until, max_ticks)};
    sort_if_due(c, parcels, report);
    ExactBall ball = ball_in_step(c, progress_);
    const StepTarget target{parcels.current, ball, end_position_.data(), request.events};
    const StepOutcome outcome =
        stepper_.step(step_input(c, request.neighbors, parcels), target, report.times);
    report.totals.num_rounds += outcome.num_rounds;
    if (outcome.finished) {
      finish_step(c, ball, outcome, report);
      if (is_at_anchoring(progress_)) anchor_all(run, parcels);
      return;
    }
    ++report.totals.num_retried_steps;
    max_ticks = plan_retry(c.plan, outcome, max_ticks);
  }
}

// Returns whether the ball was set in motion from outside, too fast for the ticks of a gas that has cooled.
bool ExactTimeline::ball_needs_finer_ticks(const RunConstants& run) const {
  if (!ball_is_new_ || progress_.tick_exponent == 0 || !run.physics.ball.exists) return false;
  return surface_speed_mps(run.physics, progress_.ball) >
         tick_speed_mps(run.reference_ticks, progress_.tick_exponent);
}

void ExactTimeline::advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels,
                            BallState& ball, StepReport& report) {
  const RunConstants run = make_run_constants(physics, request.contact_clock_s);
  const double tick_s = run.reference_ticks.tick_s;
  const double start_s = time_s_;
  check_is_countable(start_s + request.num_steps * request.dt_s, tick_s);
  progress_.ball = ball;
  if (ball_needs_finer_ticks(run)) anchor_all(run, parcels);
  ball_is_new_ = false;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto until = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
    while (progress_.now < until) advance_step(run, until, request, parcels, report);
    ++report.totals.num_steps;
  }
  ball = progress_.ball;
}

std::uint64_t ExactTimeline::memory_bytes() const {
  return sizeof(Vec2i) * (position_.capacity() + end_position_.capacity()) + stepper_.memory_bytes();
}

}  // namespace pf
