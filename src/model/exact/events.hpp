// Method `exact`: events, their order in time, and events at the edge of the world. Host and device code.
#pragma once

#include <cstdint>

#include "core/random.hpp"
#include "model/exact/trajectory.hpp"

namespace pf {

constexpr std::uint32_t kNoTick = 0xFFFFFFFFU;  // no event before the end of the step

// Partner of an event: a parcel's index, or one of these codes, which order after all parcels at the same
// tick.
constexpr std::uint32_t kWallX = 0xFFFFFFF0U;
constexpr std::uint32_t kWallY = 0xFFFFFFF1U;
constexpr std::uint32_t kExit = 0xFFFFFFF2U;
constexpr std::uint32_t kBallPartner = 0xFFFFFFF3U;
constexpr std::uint32_t kNoPartner = 0xFFFFFFFFU;

PF_HD inline bool is_parcel(std::uint32_t partner) { return partner < kWallX; }

// An event as one of its parcels sees it.
struct Event {
  std::uint32_t tick = kNoTick;
  std::uint32_t partner = kNoPartner;     // index, or one of the codes above
  std::uint32_t partner_id = kNoPartner;  // id, or the same code
  std::uint32_t generation = 0;
};

// The earlier tick comes first; of one tick, the lower generation; of one generation, the lower partner id.
PF_HD inline bool comes_before(const Event& a, const Event& b) {
  const std::uint64_t at_a = static_cast<std::uint64_t>(a.tick) << 32U | a.generation;
  const std::uint64_t at_b = static_cast<std::uint64_t>(b.tick) << 32U | b.generation;
  return at_a != at_b ? at_a < at_b : a.partner_id < b.partner_id;
}

// The place of an event in the order of all: by tick, generation, lower id and higher id of its bodies.
struct EventOrder {
  std::uint32_t tick = kNoTick, generation = kNoTick, low_id = kNoPartner, high_id = kNoPartner;
};

PF_HD inline bool comes_before(const EventOrder& a, const EventOrder& b) {
  if (a.tick != b.tick) return a.tick < b.tick;
  if (a.generation != b.generation) return a.generation < b.generation;
  if (a.low_id != b.low_id) return a.low_id < b.low_id;
  return a.high_id < b.high_id;
}

// Returns whether a collision happens while both bodies are on their trajectories, which end at these ticks.
PF_HD inline bool happens_on_both(std::uint32_t tick, std::uint32_t first_end, std::uint32_t second_end) {
  return tick != kNoTick && tick <= (first_end < second_end ? first_end : second_end);
}

// An event at the same tick as one that led to it is of the next generation. So the order of events is known
// before they happen: none comes before its cause. Returns the generation of a body's event at `tick`.
// anchor: tick of the body's trajectory. next_generation: 1 + that of the event which led to it, or 0 if that
// has an earlier tick.
PF_HD inline std::uint32_t generation_at(std::uint32_t tick, std::int32_t anchor,
                                         std::uint32_t next_generation) {
  return static_cast<std::uint32_t>(anchor) == tick ? next_generation : 0U;
}

PF_HD inline void keep_earlier(Event& best, const Event& other) {
  if (other.tick != kNoTick && comes_before(other, best)) best = other;
}

// Tick of the event that lies `ticks` after `from`; kNoTick if the step ends before it.
PF_HD inline std::uint32_t event_tick(const StepPlan& plan, std::int32_t from, double ticks) {
  if (!(ticks < 4.0e9)) return kNoTick;
  const std::int64_t at = from + round_to_int64(ticks);
  if (at >= static_cast<std::int64_t>(plan.length)) return kNoTick;
  return at < 0 ? 0U : static_cast<std::uint32_t>(at);
}

// Tick at which a coordinate that moves at `velocity`, units per tick, reaches the limit that it moves
// towards.
PF_HD inline std::uint32_t edge_tick(const StepPlan& plan, std::int32_t from, double coordinate,
                                     double velocity, double limit) {
  if (velocity == 0.0) return kNoTick;
  const double ticks = ((velocity > 0.0 ? limit : -limit) - coordinate) / velocity;
  return event_tick(plan, from, ticks > 0.0 ? ticks : 0.0);
}

// Replaces `best` if the parcel reaches a wall, or the edge of an open world, before it.
template <Boundary kBoundary>
PF_HD inline void keep_edge_event(const ExactConstants& c, const Trajectory& trajectory, Event& best) {
  if constexpr (kBoundary == Boundary::periodic) return;
  const World& world = c.run.physics.world;
  const bool walls = kBoundary == Boundary::walls;
  const std::int32_t radius = walls ? wall_radius(c.run) : 0;
  const std::int32_t from = anchor_time(c.plan, trajectory);
  const std::uint32_t x = edge_tick(c.plan, from, trajectory.anchor.x,
                                    trajectory.velocity.x * c.plan.units_per_tick, world.half.x - radius);
  const std::uint32_t y = edge_tick(c.plan, from, trajectory.anchor.y,
                                    trajectory.velocity.y * c.plan.units_per_tick, world.half.y - radius);
  keep_earlier(best, {x, walls ? kWallX : kExit, walls ? kWallX : kExit});
  keep_earlier(best, {y, walls ? kWallY : kExit, walls ? kWallY : kExit});
}

// Replaces `best` if the ball reaches a wall before it.
template <Boundary kBoundary>
PF_HD inline void keep_ball_edge_event(const ExactConstants& c, const BallTrajectory& ball, Event& best) {
  if constexpr (kBoundary != Boundary::walls) return;
  const World& world = c.run.physics.world;
  const double radius = c.run.physics.ball.radius_m / world.unit_m;
  const Vec2d v = ball.velocity_mps * c.plan.units_per_tick;
  const auto keep = [&](double coordinate, double velocity, std::int32_t half, std::uint32_t wall) {
    keep_earlier(best, {edge_tick(c.plan, ball.tick, coordinate, velocity, half - radius), wall, wall});
  };
  keep(ball.anchor_units.x, v.x, world.half.x, kWallX);
  keep(ball.anchor_units.y, v.y, world.half.y, kWallY);
}

// Conservative first test: false only if the parcel cannot reach the edge within the step, whatever happens
// to it, at the assumed bound on speeds. position: at the step's start; a retired parcel reaches no edge.
template <Boundary kBoundary>
PF_HD inline bool may_reach_edge(const ExactConstants& c, Vec2i position) {
  if (kBoundary == Boundary::periodic || is_retired(position)) return false;
  const World& world = c.run.physics.world;
  const float room =
      static_cast<float>(c.plan.max_speed_mps * c.plan.units_per_tick * c.plan.length) * 1.001F +
      static_cast<float>(wall_radius(c.run)) + 256.0F;
  const float x = static_cast<float>(position.x < 0 ? -position.x : position.x);
  const float y = static_cast<float>(position.y < 0 ? -position.y : position.y);
  return x + room >= static_cast<float>(world.half.x) || y + room >= static_cast<float>(world.half.y);
}

// Reflects a parcel that is anchored at the tick of its event at a wall, or retires it at the exit.
PF_HD inline void apply_edge(const ExactConstants& c, std::uint32_t partner, Trajectory& trajectory) {
  const World& world = c.run.physics.world;
  const std::int32_t radius = wall_radius(c.run);
  const auto reflect = [&](std::int32_t& position, float& velocity, std::int32_t half) {
    position = velocity > 0.0F ? half - radius : -(half - radius);
    velocity = -velocity;
  };
  if (partner == kWallX) reflect(trajectory.anchor.x, trajectory.velocity.x, world.half.x);
  if (partner == kWallY) reflect(trajectory.anchor.y, trajectory.velocity.y, world.half.y);
  if (partner == kExit) trajectory.anchor = {kRetired, 0};
}

// One event's term of the hash of all events. The hash is a sum, so that order does not matter. tick: since
// the reset. With an edge or the ball as partner, `first` is the parcel.
PF_HD inline std::uint64_t event_hash(std::uint64_t tick, std::uint32_t first, std::uint32_t second) {
  return mix64(mix64(tick) ^ ((static_cast<std::uint64_t>(first) << 32U) | second));
}

}  // namespace pf
