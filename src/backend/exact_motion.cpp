#include "backend/exact_motion.hpp"

#include <algorithm>
#include <cmath>

namespace pf {
namespace {

// Measured at N = 10^5, as for the time-stepped methods.
constexpr double kCellWidth = 2.0;
constexpr double kLargestReach = 2.5;  // contact distances: parcels are sorted again beyond it

// Room for speeds to grow within a step: two parcels of equal speed cannot leave one of them with more than
// sqrt(2) times that.
constexpr double kSpeedMargin = 1.5;
constexpr double kLongestReach = 1.0e9;  // position units; a search box must stay within 32 bits

bool flies_straight(const BallConstants& ball, double spin_radps) {
  return ball.held || (ball.magnus_per_rad * spin_radps == 0.0 && ball.drag_per_m == 0.0);
}

}  // namespace

void ExactMotion::reset_time() {
  active_ = false;
  now_ = 0;
  time_s_ = 0.0;
  raised_bound_mps_ = 0.0;
  ball_follows_ = false;
}

void ExactMotion::enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels) {
  ParcelArrays& lines = parcels.current;
  const double tick_s = tick_seconds(physics.world, physics.reference_speed_mps);
  now_ = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
  present_ = lines.position;
  at_end_.resize(lines.position.size());
  lines.tick.assign(parcels.size(), static_cast<std::uint32_t>(now_));
  const auto long_ago = static_cast<std::uint32_t>(now_ - kAnchorPeriod);
  lines.clock.assign(contact_clock_s > 0.0 ? parcels.size() : 0, long_ago);
  parcels.sorted = false;
  ball_follows_ = false;
  active_ = true;
  float fastest2 = 0.0F;
  for (const Vec2f& v : lines.velocity) fastest2 = std::max(fastest2, dot(v, v));
  fastest_mps_ = std::sqrt(static_cast<double>(fastest2));
}

void ExactMotion::leave(SortedParcels& parcels) {
  parcels.current.position = present_;
  for (ParcelArrays* arrays : {&parcels.current, &parcels.next}) {
    arrays->tick = {};
    arrays->clock = {};
  }
  parcels.sorted = false;
  active_ = false;
}

void ExactMotion::anchor_all(SortedParcels& parcels) {
  ParcelArrays& lines = parcels.current;
  lines.position = present_;
  const auto now = static_cast<std::uint32_t>(now_);
  std::fill(lines.tick.begin(), lines.tick.end(), now);
  for (std::uint32_t& clock : lines.clock) {
    if (now - clock > kAnchorPeriod) clock = now - static_cast<std::uint32_t>(kAnchorPeriod);
  }
  ball_follows_ = false;
}

// The assumed bound must hold for whatever may come of present speeds and of a hit by the ball.
void ExactMotion::bound_speeds(ExactConstants& c, const Physics& physics, const BallState& ball) const {
  double fastest = std::max(fastest_mps_, 1e-3 * physics.reference_speed_mps);
  if (physics.ball.present) {
    const double surface =
        2.0 * speed_of(ball.velocity_mps) + std::fabs(ball.spin_radps) * physics.ball.radius_m;
    fastest = std::max(fastest, surface);
  }
  c.max_speed_mps = std::max(kSpeedMargin * fastest, raised_bound_mps_);
}

// Search boxes stay within 32 bits, and a periodic world is so wide that only nearest images can meet.
std::uint32_t ExactMotion::longest_step(const ExactConstants& c) const {
  const World& world = c.step.physics.world;
  double room = kLongestReach - static_cast<double>(travel_) - c.step.contact_distance;
  if (world.boundary == Boundary::periodic) {
    const double widest =
        std::max(c.step.contact_distance, c.ball == BallRole::absent ? 0.0 : c.ball_contact);
    room = std::min(room, std::min(world.half.x, world.half.y) - widest);
  }
  const double ticks = (room - 2.0 * kRoundingMargin) / (2.0 * c.max_speed_mps * c.units_per_tick);
  return static_cast<std::uint32_t>(std::clamp(ticks, 1.0, static_cast<double>(kAnchorPeriod)));
}

void ExactMotion::find_present(const ExactConstants& c, const SortedParcels& parcels) {
  const ParcelArrays& lines = parcels.current;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    for (std::size_t i = begin; i < end; ++i) {
      const Line line{lines.position[i], lines.velocity[i], lines.tick[i]};
      switch (c.step.physics.world.boundary) {
        case Boundary::walls:
          present_[i] = position_at<Boundary::walls>(c, line, 0);
          break;
        case Boundary::periodic:
          present_[i] = position_at<Boundary::periodic>(c, line, 0);
          break;
        default:
          present_[i] = position_at<Boundary::open>(c, line, 0);
      }
    }
  });
}

void ExactMotion::sort_if_due(const ExactConstants& c, SortedParcels& parcels, StepReport& report) {
  if (!c.step.physics.parcels.contacts || parcels.size() == 0) return;
  const double reach = c.step.contact_distance + 2.0 * fastest_mps_ * c.units_per_tick * c.length +
                       static_cast<double>(travel_);
  const bool moved = travel_ > 0 && reach > kLargestReach * c.step.contact_distance;
  if (parcels.sorted && !moved) return;
  parcels.sort(team_, c.step.physics.world, kCellWidth * c.step.contact_distance, present_.data(),
               report.times);
  find_present(c, parcels);
  travel_ = 0;
  ++report.totals.num_sorts;
}

