// Cells, and what each body meets next.
#include <algorithm>
#include <cmath>

#include "lab/reference.hpp"

namespace pf {
namespace {

constexpr std::uint32_t kNobody = kFirstSpecial;
constexpr double kNever = std::numeric_limits<double>::infinity();

// How long until |offset + velocity t| falls to distance. Bodies that touch or overlap meet at once if and
// only if they approach. The same for (-offset, -velocity), to the last bit.
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

// The same from base_s on, but not before now_s: a time that rounding puts before now is now if they still
// approach, else never.
double meeting_time(Vec2d offset, Vec2d velocity, double distance, double base_s, double now_s) {
  const double time_s = base_s + time_to_contact(offset, velocity, distance);
  if (time_s >= now_s) return time_s;
  return dot(offset + velocity * (now_s - base_s), velocity) < 0.0 ? now_s : kNever;
}

void keep_earlier(const PlannedEvent& candidate, PlannedEvent& earliest) {
  if (happens_before(candidate, earliest)) earliest = candidate;
}

// The cell along one axis of a coordinate; the outer cells reach to infinity.
std::uint32_t cell_along(double x, double half, double width, std::uint32_t num) {
  const double cell = std::floor((x + half) / width);
  return static_cast<std::uint32_t>(std::clamp(cell, 0.0, num - 1.0));
}

struct CellRange {
  std::int64_t first, count;
};

// Cells along one axis that reach within `reach` of x.
CellRange cells_within(double x, double reach, double half, double width, std::uint32_t num, bool periodic) {
  const double low = std::floor((x - reach + half) / width);
  const double high = std::floor((x + reach + half) / width);
  const double last = num - 1.0;
  if (periodic && high - low >= last) return {0, num};
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

// The nearest image where there are images, else the offset itself.
Vec2d Reference::nearest_image(Vec2d offset) const {
  if (side_m_.x == 0.0) return offset;
  return {offset.x - side_m_.x * std::nearbyint(offset.x / side_m_.x),
          offset.y - side_m_.y * std::nearbyint(offset.y / side_m_.y)};
}

// A cell is wider than a diameter, so that partners are in neighbouring cells. Narrower ones than the mean
// spacing have parcels change cells more often than they collide, wider ones have more partners to try: 0.7
// of it was the fastest of 0.7 to 1.4 at area fraction 0.2. A periodic world has at least two per axis, see
// predict_ball_hit().
void Reference::make_cells() {
  const double spacing = std::sqrt(4.0 * half_m_.x * half_m_.y / static_cast<double>(bodies_.size()));
  const double width = std::max(contact_m_ * (1.0 + 1e-9), 0.7 * spacing);
  const std::uint32_t fewest = side_m_.x > 0.0 ? 2 : 1;
  num_cells_x_ = std::max(fewest, static_cast<std::uint32_t>(2.0 * half_m_.x / width));
  num_cells_y_ = std::max(fewest, static_cast<std::uint32_t>(2.0 * half_m_.y / width));
  cell_m_ = {2.0 * half_m_.x / num_cells_x_, 2.0 * half_m_.y / num_cells_y_};
  zone_margin_m_ = std::min({3.0 * cell_m_.x, 3.0 * cell_m_.y, 0.25 * half_m_.x, 0.25 * half_m_.y});
  cell_head_.assign(static_cast<std::size_t>(num_cells_x_) * num_cells_y_, kNobody);
  in_zone_.assign(cell_head_.size(), 0);
}

void Reference::place_in_cell(std::uint32_t i) {
  Body& body = bodies_[i];
  body.cell_x = cell_along(body.position.x, half_m_.x, cell_m_.x, num_cells_x_);
  body.cell_y = cell_along(body.position.y, half_m_.y, cell_m_.y, num_cells_y_);
  enter_cell(i);
}

void Reference::enter_cell(std::uint32_t i) {
  std::uint32_t& head = cell_head_[cell_of(bodies_[i])];
  bodies_[i].next = head;
  bodies_[i].previous = kNobody;
  if (head != kNobody) bodies_[head].previous = i;
  head = i;
}

void Reference::leave_cell(std::uint32_t i) {
  const Body& body = bodies_[i];
  (body.previous == kNobody ? cell_head_[cell_of(body)] : bodies_[body.previous].next) = body.next;
  if (body.next != kNobody) bodies_[body.next].previous = body.previous;
}

// Its line stays as it is; where it comes in on the other side of a periodic world it is moved by a side.
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
    step(body.cell_x, num_cells_x_, body.velocity.x, body.position.x, side_m_.x);
  } else {
    step(body.cell_y, num_cells_y_, body.velocity.y, body.position.y, side_m_.y);
  }
  enter_cell(i);
}

void Reference::predict(std::uint32_t i) {
  ++totals_.num_predictions;
  Body& body = bodies_[i];
  PlannedEvent earliest{kNever, i, kMeetsCellX};
  predict_edge(body, earliest);
  if (physics_.parcels.contacts) predict_pairs(body, earliest);
  if (in_zone_[cell_of(body)]) predict_ball_hit(body, earliest);
  if (earliest.meets == kMeetsBall) {
    body.changes_of_other = ball_.num_changes;
  } else if (earliest.meets < kFirstSpecial) {
    body.changes_of_other = bodies_[earliest.meets].num_changes;
  }
  tree_.set(earliest);
}

// The next cell, or in an outer cell the wall (for the rim) or the exit (for the centre).
void Reference::predict_edge(const Body& body, PlannedEvent& earliest) const {
  const Boundary boundary = physics_.world.boundary;
  const auto axis = [&](double x, double v, std::uint32_t cell, std::uint32_t num, double half, double width,
                        bool along_x) {
    if (v == 0.0) return;
    double edge = -half + (v > 0.0 ? cell + 1 : cell) * width;
    std::uint32_t meets = along_x ? kMeetsCellX : kMeetsCellY;
    if (boundary != Boundary::periodic && cell == (v > 0.0 ? num - 1 : 0)) {
      const bool walls = boundary == Boundary::walls;
      const double limit = walls ? half - physics_.parcels.radius_m : half;
      edge = v > 0.0 ? limit : -limit;
      meets = walls ? (along_x ? kMeetsWallX : kMeetsWallY) : kMeetsExit;
    }
    const double time_s = std::max(now_, body.time_s + (edge - x) / v);
    keep_earlier({time_s, earliest.owner, meets}, earliest);
  };
  axis(body.position.x, body.velocity.x, body.cell_x, num_cells_x_, half_m_.x, cell_m_.x, true);
  axis(body.position.y, body.velocity.y, body.cell_y, num_cells_y_, half_m_.y, cell_m_.y, false);
}

// Partners in the 3x3 cells around. Across a periodic edge it is the image of a cell that neighbours, so that
// worlds of two cells need no rule of their own.
void Reference::predict_pairs(const Body& body, PlannedEvent& earliest) const {
  const bool periodic = side_m_.x > 0.0;
  for (int dy = -1; dy <= 1; ++dy) {
    std::int64_t y = static_cast<std::int64_t>(body.cell_y) + dy;
    const bool beyond_y = y < 0 || y >= num_cells_y_;
    if (beyond_y && !periodic) continue;
    if (beyond_y) y -= dy * static_cast<std::int64_t>(num_cells_y_);
    for (int dx = -1; dx <= 1; ++dx) {
      std::int64_t x = static_cast<std::int64_t>(body.cell_x) + dx;
      const bool beyond_x = x < 0 || x >= num_cells_x_;
      if (beyond_x && !periodic) continue;
      if (beyond_x) x -= dx * static_cast<std::int64_t>(num_cells_x_);
      const Vec2d shift{beyond_x ? dx * side_m_.x : 0.0, beyond_y ? dy * side_m_.y : 0.0};
      predict_with(body, cell_head_[static_cast<std::size_t>(y * num_cells_x_ + x)], shift, earliest);
    }
  }
}

// Partners in the list of one cell, moved by shift. A pair's time is found from the later of both last
// changes on: it depends neither on when nor from which of the two it is predicted.
void Reference::predict_with(const Body& body, std::uint32_t first, Vec2d shift,
                             PlannedEvent& earliest) const {
  for (std::uint32_t j = first; j != kNobody; j = bodies_[j].next) {
    const Body& other = bodies_[j];
    if (j == earliest.owner) continue;
    const double base_s = std::max(body.time_s, other.time_s);
    const Vec2d here = body.position + body.velocity * (base_s - body.time_s);
    const Vec2d there = other.position + other.velocity * (base_s - other.time_s);
    const double time_s =
        meeting_time(there - here + shift, other.velocity - body.velocity, contact_m_, base_s, now_);
    if (time_s <= earliest.time_s) keep_earlier({time_s, earliest.owner, j}, earliest);
  }
}

// In a small periodic world a parcel may meet any of the ball's images first. One side to either side is
// enough: until it is predicted again a parcel moves by a cell, half a side at most, and the ball by the
// zone's margin.
void Reference::predict_ball_hit(const Body& body, PlannedEvent& earliest) const {
  const Vec2d here = body.position + body.velocity * (now_ - body.time_s);
  const Vec2d there = ball_.position + ball_.velocity * (now_ - ball_.time_s);
  const Vec2d offset = nearest_image(here - there);
  const Vec2d velocity = body.velocity - ball_.velocity;
  const int images = side_m_.x > 0.0 ? 1 : 0;
  for (int ky = -images; ky <= images; ++ky) {
    for (int kx = -images; kx <= images; ++kx) {
      const Vec2d image = offset + Vec2d{kx * side_m_.x, ky * side_m_.y};
      const double time_s = now_ + time_to_contact(image, velocity, ball_contact_m_);
      keep_earlier({time_s, earliest.owner, kMeetsBall}, earliest);
    }
  }
}

// Makes the ball's zone anew around where it is, and predicts all that lies in it and the ball itself.
void Reference::refresh_ball() {
  if (!physics_.ball.exists) return;
  advance(ball_);
  ball_.position = nearest_image(ball_.position);
  for (const std::uint32_t cell : zone_) in_zone_[cell] = 0;
  zone_.clear();
  const double reach = (ball_contact_m_ + zone_margin_m_) * (1.0 + 1e-9);
  const bool periodic = side_m_.x > 0.0;
  const CellRange xs = cells_within(ball_.position.x, reach, half_m_.x, cell_m_.x, num_cells_x_, periodic);
  const CellRange ys = cells_within(ball_.position.y, reach, half_m_.y, cell_m_.y, num_cells_y_, periodic);
  for (std::int64_t y = ys.first; y < ys.first + ys.count; ++y) {
    for (std::int64_t x = xs.first; x < xs.first + xs.count; ++x) {
      zone_.push_back(wrapped(y, num_cells_y_) * num_cells_x_ + wrapped(x, num_cells_x_));
      in_zone_[zone_.back()] = 1;
    }
  }
  for (const std::uint32_t cell : zone_) {
    for (std::uint32_t i = cell_head_[cell]; i != kNobody; i = bodies_[i].next) predict(i);
  }
  predict_ball();
}

// The end of its zone, or a wall. A frozen ball sees walls only when its impulses are applied.
void Reference::predict_ball() {
  const double speed = std::sqrt(dot(ball_.velocity, ball_.velocity));
  const auto owner = static_cast<std::uint32_t>(bodies_.size());
  PlannedEvent earliest{kNever, owner, kMeetsCellX};
  if (speed > 0.0) earliest.time_s = now_ + zone_margin_m_ / speed;
  if (physics_.world.boundary == Boundary::walls && !options_.ball_frozen) {
    const auto wall = [&](double x, double v, double half, std::uint32_t meets) {
      if (v == 0.0) return;
      const double limit = half - physics_.ball.radius_m;
      const double time_s = std::max(now_, now_ + ((v > 0.0 ? limit : -limit) - x) / v);
      keep_earlier({time_s, owner, meets}, earliest);
    };
    wall(ball_.position.x, ball_.velocity.x, half_m_.x, kMeetsWallX);
    wall(ball_.position.y, ball_.velocity.y, half_m_.y, kMeetsWallY);
  }
  tree_.set(earliest);
}

}  // namespace pf
