// The lattice on which parcels are spawned. The numbers of rows and columns are chosen for the largest
// spacing with N sites free of the ball.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

struct Lattice {
  std::uint32_t num_rows = 0;
  std::uint32_t num_columns = 0;
  double spacing_x = 0.0;
  double spacing_y = 0.0;
  double first_y = 0.0;       // of row 0, world centred on the origin
  double min_distance = 0.0;  // between sites, and twice the distance from a site to the edge
};

// Distance of a site from the nearest site of the next row. std::hypot is avoided: its rounding differs
// between C libraries.
double diagonal_of(const Lattice& l) {
  return std::sqrt(0.25 * l.spacing_x * l.spacing_x + l.spacing_y * l.spacing_y);
}

struct Disc {
  Vec2d centre;
  double radius;  // sites nearer than this are blocked; 0: none
};

// With `room` from row to row and half of it at both edges: the distance of neighbours. Falls as room grows.
double distance_with(Lattice& l, double height, double room) {
  l.spacing_y = (height - room) / (l.num_rows - 1);
  const double next_row = diagonal_of(l);
  return std::min({l.spacing_x, next_row, l.num_rows == 2 ? next_row : 2.0 * l.spacing_y});
}

// Chooses the distance of rows by bisection, so that sites keep half the distance of neighbours from the
// edge.
void settle_rows(Lattice& l, double height) {
  double low = 0.0, high = height;
  for (int pass = 0; pass < 64; ++pass) {
    const double middle = 0.5 * (low + high);
    (distance_with(l, height, middle) >= middle ? low : high) = middle;
  }
  l.min_distance = std::min(low, distance_with(l, height, low));
}

Lattice make_lattice(std::uint32_t rows, std::uint32_t columns, double width, double height, bool periodic) {
  Lattice l{rows, columns, width / (columns + (periodic || rows == 1 ? 0.0 : 0.5)), 0.0, 0.0, 0.0};
  if (periodic) {
    l.spacing_y = height / rows;
    l.first_y = -0.5 * height + 0.5 * l.spacing_y;
    const double diagonal = rows % 2 == 0 ? diagonal_of(l) : l.spacing_y;
    l.min_distance = std::min({l.spacing_x, diagonal, rows == 2 ? diagonal : 2.0 * l.spacing_y});
    return l;
  }
  if (rows == 1) {
    l.spacing_y = height;
    l.min_distance = std::min(l.spacing_x, height);
    return l;
  }
  l.min_distance = l.spacing_x;
  for (int pass = 0; pass < 4; ++pass) {  // sites keep half the distance of neighbours from the edge
    l.spacing_y = (height - l.min_distance) / (rows - 1);
    if (l.spacing_y <= 0.0) return {};
    l.min_distance = std::min({l.spacing_x, diagonal_of(l), 2.0 * l.spacing_y});
  }
  const double room = height - (rows - 1) * l.spacing_y;
  if (std::fabs(l.min_distance - room) > 1e-6 * room) settle_rows(l, height);  // few rows: the passes do not
  l.first_y = -0.5 * (rows - 1) * l.spacing_y;
  return l;
}

double first_site_x(const Lattice& l, double width) { return -0.5 * width + 0.5 * l.spacing_x; }

