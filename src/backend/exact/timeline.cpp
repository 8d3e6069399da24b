#include "backend/exact/timeline.hpp"

#include <algorithm>
#include <cmath>

#include "backend/exact/limits.hpp"
#include "backend/exact/positions_at.hpp"

namespace pf {
namespace {

// Measured at N = 10^5, area fraction 0.2.
constexpr double kCellWidth = 2.8;
constexpr double kWidestReach = 3.5;  // contact distances: parcels are sorted again beyond it

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
  present_ = trajectories.position;
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
  parcels.current.position = present_;
  for (ParcelArrays* arrays : {&parcels.current, &parcels.next}) {
    arrays->tick = {};
    arrays->last_contact_tick = {};
  }
  parcels.sorted = false;
  active_ = false;
}

// Exactly; of those that move at all.
double ExactTimeline::fastest_parcel_mps(const SortedParcels& parcels) const {
  float fastest2 = 0.0F;
  for (std::size_t i = 0; i < parcels.size(); ++i) {
    const Vec2f v = parcels.current.velocity[i];
    const float speed2 = dot(v, v);
    if (!is_retired(present_[i]) && speed2 < kMaxFiniteSpeed2) fastest2 = std::max(fastest2, speed2);
  }
  return std::sqrt(static_cast<double>(fastest2));
}

// And of the ball.
double ExactTimeline::fastest_mps(const Physics& physics, const SortedParcels& parcels) const {
  const double fastest = fastest_parcel_mps(parcels);
  return physics.ball.exists ? std::max(fastest, surface_speed_mps(physics, progress_.ball)) : fastest;
}

// base: constants in ticks of the reference speed.
void ExactTimeline::anchor_all(const ExactConstants& base, SortedParcels& parcels) {
  ParcelArrays& trajectories = parcels.current;
  trajectories.position = present_;
  const std::uint32_t before = progress_.tick_exponent;
  progress_.tick_exponent = choose_tick_exponent(base, before, fastest_mps(base.step.physics, parcels));
  progress_.preferred_ticks =
      std::ldexp(progress_.preferred_ticks, static_cast<int>(before) - static_cast<int>(progress_.tick_exponent));
  std::fill(trajectories.tick.begin(), trajectories.tick.end(),
            static_cast<std::uint32_t>(progress_.now >> progress_.tick_exponent));
  for (std::uint32_t& last_contact_tick : trajectories.last_contact_tick)
    last_contact_tick = contact_tick_in_units(last_contact_tick, progress_.now, before, progress_.tick_exponent);
}

void ExactTimeline::locate(const ExactConstants& c, const SortedParcels& parcels) {
  const ParcelArrays& trajectories = parcels.current;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    positions_at(c, trajectories.position.data(), trajectories.velocity.data(), trajectories.tick.data(), 0, begin, end,
                 present_.data());
  });
}

void ExactTimeline::sort_if_due(const ExactConstants& c, SortedParcels& parcels, StepReport& report) {
  if (!c.run.physics.parcels.contacts || parcels.size() == 0 || needs_all_pairs(c)) return;
  const double reach = c.run.contact_distance + 2.0 * progress_.fastest_mps * c.plan.units_per_tick * c.plan.length +
                       static_cast<double>(progress_.max_displacement);
  const bool moved = progress_.max_displacement > 0 && reach > kWidestReach * c.run.contact_distance;
  if (parcels.sorted && !moved) return;
  parcels.sort(team_, c.run.physics.world, kCellWidth * c.run.contact_distance, present_.data(),
               report.times);
  locate(c, parcels);
  progress_.max_displacement = 0;
  ++report.totals.num_sorts;
}

void ExactTimeline::one_step(const ExactConstants& base, std::uint64_t until, const StepRequest& request,
                           SortedParcels& parcels, StepReport& report) {
  StepInput problem;
  problem.constants = with_tick_exponent(base, progress_.tick_exponent);
  ExactConstants& c = problem.constants;
  problem.start_tick = progress_.now;
  problem.tick_exponent = progress_.tick_exponent;
  std::uint32_t longest = kAnchorPeriod;
  while (true) {
    plan_step(progress_, until, longest, c);
    sort_if_due(c, parcels, report);
    problem.present = present_.data();
    problem.cell_start = parcels.cell_start.data();
    problem.grid = parcels.grid;
    problem.all_pairs = request.neighbors == Neighbors::all_pairs || needs_all_pairs(c);
    problem.max_displacement = progress_.max_displacement;
    problem.fastest_mps = progress_.fastest_mps;
    ExactBall ball = ball_in_step(c, progress_);
    ScopedPhase timing(report.times, Phase::collide_integrate);
    const StepOutcome outcome =
        stepper_.step(problem, parcels.current, ball, end_position_.data(), request.events);
    report.totals.num_rounds += outcome.num_rounds;
    if (outcome.finished) {
      StepTotals totals = totals_of(c.run, outcome.tally);
      totals.event_hash = outcome.event_hash;
      report.totals += totals;
      end_step(c, ball, outcome.tally.ball, outcome.fastest_at_start_mps, outcome.fastest_mps,
               outcome.num_events, progress_);
      std::swap(present_, end_position_);
      if (is_at_anchoring(progress_)) anchor_all(base, parcels);
      return;
    }
    ++report.totals.num_retried_steps;
    if (outcome.needed_bound_mps > c.plan.max_speed_mps)
      progress_.raised_bound_mps = kSpeedMargin * outcome.needed_bound_mps;
    else if (c.plan.length > 1)
      longest = c.plan.length / 2;
    else
      throw_unresolvable(c.plan.tick_s);
  }
}

void ExactTimeline::advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels,
                          BallState& ball, StepReport& report) {
  const ExactConstants constants = make_exact_constants(physics, request.contact_clock_s);
  const double start_s = time_s_;
  check_is_countable(start_s + request.num_steps * request.dt_s, constants.tick_s);
  progress_.ball = ball;
  if (ball_is_new_ && progress_.tick_exponent != 0 && physics.ball.exists &&
      surface_speed_mps(physics, ball) > tick_speed_mps(constants, progress_.tick_exponent))
    anchor_all(constants, parcels);
  ball_is_new_ = false;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto until = static_cast<std::uint64_t>(std::llround(time_s_ / constants.tick_s));
    while (progress_.now < until) one_step(constants, until, request, parcels, report);
    ++report.totals.num_steps;
  }
  ball = progress_.ball;
}

std::uint64_t ExactTimeline::memory_bytes() const {
  return sizeof(Vec2i) * (present_.capacity() + end_position_.capacity()) + stepper_.memory_bytes();
}

}  // namespace pf
