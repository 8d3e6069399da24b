// Method `exact`: every parcel moves on a straight line from event to event. When two lines meet, and
// what an event does. Text for host and device.
//
// Time is counted in ticks, an integer. A line is anchored where and when its parcel's last event was and is
// evaluated from there, so an event's tick depends neither on the steps that the time was cut into nor on
// where the parcels lie in memory. Within a step, ticks count from the step's begin.
#pragma once

#include <cstdint>

#include "model/contact.hpp"
#include "model/time_step.hpp"

namespace pf {

constexpr std::uint32_t kNoTick = 0xFFFFFFFFU;  // no event before the end of the step

// What an event is with: a parcel (its index), or one of these, which order after all parcels at the same
// tick.
constexpr std::uint32_t kWallX = 0xFFFFFFF0U;
constexpr std::uint32_t kWallY = 0xFFFFFFF1U;
constexpr std::uint32_t kExit = 0xFFFFFFF2U;
constexpr std::uint32_t kBallPartner = 0xFFFFFFF3U;
constexpr std::uint32_t kNoPartner = 0xFFFFFFFFU;

PF_HD inline bool is_parcel(std::uint32_t partner) { return partner < kWallX; }

// Lines are anchored anew, all of them, when the tick is a multiple of this: fixed, so that it does not
// depend on the steps, and short enough for ages to fit 31 bits.
constexpr std::uint64_t kAnchorPeriod = 1ULL << 30U;

struct Line {
  Vec2i anchor;            // position units
  Vec2f velocity;          // m/s
  std::uint32_t tick = 0;  // when it was there, modulo 2^32
};

constexpr float kFiniteSpeed2 = 1e30F;  // (m/s)^2; speeds whose square is not below count as not finite

constexpr float kMeetingMargin = 1e-4F;

// Cheap first test, in float, of two parcels on the lines that they have at the step's begin: false only if
// they certainly do not meet before its end. offset: of their present positions, position units. Its margins
// are a hundred times what the roundings can be.
PF_HD inline bool may_meet(Vec2i offset, Vec2f relative_mps, float contact, float units_in_step_per_mps) {
  constexpr float kMargin = kMeetingMargin;
  const Vec2f e = {static_cast<float>(offset.x), static_cast<float>(offset.y)};
  const Vec2f w = {relative_mps.x * units_in_step_per_mps, relative_mps.y * units_in_step_per_mps};
  const float e2 = dot(e, e), w2 = dot(w, w), b = dot(e, w);
  const float slack = kMargin * (e2 + w2);
  if (b > slack) return false;
  const float contact2 = contact * contact;
  if (e2 - contact2 <= slack) return true;
  const float m = cross(e, w);
  if (m * m > contact2 * w2 * (1.0F + kMargin) + kMargin * e2 * w2) return false;
  return e2 + 2.0F * b + w2 <= contact2 + slack || -b <= w2 + slack;
}

// The ball within a step: a line as well, in double precision.
struct BallLine {
  Vec2d anchor_units;
  Vec2d velocity_mps;  // of the chord of its arc
  double spin_radps = 0.0;
  std::int32_t tick = 0;  // counted from the step's begin
};

enum class BallRole : std::uint8_t {
  absent,
  frozen,       // a moving wall; what parcels do to it is applied at the end of the step
  participant,  // its hits are events like any other
};

struct ExactConstants {
  StepConstants step;
  std::uint32_t begin = 0;   // tick of the step's begin, modulo 2^32
  std::uint32_t length = 0;  // ticks, at most kAnchorPeriod
  double tick_s = 0.0;
  double units_per_tick = 0.0;     // that a speed of 1 m/s covers
  double max_speed_mps = 0.0;      // assumed bound on every speed in the step, parcels and ball
  double least_parting_mps = 0.0;  // normal speed after an event at least: no event repeats in no time
  std::uint32_t clock_ticks = 0;   // contact duration of the TC model; 0: off
  double ball_contact = 0.0;       // R + r, position units
  BallRole ball = BallRole::absent;
};

// Length of a tick: the reference speed, rounded up to a power of two, covers an eighth of a position unit.
PF_HD inline double tick_seconds(const World& world, double reference_mps) {
  double power = 1.0;
  while (power < reference_mps) power *= 2.0;
  while (0.5 * power >= reference_mps) power *= 0.5;
  return world.unit_m / (8.0 * power);
}

// Ticks from the step's begin to the line's anchor; negative if that is older.
PF_HD inline std::int32_t anchor_time(const ExactConstants& c, const Line& line) {
  return static_cast<std::int32_t>(line.tick - c.begin);
}

PF_HD inline Vec2d travelled(const ExactConstants& c, Vec2d velocity_mps, std::int64_t ticks) {
  return velocity_mps * (c.units_per_tick * static_cast<double>(ticks));
}

PF_HD_RARE inline double far_image(double offset, std::int32_t half) {
  const double period = 2.0 * half;
  return offset - period * static_cast<double>(round_to_int64(offset / period));
}

PF_HD inline double nearest_image(double offset, std::int32_t half) {
  const double limit = half;
  if (offset < limit && offset > -limit) return offset;
  return far_image(offset, half);
}

template <Boundary kBoundary>
PF_HD inline Vec2d nearest_image(const World& world, Vec2d offset) {
  if constexpr (kBoundary != Boundary::periodic) return offset;
  return {nearest_image(offset.x, world.half.x), nearest_image(offset.y, world.half.y)};
}

// position, anywhere, as it is in a periodic world.
PF_HD_RARE inline std::int64_t wrapped(std::int64_t position, std::int32_t half) {
  const std::int64_t period = 2LL * half;
  std::int64_t offset = (position + half) % period;
  if (offset < 0) offset += period;
  return offset - half;
}

// An axis of a position after a move, brought back into a periodic world, into the walls.
template <Boundary kBoundary>
PF_HD inline std::int32_t settled(std::int64_t position, std::int32_t half, std::int32_t radius) {
  if constexpr (kBoundary == Boundary::periodic) {
    if (position >= half || position < -static_cast<std::int64_t>(half)) position = wrapped(position, half);
  } else {
    const std::int64_t limit = kBoundary == Boundary::walls ? static_cast<std::int64_t>(half) - radius
                                                            : static_cast<std::int64_t>(half);
    if (position > limit) return static_cast<std::int32_t>(limit);
    if (position < -limit) return static_cast<std::int32_t>(-limit);
  }
  return static_cast<std::int32_t>(position);
}

PF_HD inline std::int32_t wall_radius(const StepConstants& c) { return c.contact_reach / 2; }

// Where the line is at a tick of the step, rounded to position units.
template <Boundary kBoundary>
PF_HD inline Vec2i position_at(const ExactConstants& c, const Line& line, std::int32_t tick) {
  if (is_retired(line.anchor)) return line.anchor;
  const Vec2d moved =
      travelled(c, to_double(line.velocity), static_cast<std::int64_t>(tick) - anchor_time(c, line));
  const World& world = c.step.physics.world;
  const std::int32_t radius = wall_radius(c.step);
  return {settled<kBoundary>(line.anchor.x + round_to_int64(moved.x), world.half.x, radius),
          settled<kBoundary>(line.anchor.y + round_to_int64(moved.y), world.half.y, radius)};
}

// Where the line would have been at the step's begin: beyond a wall if that is where it comes from.
template <Boundary kBoundary>
PF_HD inline Vec2i line_begin(const ExactConstants& c, const Line& line) {
  if constexpr (kBoundary == Boundary::periodic) return position_at<kBoundary>(c, line, 0);
  const Vec2d moved =
      travelled(c, to_double(line.velocity), -static_cast<std::int64_t>(anchor_time(c, line)));
  return {static_cast<std::int32_t>(line.anchor.x + round_to_int64(moved.x)),
          static_cast<std::int32_t>(line.anchor.y + round_to_int64(moved.y))};
}

// The tick at which something that starts `from` and lasts `ticks` ends, as an event of the step.
PF_HD inline std::uint32_t event_tick(const ExactConstants& c, std::int32_t from, double ticks) {
  if (!(ticks < 4.0e9)) return kNoTick;
  const std::int64_t at = from + round_to_int64(ticks);
  if (at >= static_cast<std::int64_t>(c.length)) return kNoTick;
  return at < 0 ? 0U : static_cast<std::uint32_t>(at);
}

// Two bodies from the later of their anchors on: offset and relative velocity, position units and ticks.
struct Approach {
  Vec2d offset;    // second - first, at tick `from`
  Vec2d velocity;  // position units per tick
  std::int32_t from = 0;
};

// Of their nearest images: those at the step's begin, or at the later anchor if that is within the step.
template <Boundary kBoundary>
PF_HD inline Approach of_nearest_images(const ExactConstants& c, Vec2d offset, Vec2d velocity,
                                        std::int32_t from) {
  if constexpr (kBoundary == Boundary::periodic) {
    const Vec2d to_begin =
        from < 0 ? velocity * static_cast<double>(-static_cast<std::int64_t>(from)) : Vec2d{};
    offset = nearest_image<kBoundary>(c.step.physics.world, offset + to_begin) - to_begin;
  }
  return {offset, velocity, from};
}

// When they are `contact` apart, position units: tick of the step, or kNoTick.
PF_HD inline std::uint32_t contact_tick(const ExactConstants& c, const Approach& pair, double contact) {
  const double longest = static_cast<double>(c.length) - static_cast<double>(pair.from) + 1.0;
  const double t = time_of_impact(pair.offset, pair.velocity, contact, longest);
  return t < 0.0 ? kNoTick : event_tick(c, pair.from, t);
}

// When two parcels meet. The same whichever is given first: all is odd in them.
template <Boundary kBoundary>
PF_HD inline std::uint32_t meeting(const ExactConstants& c, const Line& a, const Line& b) {
  const std::int32_t time_a = anchor_time(c, a);
  const std::int32_t time_b = anchor_time(c, b);
  const std::int32_t from = time_a > time_b ? time_a : time_b;
  const Vec2d va = to_double(a.velocity), vb = to_double(b.velocity);
  Vec2d offset = to_double(b.anchor) - to_double(a.anchor);
  offset += travelled(c, vb, static_cast<std::int64_t>(from) - time_b);
  offset -= travelled(c, va, static_cast<std::int64_t>(from) - time_a);
  const Approach pair = of_nearest_images<kBoundary>(c, offset, (vb - va) * c.units_per_tick, from);
  return contact_tick(c, pair, c.step.contact_distance);
}

// When a parcel meets the ball.
template <Boundary kBoundary>
PF_HD inline std::uint32_t meeting_ball(const ExactConstants& c, const BallLine& ball, const Line& line) {
  const std::int32_t time = anchor_time(c, line);
  const std::int32_t from = time > ball.tick ? time : ball.tick;
  const Vec2d v = to_double(line.velocity);
  Vec2d offset = to_double(line.anchor) - ball.anchor_units;
  offset += travelled(c, v, static_cast<std::int64_t>(from) - time);
  offset -= travelled(c, ball.velocity_mps, static_cast<std::int64_t>(from) - ball.tick);
  const Approach pair =
      of_nearest_images<kBoundary>(c, offset, (v - ball.velocity_mps) * c.units_per_tick, from);
  return contact_tick(c, pair, c.ball_contact);
}

// An event as a parcel sees it. Of two, the one at the earlier tick comes first, then the lower partner id.
struct Event {
  std::uint32_t tick = kNoTick;
  std::uint32_t partner = kNoPartner;     // index, or one of the codes above
  std::uint32_t partner_id = kNoPartner;  // id, or the same code
};

PF_HD inline bool comes_before(const Event& a, const Event& b) {
  return a.tick < b.tick || (a.tick == b.tick && a.partner_id < b.partner_id);
}

PF_HD inline void keep_earlier(Event& best, const Event& other) {
  if (other.tick != kNoTick && comes_before(other, best)) best = other;
}

// Ticks from `from` until a coordinate that moves at `velocity` is at +limit or -limit, wherever it is going.
PF_HD inline std::uint32_t crossing(const ExactConstants& c, std::int32_t from, double coordinate,
                                    double velocity, double limit) {
  if (velocity == 0.0) return kNoTick;
  const double ticks = ((velocity > 0.0 ? limit : -limit) - coordinate) / velocity;
  return event_tick(c, from, ticks > 0.0 ? ticks : 0.0);
}

// The parcel's earliest event with the edge of the world: a wall, or its exit.
template <Boundary kBoundary>
PF_HD inline void keep_edge_event(const ExactConstants& c, const Line& line, Event& best) {
  if constexpr (kBoundary == Boundary::periodic) return;
  const World& world = c.step.physics.world;
  const bool walls = kBoundary == Boundary::walls;
  const std::int32_t radius = walls ? wall_radius(c.step) : 0;
  const std::int32_t from = anchor_time(c, line);
  const std::uint32_t x =
      crossing(c, from, line.anchor.x, line.velocity.x * c.units_per_tick, world.half.x - radius);
  const std::uint32_t y =
      crossing(c, from, line.anchor.y, line.velocity.y * c.units_per_tick, world.half.y - radius);
  keep_earlier(best, {x, walls ? kWallX : kExit, walls ? kWallX : kExit});
  keep_earlier(best, {y, walls ? kWallY : kExit, walls ? kWallY : kExit});
}

// When the ball meets a wall.
template <Boundary kBoundary>
PF_HD inline void keep_ball_edge_event(const ExactConstants& c, const BallLine& ball, Event& best) {
  if constexpr (kBoundary != Boundary::walls) return;
  const World& world = c.step.physics.world;
  const double radius = c.step.physics.ball.radius_m / world.unit_m;
  const Vec2d v = ball.velocity_mps * c.units_per_tick;
  keep_earlier(best,
               {crossing(c, ball.tick, ball.anchor_units.x, v.x, world.half.x - radius), kWallX, kWallX});
  keep_earlier(best,
               {crossing(c, ball.tick, ball.anchor_units.y, v.y, world.half.y - radius), kWallY, kWallY});
}

// Cheap first test: false only if the parcel certainly does not come to the edge within the step. present: at
// the step's begin. It moves at the assumed bound at most, whatever happens to it.
template <Boundary kBoundary>
PF_HD inline bool may_reach_edge(const ExactConstants& c, Vec2i present) {
  if constexpr (kBoundary == Boundary::periodic) return false;
  const World& world = c.step.physics.world;
  const float room = static_cast<float>(c.max_speed_mps * c.units_per_tick * c.length) * 1.001F +
                     static_cast<float>(wall_radius(c.step)) + 256.0F;
  const float x = static_cast<float>(present.x < 0 ? -present.x : present.x);
  const float y = static_cast<float>(present.y < 0 ? -present.y : present.y);
  return x + room >= static_cast<float>(world.half.x) || y + room >= static_cast<float>(world.half.y);
}

// Position units by which what is computed may differ from what is stored: two roundings of a position and
// one of a tick each.
constexpr double kRoundingMargin = 4.0;

PF_HD inline double speed_of(Vec2d v) { return sqrt(dot(v, v)); }

// Moves the anchor to a tick of the step.
template <Boundary kBoundary>
PF_HD inline void anchor_at(const ExactConstants& c, Line& line, std::uint32_t tick) {
  line.anchor = position_at<kBoundary>(c, line, static_cast<std::int32_t>(tick));
  line.tick = c.begin + tick;
}

// Two parcels, anchored at the tick of their event, exchange momentum along the line of their stored centres
// e: k = (1 + e) b / (2 |e|^2), v1 += k e, v2 -= k e. The normal is not normalised and all is double until
// the velocities are stored. elastic: no loss in this event (the TC model, Luding and McNamara 1998).
template <Boundary kBoundary, class Tally>
PF_HD inline void collide(const ExactConstants& c, Line& first, Line& second, bool elastic, Tally& tally) {
  Vec2d e =
      nearest_image<kBoundary>(c.step.physics.world, to_double(second.anchor) - to_double(first.anchor));
  if (e.x == 0.0 && e.y == 0.0) e = {1.0, 0.0};
  const Vec2d v1 = to_double(first.velocity), v2 = to_double(second.velocity);
  const double e2 = dot(e, e);
  const double distance = sqrt(e2);
  const double b = dot(e, v2 - v1);
  const double restitution = elastic ? 1.0 : c.step.physics.parcels.restitution;
  const double least = c.least_parting_mps * distance;
  const double parting = -restitution * b > least ? -restitution * b : least;
  const double k = (b - parting) / (2.0 * e2);
  first.velocity = to_float(v1 + e * k);
  second.velocity = to_float(v2 - e * k);
  tally.begin_contact();
  tally.impulse(impulse_counts(c.step, -k * distance));
  tally.overlap(static_cast<float>((c.step.contact_distance - distance) / c.step.contact_distance));
}

// A parcel, anchored at the tick of its event, hits the ball; returns the ball's change per parcel mass.
struct BallKick {
  Vec2d velocity_mps;  // times parcel mass / ball mass
  double spin_mps;     // times parcel mass * radius / inertia
};

template <Boundary kBoundary, class Tally>
PF_HD inline BallKick collide_with_ball(const ExactConstants& c, const BallLine& ball, std::uint32_t tick,
                                        Line& line, Tally& tally) {
  const Physics& physics = c.step.physics;
  const Vec2d centre =
      ball.anchor_units + travelled(c, ball.velocity_mps, static_cast<std::int64_t>(tick) - ball.tick);
  const Vec2d offset = nearest_image<kBoundary>(physics.world, to_double(line.anchor) - centre);
  const double distance = speed_of(offset);
  const Vec2d normal = distance > 0.0 ? offset * (1.0 / distance) : Vec2d{1.0, 0.0};
  const Vec2d relative = to_double(line.velocity) - ball.velocity_mps;
  BallImpulse impulse = ball_impulse(physics.ball, physics.parcels, normal, relative, ball.spin_radps);
  // What a change of the parcel does to the relative velocity: a participant recoils.
  const double recoil =
      c.ball == BallRole::participant ? 1.0 + physics.parcels.mass_kg / physics.ball.mass_kg : 1.0;
  const double parting = dot(relative + impulse.per_mass_mps * recoil, normal);
  if (parting < c.least_parting_mps)
    impulse.per_mass_mps += normal * ((c.least_parting_mps - parting) / recoil);
  line.velocity = to_float(to_double(line.velocity) + impulse.per_mass_mps);
  tally.ball_hit({round_to_int64(-impulse.per_mass_mps.x * c.step.per_impulse_unit),
                  round_to_int64(-impulse.per_mass_mps.y * c.step.per_impulse_unit),
                  round_to_int64(-impulse.tangential_mps * c.step.per_impulse_unit)});
  return {-impulse.per_mass_mps, -impulse.tangential_mps};
}

// A parcel, anchored at the tick of its event, at the edge of the world.
PF_HD inline void meet_edge(const ExactConstants& c, std::uint32_t partner, Line& line) {
  const World& world = c.step.physics.world;
  const std::int32_t radius = wall_radius(c.step);
  const auto reflect = [&](std::int32_t& position, float& velocity, std::int32_t half) {
    position = velocity > 0.0F ? half - radius : -(half - radius);
    velocity = -velocity;
  };
  if (partner == kWallX) reflect(line.anchor.x, line.velocity.x, world.half.x);
  if (partner == kWallY) reflect(line.anchor.y, line.velocity.y, world.half.y);
  if (partner == kExit) line.anchor = {kRetired, 0};
}

// One event's term of the hash of the event list: a sum over events, so that their order does not matter.
// tick: since the reset. With an edge or the ball as partner, first is the parcel.
PF_HD inline std::uint64_t event_hash(std::uint64_t tick, std::uint32_t first, std::uint32_t second) {
  return mix64(mix64(tick) ^ ((static_cast<std::uint64_t>(first) << 32U) | second));
}

}  // namespace pf