struct BlockedRun {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

// Sites of one row inside the disc. In a periodic row the run may wrap.
BlockedRun blocked_run(const Lattice& l, std::uint32_t row, double width, double height, bool periodic,
                       const Disc& disc) {
  double dy = l.first_y + row * l.spacing_y - disc.centre.y;
  if (periodic) dy -= height * std::round(dy / height);
  if (std::fabs(dy) >= disc.radius) return {};
  const double half_chord = std::sqrt(disc.radius * disc.radius - dy * dy);
  const double x0 = first_site_x(l, width) + (row % 2 == 1 ? 0.5 * l.spacing_x : 0.0);
  auto first = static_cast<std::int64_t>(std::ceil((disc.centre.x - half_chord - x0) / l.spacing_x));
  auto last = static_cast<std::int64_t>(std::floor((disc.centre.x + half_chord - x0) / l.spacing_x));
  const std::int64_t columns = l.num_columns;
  if (!periodic) {
    first = std::max<std::int64_t>(first, 0);
    last = std::min<std::int64_t>(last, columns - 1);
  }
  if (last < first) return {};
  const std::int64_t count = std::min(last - first + 1, columns);
  return {static_cast<std::uint32_t>(((first % columns) + columns) % columns),
          static_cast<std::uint32_t>(count)};
}

std::uint64_t free_sites(const Lattice& l, double width, double height, bool periodic, const Disc& disc) {
  std::uint64_t blocked = 0;
  if (disc.radius > 0.0) {
    for (std::uint32_t row = 0; row < l.num_rows; ++row) {
      blocked += blocked_run(l, row, width, height, periodic, disc).count;
    }
  }
  return static_cast<std::uint64_t>(l.num_rows) * l.num_columns - blocked;
}

struct Request {
  double width, height, diameter, ball_distance;  // ball_distance: contact distance of the ball; 0: none
  Vec2d ball;
  bool periodic;
  std::uint64_t num_parcels;
};

Disc blocked_disc(const Request& q, const Lattice& l) {
  if (q.ball_distance == 0.0) return {q.ball, 0.0};
  return {q.ball, q.ball_distance + 0.5 * std::max(0.0, l.min_distance - q.diameter)};
}

// The lattice with that many rows and the fewest columns that leave enough free sites.
Lattice best_with_rows(const Request& q, std::uint32_t rows) {
  const double blocked_share = std::min(0.9, kPi * q.ball_distance * q.ball_distance / (q.width * q.height));
  auto columns = static_cast<std::uint64_t>(
      std::max(1.0, std::floor(static_cast<double>(q.num_parcels) * (1.0 - blocked_share) / rows)));
  columns = std::max<std::uint64_t>(columns, (q.num_parcels + rows - 1) / rows);
  while (columns < (1ULL << 31)) {
    const Lattice l = make_lattice(rows, static_cast<std::uint32_t>(columns), q.width, q.height, q.periodic);
    if (l.min_distance < q.diameter) return {};
    const std::uint64_t sites = free_sites(l, q.width, q.height, q.periodic, blocked_disc(q, l));
    if (sites >= q.num_parcels) return l;
    columns += std::max<std::uint64_t>(1, (q.num_parcels - sites) / (2ULL * rows));
  }
  return {};
}

Lattice best_lattice(const Request& q) {
  const double ideal = std::sqrt(static_cast<double>(q.num_parcels) * q.height / (q.width * std::sqrt(0.75)));
  const auto first =
      static_cast<std::uint32_t>(std::max(1.0, std::floor(std::max(0.8 * ideal, ideal - 24.0))));
  const auto last = static_cast<std::uint32_t>(std::ceil(std::min(1.3 * ideal, ideal + 24.0)) + 3.0);
  Lattice best;
  for (std::uint32_t rows = first; rows <= last; ++rows) {
    const Lattice l = best_with_rows(q, rows);
    if (l.min_distance > best.min_distance) best = l;
  }
  return best;
}

}  // namespace

Spawner::Spawner(const Settings& settings, const Physics& physics, const BallState& ball) {
  plan_.num_parcels = physics.parcels.num;
  plan_.world = physics.world;
  plan_.speed_mps = settings.parcel_speed_mps;
  plan_.hot_radius_m = settings.hot_radius_m;
  plan_.hot_speed_mps = settings.hot_speed_mps;
  plan_.flow_mps = {settings.flow_x_mps, settings.flow_y_mps};
  plan_.seed = physics.seed;
  if (plan_.num_parcels == 0) return;

  const double unit = physics.world.unit_m;
  const double rounding = 4.0 * unit;  // positions are later rounded to units
  const Vec2d size = size_m(physics.world);
  const Request q{size.x,
                  size.y,
                  2.0 * physics.parcels.radius_m + rounding,
                  physics.ball.exists ? physics.ball.radius_m + physics.parcels.radius_m + rounding : 0.0,
                  ball.position_m,
                  physics.world.boundary == Boundary::periodic,
                  plan_.num_parcels};
  const Lattice l = best_lattice(q);
  if (l.num_rows == 0) {
    const bool by_radius = radius_sets_density(settings);
    throw UserError(fmt::format(
        "{}: {} parcels of diameter {:g} m do not fit into {:g} m x {:g} m{} without overlap; lower {}",
        by_radius ? "air.parcel_radius_m" : "air.area_fraction", plan_.num_parcels,
        2.0 * physics.parcels.radius_m, q.width, q.height, physics.ball.exists ? " beside the ball" : "",
        by_radius ? "air.parcel_radius_m or air.num_parcels"
                  : fmt::format("air.area_fraction (now {:.3f}) or raise air.num_parcels",
                                area_fraction_of(physics))));
  }
  plan_.num_rows = l.num_rows;
  plan_.num_columns = l.num_columns;
  plan_.spacing_x_m = l.spacing_x;
  plan_.spacing_y_m = l.spacing_y;
  plan_.first_site_m = {first_site_x(l, q.width), l.first_y};
  plan_.jitter_m = 0.5 * (l.min_distance - q.diameter);

  const Disc disc = blocked_disc(q, l);
  row_start_.assign(l.num_rows + 1, 0);
  for (std::uint32_t row = 0; row < l.num_rows; ++row) {
    const BlockedRun run =
        disc.radius > 0.0 ? blocked_run(l, row, q.width, q.height, q.periodic, disc) : BlockedRun{};
    blocked_first_.push_back(run.first);
    blocked_count_.push_back(run.count);
    row_start_[row + 1] = row_start_[row] + l.num_columns - run.count;
  }
  plan_.row_start = row_start_.data();
  plan_.row_blocked_first = blocked_first_.data();
  plan_.row_blocked_count = blocked_count_.data();
}

}  // namespace pf
