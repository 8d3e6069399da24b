// Set-up, the loop over events, and the change that each kind of event makes. Predictions:
// reference_predict.cpp.
#include "lab/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace pf {

Reference::Reference(const Physics& physics, const std::vector<ReferenceParcel>& parcels,
                     const BallState& ball, const ReferenceOptions& options)
    : physics_(physics),
      options_(options),
      contact_m_(2.0 * physics.parcels.radius_m),
      bodies_(parcels.size()),
      retired_(parcels.size()),
      last_contact_s_(parcels.size()),
      tree_(static_cast<std::uint32_t>(parcels.size()) + 1),
      ball_contact_m_(physics.ball.radius_m + physics.parcels.radius_m) {
  const Vec2d half_m = to_metres(physics.world, physics.world.half);
  axis_x_.half_m = half_m.x;
  axis_y_.half_m = half_m.y;
  if (physics.world.boundary == Boundary::periodic) side_m_ = half_m * 2.0;
  check();
  make_cells();
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].position = parcels[i].position_m;
    bodies_[i].velocity = parcels[i].velocity_mps;
    last_contact_s_[i] = parcels[i].last_event_s;
    retired_[i] = parcels[i].retired;
    if (!retired_[i]) place_in_cell(i);
  }
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    if (!retired_[i]) predict(i);
  }
  set_ball(ball);
}

void Reference::check() const {
  const ParcelConstants& p = physics_.parcels;
  if (bodies_.empty()) throw UserError("reference: air.num_parcels: 0 parcels; at least 1 is needed");
  if (!(p.restitution > 0.0 && p.restitution <= 1.0) || p.impulse_scale != 1.0) {
    throw UserError(
        fmt::format("reference: air.restitution {:g} and air.impulse_scale {:g}: allowed are (0, 1] and 1; "
                    "set them, or use another method",
                    p.restitution, p.impulse_scale));
  }
  if (!(options_.contact_clock_s >= 0.0)) {
    throw UserError(fmt::format("reference: contact duration {:g} s: it must be 0 (off) or positive",
                                options_.contact_clock_s));
  }
  const double smaller = 2.0 * std::min(axis_x_.half_m, axis_y_.half_m);
  const double widest = std::max(contact_m_, physics_.ball.exists ? ball_contact_m_ : 0.0);
  if (physics_.world.boundary == Boundary::periodic && smaller < 2.0 * widest * (1.0 + 1e-8)) {
    throw UserError(
        fmt::format("reference: the smaller side of the periodic world, {:g} m, is below two contact "
                    "distances of {:g} m; raise air.num_parcels or lower ball.radius_m",
                    smaller, widest));
  }
}

bool Reference::run_until(double time_s, std::vector<ReferenceEvent>* events, std::uint64_t max_events) {
  std::uint64_t num_done = 0;
  while (tree_.first().time_s <= time_s) {
    if (num_done == max_events) return false;
    const PredictedEvent event = tree_.first();
    now_ = event.time_s;
    if (is_stale(event)) {
      predict(event.owner);
    } else if (apply_event(event)) {
      ++num_done;
      if (events != nullptr) events->push_back(record_of(event));
    }
  }
  now_ = time_s;
  return true;
}

// The partner has changed its trajectory since the prediction.
bool Reference::is_stale(const PredictedEvent& event) const {
  if (event.owner == bodies_.size()) return false;
  const std::uint32_t predicted = bodies_[event.owner].partner_changes;
  if (event.partner == kPartnerBall) return ball_.num_changes != predicted;
  return event.partner < kFirstPartnerCode && bodies_[event.partner].num_changes != predicted;
}

// Returns whether the event is one of the physics; a change of cell is not.
bool Reference::apply_event(const PredictedEvent& event) {
  const bool along_x = event.partner == kPartnerWallX || event.partner == kPartnerCellX;
  const bool changes_cell = event.partner == kPartnerCellX || event.partner == kPartnerCellY;
  if (event.owner == bodies_.size()) {
    if (!changes_cell) reflect_ball(along_x);
    update_ball();
    return !changes_cell;
  }
  if (changes_cell) {
    move_to_next_cell(event.owner, along_x);
    predict(event.owner);
  } else if (event.partner == kPartnerExit) {
    retire(event.owner);
  } else if (event.partner == kPartnerBall) {
    collide_with_ball(event.owner);
  } else if (event.partner < kFirstPartnerCode) {
    collide(std::min(event.owner, event.partner), std::max(event.owner, event.partner));
  } else {
    reflect(event.owner, along_x);
  }
  return !changes_cell;
}

