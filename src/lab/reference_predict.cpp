// Cells, and the prediction of each body's next event.
#include <algorithm>
#include <cmath>

#include "core/index.hpp"
#include "lab/reference.hpp"

namespace pf {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Time until |offset + velocity t| falls to distance. Bodies that touch or overlap collide at once if and
// only if they approach. The result is the same for (-offset, -velocity), to the last bit.
double time_to_contact(Vec2d offset, Vec2d velocity, double distance) {
  const double approach = dot(offset, velocity);
  if (!(approach < 0.0)) return kNever;
  const double gap2 = dot(offset, offset) - distance * distance;
  if (gap2 <= 0.0) return 0.0;
  const double moment = cross(offset, velocity);
  const double discriminant = distance * distance * dot(velocity, velocity) - moment * moment;
  if (discriminant < 0.0) return kNever;
  return gap2 / (std::sqrt(discriminant) - approach);
}

// Time of the contact of two bodies, of which offset and velocity hold at base_s. If rounding puts it before
// now_s, it is now_s while the bodies still approach, otherwise never.
double contact_time(Vec2d offset, Vec2d velocity, double distance, double base_s, double now_s) {
  const double time_s = base_s + time_to_contact(offset, velocity, distance);
  if (time_s >= now_s) return time_s;
  return dot(offset + velocity * (now_s - base_s), velocity) < 0.0 ? now_s : kNever;
}

void keep_earlier(const PredictedEvent& candidate, PredictedEvent& earliest) {
  if (happens_before(candidate, earliest)) earliest = candidate;
}

// The cell of a coordinate; the outer cells reach to infinity.
std::uint32_t cell_at(const CellAxis& axis, double x) {
  const double cell = std::floor((x + axis.half_m) / axis.cell_m);
  return static_cast<std::uint32_t>(std::clamp(cell, 0.0, axis.num_cells - 1.0));
}

struct CellRange {
  std::int64_t first, count;
};

// Cells along an axis that reach within `reach` of x.
CellRange cells_within(const CellAxis& axis, double x, double reach, bool periodic) {
  const double low = std::floor((x - reach + axis.half_m) / axis.cell_m);
  const double high = std::floor((x + reach + axis.half_m) / axis.cell_m);
  const double last = axis.num_cells - 1.0;
  if (periodic && high - low >= last) return {0, axis.num_cells};
  if (periodic) return {static_cast<std::int64_t>(low), static_cast<std::int64_t>(high - low) + 1};
  if (high < 0.0 || low > last) return {0, 0};
  const double from = std::max(low, 0.0);
  return {static_cast<std::int64_t>(from), static_cast<std::int64_t>(std::min(high, last) - from) + 1};
}

std::uint32_t wrapped(std::int64_t cell, std::uint32_t num) {
  const std::int64_t rest = cell % num;
  return static_cast<std::uint32_t>(rest < 0 ? rest + num : rest);
}

}  // namespace

// The offset to the nearest image; in a world without images the offset itself.
Vec2d Reference::nearest_image(Vec2d offset) const {
  if (side_m_.x == 0.0) return offset;
  return {offset.x - side_m_.x * std::nearbyint(offset.x / side_m_.x),
          offset.y - side_m_.y * std::nearbyint(offset.y / side_m_.y)};
}

// A cell is wider than a diameter, so that partners are in neighbouring cells. Cells narrower than the mean
// spacing make parcels change cells more often than they collide; wider ones hold more partners to test. 0.7
// of the spacing was the fastest of 0.7 to 1.4 at area fraction 0.2. A periodic world has at least two cells
// per axis, see predict_ball_hit().
void Reference::make_cells() {
  const double spacing =
      std::sqrt(4.0 * axis_x_.half_m * axis_y_.half_m / static_cast<double>(bodies_.size()));
  const double width = std::max(contact_m_ * (1.0 + 1e-9), 0.7 * spacing);
  const std::uint32_t min_num = side_m_.x > 0.0 ? 2 : 1;
  zone_margin_m_ = kNever;
  for (CellAxis* axis : {&axis_x_, &axis_y_}) {
    axis->num_cells = std::max(min_num, static_cast<std::uint32_t>(2.0 * axis->half_m / width));
    axis->cell_m = 2.0 * axis->half_m / axis->num_cells;
    zone_margin_m_ = std::min({zone_margin_m_, 3.0 * axis->cell_m, 0.25 * axis->half_m});
  }
  cell_head_.assign(static_cast<std::size_t>(axis_x_.num_cells) * axis_y_.num_cells, kInvalidIndex);
  in_zone_.assign(cell_head_.size(), 0);
}