ExactBall ExactMotion::ball_in_step(const ExactConstants& c, const BallState& ball) {
  const Physics& physics = c.step.physics;
  if (c.ball == BallRole::absent) return {};
  const double dt_s = c.length * c.tick_s;
  const bool straight = flies_straight(physics.ball, ball.spin_radps);
  if (!(straight && ball_follows_)) {
    const BallFlight flight = fly(physics.ball, ball, dt_s);
    ball_line_.anchor_units = ball.position_m * (1.0 / physics.world.unit_m);
    ball_line_.velocity_mps = straight ? ball.velocity_mps : flight.displacement_m * (1.0 / dt_s);
    if (physics.ball.held) ball_line_.velocity_mps = {};
    ball_line_.spin_radps = ball.spin_radps;
    ball_line_.tick = 0;
    return {ball_line_, straight ? ball_line_.velocity_mps : flight.velocity_mps};
  }
  return {ball_line_, ball.velocity_mps};
}

// The step is done: the time, the ball and what is known of the parcels move on.
void ExactMotion::end_step(const ExactConstants& c, const ExactBall& ball, SortedParcels& parcels,
                           BallState& state) {
  now_ += c.length;
  std::swap(present_, at_end_);
  const Physics& physics = c.step.physics;
  if (c.ball != BallRole::absent && !physics.ball.held) {
    const BallLine& line = ball.line;
    const std::int64_t flown = static_cast<std::int64_t>(c.length) - line.tick;
    state.position_m = (line.anchor_units + travelled(c, line.velocity_mps, flown)) * physics.world.unit_m;
    state.velocity_mps = ball.end_velocity_mps;
    state.spin_radps = line.spin_radps;
    state.angle_rad += state.spin_radps * c.length * c.tick_s;
    ball_line_ = line;
    ball_line_.tick -= static_cast<std::int32_t>(c.length);
    const Vec2d position = state.position_m;
    apply_boundary_to_ball(physics.world, physics.ball.radius_m, state);
    ball_follows_ = flies_straight(physics.ball, state.spin_radps) && c.ball == BallRole::participant &&
                    position == state.position_m;
  }
  if (now_ % kAnchorPeriod == 0) anchor_all(parcels);
}

void ExactMotion::one_step(const ExactConstants& constants, std::uint64_t until, const StepRequest& request,
                           SortedParcels& parcels, BallState& ball, StepReport& report) {
  const Physics& physics = constants.step.physics;
  ExactStepper::Problem problem;
  problem.constants = constants;
  ExactConstants& c = problem.constants;
  c.begin = static_cast<std::uint32_t>(now_);
  const std::uint64_t to_anchoring = kAnchorPeriod - now_ % kAnchorPeriod;
  c.length = static_cast<std::uint32_t>(std::min(until - now_, to_anchoring));
  while (true) {
    c.ball = ball_role(physics, ball, c.length * c.tick_s);
    bound_speeds(c, physics, ball);
    c.length = std::min(c.length, longest_step(c));
    sort_if_due(c, parcels, report);
    problem.space = {present_.data(),
                     parcels.cell_start.data(),
                     parcels.grid,
                     physics.world,
                     static_cast<std::uint32_t>(parcels.size()),
                     0,
                     0.0F,
                     request.neighbors == Neighbors::all_pairs};
    problem.travel = travel_;
    problem.fastest_mps = fastest_mps_;
    problem.begin_tick = now_;
    ExactBall in_step = ball_in_step(c, ball);
    ScopedPhase timing(report.times, Phase::collide_integrate);
    const ExactOutcome outcome =
        stepper_.step(problem, parcels.current, in_step, at_end_.data(), request.events);
    report.totals.num_rounds += outcome.num_rounds;
    if (outcome.finished) {
      const double fastest = std::max(fastest_mps_, outcome.fastest_mps);
      travel_ += static_cast<std::int64_t>(std::ceil(fastest * c.units_per_tick * c.length)) + 2;
      fastest_mps_ = std::max(outcome.fastest_at_begin_mps, outcome.fastest_mps);
      raised_bound_mps_ = 0.0;
      StepTotals totals = totals_of(c.step, outcome.tally);
      totals.event_hash = outcome.event_hash;
      report.totals += totals;
      end_step(c, in_step, parcels, ball);
      return;
    }
    ++report.totals.num_redone_steps;
    if (outcome.needed_bound_mps > c.max_speed_mps)
      raised_bound_mps_ = kSpeedMargin * outcome.needed_bound_mps;
    c.length = std::max(1U, c.length / 2);
  }
}

void ExactMotion::advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels,
                          BallState& ball, StepReport& report) {
  const ExactConstants constants = make_exact_constants(physics, request.contact_clock_s);
  const double start_s = time_s_;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto until = static_cast<std::uint64_t>(std::llround(time_s_ / constants.tick_s));
    while (now_ < until) one_step(constants, until, request, parcels, ball, report);
    ++report.totals.num_steps;
  }
}

std::uint64_t ExactMotion::memory_bytes() const {
  return sizeof(Vec2i) * (present_.capacity() + at_end_.capacity()) + stepper_.memory_bytes();
}

}  // namespace pf