ReferenceEvent Reference::record_of(const PredictedEvent& event) const {
  using Kind = ReferenceEvent::Kind;
  switch (event.partner) {
    case kPartnerBall:
      return {event.time_s, Kind::ball, event.owner, 0};
    case kPartnerWallX:
      return {event.time_s, Kind::wall_x, event.owner, 0};
    case kPartnerWallY:
      return {event.time_s, Kind::wall_y, event.owner, 0};
    case kPartnerExit:
      return {event.time_s, Kind::exit, event.owner, 0};
    default:
      return {event.time_s, Kind::pair, std::min(event.owner, event.partner),
              std::max(event.owner, event.partner)};
  }
}

void Reference::advance(Body& body) const {
  body.position += body.velocity * (now_ - body.time_s);
  body.time_s = now_;
}

// i < j.
void Reference::collide(std::uint32_t i, std::uint32_t j) {
  Body& a = bodies_[i];
  Body& b = bodies_[j];
  advance(a);
  advance(b);
  const Vec2d offset = nearest_image(b.position - a.position);
  const double distance = length(offset);
  const double approach = dot(offset, b.velocity - a.velocity);
  if (approach < 0.0) {
    const double share = 0.5 * (1.0 + current_restitution(i, j)) * approach / (distance * distance);
    Vec2d kick = offset * share;
    a.velocity += kick;
    b.velocity -= kick;
    // Rounding may leave a grazing pair approaching: it would collide again at once, without end.
    for (int k = 0; k < 64 && dot(offset, b.velocity - a.velocity) < 0.0; ++k) {
      a.velocity += kick;
      b.velocity -= kick;
      kick = kick * 2.0;
    }
    totals_.impulse_sum_mps -= share * distance;
  }
  ++totals_.num_collisions;
  totals_.max_overlap_m = std::max(totals_.max_overlap_m, contact_m_ - distance);
  last_contact_s_[i] = last_contact_s_[j] = now_;
  ++a.num_changes;
  ++b.num_changes;
  predict(i);
  predict(j);
}

double Reference::current_restitution(std::uint32_t i, std::uint32_t j) const {
  const double since = now_ - std::max(last_contact_s_[i], last_contact_s_[j]);
  const bool lasting = options_.contact_clock_s > 0.0 && since <= options_.contact_clock_s;
  return lasting ? 1.0 : physics_.parcels.restitution;
}

void Reference::collide_with_ball(std::uint32_t i) {
  Body& body = bodies_[i];
  advance(body);
  const Vec2d ball_position = ball_.position + ball_.velocity * (now_ - ball_.time_s);
  const Vec2d offset = nearest_image(body.position - ball_position);
  const double distance = length(offset);
  if (dot(offset, body.velocity - ball_.velocity) < 0.0) exchange_with_ball(body, offset, distance);
  ++totals_.num_ball_hits;
  totals_.max_overlap_m = std::max(totals_.max_overlap_m, ball_contact_m_ - distance);
  ++body.num_changes;
  if (ball_is_free()) update_ball();
  predict(i);
}