void Reference::place_in_cell(std::uint32_t i) {
  Body& body = bodies_[i];
  body.cell_x = cell_at(axis_x_, body.position.x);
  body.cell_y = cell_at(axis_y_, body.position.y);
  enter_cell(i);
}

void Reference::enter_cell(std::uint32_t i) {
  std::uint32_t& head = cell_head_[cell_of(bodies_[i])];
  bodies_[i].next = head;
  bodies_[i].previous = kInvalidIndex;
  if (head != kInvalidIndex) bodies_[head].previous = i;
  head = i;
}

void Reference::leave_cell(std::uint32_t i) {
  const Body& body = bodies_[i];
  (body.previous == kInvalidIndex ? cell_head_[cell_of(body)] : bodies_[body.previous].next) = body.next;
  if (body.next != kInvalidIndex) bodies_[body.next].previous = body.previous;
}

// The trajectory does not change. A parcel that enters on the other side of a periodic world is moved by a
// side.
void Reference::move_to_next_cell(std::uint32_t i, bool along_x) {
  leave_cell(i);
  Body& body = bodies_[i];
  const auto step = [](std::uint32_t& cell, std::uint32_t num, double velocity, double& x, double side) {
    const bool up = velocity > 0.0;
    if (cell == (up ? num - 1 : 0)) {
      cell = up ? 0 : num - 1;
      x += up ? -side : side;
    } else {
      up ? ++cell : --cell;
    }
  };
  if (along_x) {
    step(body.cell_x, axis_x_.num_cells, body.velocity.x, body.position.x, side_m_.x);
  } else {
    step(body.cell_y, axis_y_.num_cells, body.velocity.y, body.position.y, side_m_.y);
  }
  enter_cell(i);
}

void Reference::predict(std::uint32_t i) {
  Body& body = bodies_[i];
  PredictedEvent earliest{kNever, i, kPartnerCellX};
  predict_edge(body, earliest);
  if (physics_.parcels.contacts) predict_pairs(body, earliest);
  if (in_zone_[cell_of(body)]) predict_ball_hit(body, earliest);
  if (earliest.partner == kPartnerBall) {
    body.partner_changes = ball_.num_changes;
  } else if (earliest.partner < kFirstPartnerCode) {
    body.partner_changes = bodies_[earliest.partner].num_changes;
  }
  tree_.set(earliest);
}

// The edge is that of the next cell; in an outer cell it is the wall (for the rim) or the exit (for the
// centre).
void Reference::predict_edge(const Body& body, PredictedEvent& earliest) const {
  const Boundary boundary = physics_.world.boundary;
  const bool walls = boundary == Boundary::walls;
  const auto predict_axis = [&](const CellAxis& axis, double x, double v, std::uint32_t cell, bool along_x) {
    if (v == 0.0) return;
    double edge = -axis.half_m + (v > 0.0 ? cell + 1 : cell) * axis.cell_m;
    std::uint32_t partner = along_x ? kPartnerCellX : kPartnerCellY;
    if (boundary != Boundary::periodic && cell == (v > 0.0 ? axis.num_cells - 1 : 0)) {
      const double limit = walls ? axis.half_m - physics_.parcels.radius_m : axis.half_m;
      edge = v > 0.0 ? limit : -limit;
      partner = walls ? (along_x ? kPartnerWallX : kPartnerWallY) : kPartnerExit;
    }
    const double time_s = std::max(now_, body.time_s + (edge - x) / v);
    keep_earlier({time_s, earliest.owner, partner}, earliest);
  };
  predict_axis(axis_x_, body.position.x, body.velocity.x, body.cell_x, true);
  predict_axis(axis_y_, body.position.y, body.velocity.y, body.cell_y, false);
}

// Predicts collisions with the parcels of the 3x3 cells around. Across a periodic edge these are images of
// neighbouring cells, so that a world of two cells needs no rule of its own.
void Reference::predict_pairs(const Body& body, PredictedEvent& earliest) const {
  const bool periodic = side_m_.x > 0.0;
  for (int dy = -1; dy <= 1; ++dy) {
    std::int64_t y = static_cast<std::int64_t>(body.cell_y) + dy;
    const bool beyond_y = y < 0 || y >= axis_y_.num_cells;
    if (beyond_y && !periodic) continue;
    if (beyond_y) y -= dy * static_cast<std::int64_t>(axis_y_.num_cells);
    for (int dx = -1; dx <= 1; ++dx) {
      std::int64_t x = static_cast<std::int64_t>(body.cell_x) + dx;
      const bool beyond_x = x < 0 || x >= axis_x_.num_cells;
      if (beyond_x && !periodic) continue;
      if (beyond_x) x -= dx * static_cast<std::int64_t>(axis_x_.num_cells);
      const Vec2d shift{beyond_x ? dx * side_m_.x : 0.0, beyond_y ? dy * side_m_.y : 0.0};
      const std::uint32_t first = cell_head_[static_cast<std::size_t>(y * axis_x_.num_cells + x)];
      predict_pairs_in(first, body, shift, earliest);
    }
  }
}