// Exchanges momentum between an approaching parcel and the ball. offset: of the parcel from the ball.
void Reference::exchange_with_ball(Body& body, Vec2d offset, double distance) {
  const Vec2d relative = body.velocity - ball_.velocity;
  const Vec2d normal = offset * (1.0 / distance);
  const ParcelConstants& parcels = physics_.parcels;
  const BallImpulse impulse = ball_impulse(physics_.ball, parcels, normal, relative, ball_spin_);
  body.velocity += impulse.per_mass_mps;
  pending_impulse_ -= impulse.per_mass_mps;
  pending_tangential_ -= impulse.tangential_mps;
  totals_.ball_impulse_kg_mps -= impulse.per_mass_mps * parcels.mass_kg;
  totals_.ball_torque_impulse_kg_m2ps -= impulse.tangential_mps * parcels.mass_kg * physics_.ball.radius_m;
  if (ball_is_free()) apply_pending_impulses();
  double nudge = -dot(normal, relative) * 0x1p-52;  // as in collide()
  for (int k = 0; k < 64 && dot(offset, body.velocity - ball_.velocity) < 0.0; ++k, nudge *= 2.0) {
    body.velocity += normal * nudge;
  }
}

void Reference::apply_pending_impulses() {
  const BallConstants& ball = physics_.ball;
  advance(ball_);
  ball_.velocity += pending_impulse_ * (physics_.parcels.mass_kg / ball.mass_kg);
  ball_spin_ += pending_tangential_ * (physics_.parcels.mass_kg * ball.radius_m / ball.inertia_kg_m2);
  pending_impulse_ = {};
  pending_tangential_ = 0.0;
  ++ball_.num_changes;
}

void Reference::apply_ball_impulses() {
  if (physics_.ball.held) {
    pending_impulse_ = {};
    pending_tangential_ = 0.0;
    return;
  }
  apply_pending_impulses();
  BallState state = ball();
  apply_boundary_to_ball(physics_.world, physics_.ball.radius_m, state);
  set_ball(state);
}

void Reference::reflect(std::uint32_t i, bool along_x) {
  Body& body = bodies_[i];
  advance(body);
  double& v = along_x ? body.velocity.x : body.velocity.y;
  v = -v;
  last_contact_s_[i] = now_;
  ++body.num_changes;
  ++totals_.num_wall_hits;
  predict(i);
}

void Reference::reflect_ball(bool along_x) {
  advance(ball_);
  double& v = along_x ? ball_.velocity.x : ball_.velocity.y;
  v = -v;
  ++ball_.num_changes;
}

void Reference::retire(std::uint32_t i) {
  advance(bodies_[i]);
  leave_cell(i);
  retired_[i] = 1;
  ++bodies_[i].num_changes;
  ++totals_.num_exits;
  tree_.set({.owner = i});
}

Measures Reference::measure() const {
  Measures measures;
  const double mass = physics_.parcels.mass_kg;
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    const double speed2 = dot(bodies_[i].velocity, bodies_[i].velocity);
    measures.parcel_energy_j += 0.5 * mass * speed2;
    measures.momentum_kg_mps += bodies_[i].velocity * mass;
    measures.momentum_scale_kg_mps += mass * std::sqrt(speed2);
    measures.num_live += retired_[i] == 0;
  }
  add_ball(physics_.ball, ball(), measures);
  return measures;
}

std::vector<ReferenceParcel> Reference::parcels() const {
  std::vector<ReferenceParcel> result;
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    Body body = bodies_[i];
    if (!retired_[i]) advance(body);
    result.push_back({nearest_image(body.position), body.velocity, retired_[i] != 0, last_contact_s_[i]});
  }
  return result;
}

BallState Reference::ball() const {
  Body body = ball_;
  advance(body);
  return {nearest_image(body.position), body.velocity, ball_spin_, 0.0};
}

void Reference::set_ball(const BallState& ball) {
  ball_.position = ball.position_m;
  ball_.velocity = physics_.ball.held ? Vec2d{} : ball.velocity_mps;
  ball_.time_s = now_;
  ++ball_.num_changes;
  ball_spin_ = ball.spin_radps;
  update_ball();
}

std::vector<ReferenceParcel> reference_parcels(const World& world, const ParcelSnapshot& snapshot) {
  std::vector<ReferenceParcel> parcels;
  for (std::size_t i = 0; i < snapshot.position.size(); ++i) {
    const bool retired = is_retired(snapshot.position[i]);
    const Vec2d position_m = retired ? Vec2d{} : to_metres(world, snapshot.position[i]);
    parcels.push_back({position_m, to_double(snapshot.velocity[i]), retired});
  }
  return parcels;
}

}  // namespace pf