// Predicts collisions with the parcels in the list of one cell, moved by shift. A pair's time is counted from
// the later of both last changes: it depends neither on the time of the prediction nor on which of the two is
// predicted.
void Reference::predict_pairs_in(std::uint32_t first, const Body& body, Vec2d shift,
                                 PredictedEvent& earliest) const {
  for (std::uint32_t j = first; j != kInvalidIndex; j = bodies_[j].next) {
    const Body& other = bodies_[j];
    if (j == earliest.owner) continue;
    const double base_s = std::max(body.time_s, other.time_s);
    const Vec2d here = body.position + body.velocity * (base_s - body.time_s);
    const Vec2d there = other.position + other.velocity * (base_s - other.time_s);
    const double time_s =
        contact_time(there - here + shift, other.velocity - body.velocity, contact_m_, base_s, now_);
    if (time_s <= earliest.time_s) keep_earlier({time_s, earliest.owner, j}, earliest);
  }
}

// In a small periodic world a parcel may hit any of the ball's images first. Images one side away are enough:
// until its next prediction a parcel moves by a cell, half a side at most, and the ball by the zone's margin.
void Reference::predict_ball_hit(const Body& body, PredictedEvent& earliest) const {
  const Vec2d here = body.position + body.velocity * (now_ - body.time_s);
  const Vec2d there = ball_.position + ball_.velocity * (now_ - ball_.time_s);
  const Vec2d offset = nearest_image(here - there);
  const Vec2d velocity = body.velocity - ball_.velocity;
  const int images = side_m_.x > 0.0 ? 1 : 0;
  for (int ky = -images; ky <= images; ++ky) {
    for (int kx = -images; kx <= images; ++kx) {
      const Vec2d image = offset + Vec2d{kx * side_m_.x, ky * side_m_.y};
      const double time_s = now_ + time_to_contact(image, velocity, ball_contact_m_);
      keep_earlier({time_s, earliest.owner, kPartnerBall}, earliest);
    }
  }
}

void Reference::collect_ball_zone() {
  for (const std::uint32_t cell : zone_) in_zone_[cell] = 0;
  zone_.clear();
  const double reach = (ball_contact_m_ + zone_margin_m_) * (1.0 + 1e-9);
  const bool periodic = side_m_.x > 0.0;
  const CellRange xs = cells_within(axis_x_, ball_.position.x, reach, periodic);
  const CellRange ys = cells_within(axis_y_, ball_.position.y, reach, periodic);
  for (std::int64_t y = ys.first; y < ys.first + ys.count; ++y) {
    for (std::int64_t x = xs.first; x < xs.first + xs.count; ++x) {
      zone_.push_back(wrapped(y, axis_y_.num_cells) * axis_x_.num_cells + wrapped(x, axis_x_.num_cells));
      in_zone_[zone_.back()] = 1;
    }
  }
}

// Rebuilds the zone around the ball's current position, and predicts again the ball and all parcels in it.
void Reference::update_ball() {
  if (!physics_.ball.exists) return;
  advance(ball_);
  ball_.position = nearest_image(ball_.position);
  collect_ball_zone();
  for (const std::uint32_t cell : zone_) {
    for (std::uint32_t i = cell_head_[cell]; i != kInvalidIndex; i = bodies_[i].next) predict(i);
  }
  predict_ball();
}

// The ball's next event is the end of its zone or a wall. A frozen ball reacts to walls only when its
// impulses are applied.
void Reference::predict_ball() {
  const double speed = length(ball_.velocity);
  const auto owner = static_cast<std::uint32_t>(bodies_.size());
  PredictedEvent earliest{kNever, owner, kPartnerCellX};
  if (speed > 0.0) earliest.time_s = now_ + zone_margin_m_ / speed;
  if (physics_.world.boundary == Boundary::walls && !options_.ball_frozen) {
    const auto wall = [&](double x, double v, double half, std::uint32_t partner) {
      if (v == 0.0) return;
      const double limit = half - physics_.ball.radius_m;
      const double time_s = std::max(now_, now_ + ((v > 0.0 ? limit : -limit) - x) / v);
      keep_earlier({time_s, owner, partner}, earliest);
    };
    wall(ball_.position.x, ball_.velocity.x, axis_x_.half_m, kPartnerWallX);
    wall(ball_.position.y, ball_.velocity.y, axis_y_.half_m, kPartnerWallY);
  }
  tree_.set(earliest);
}

}  // namespace pf
