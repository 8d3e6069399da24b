// A held smooth ball in a stream that starts at once, in a periodic world: the measurement ends before
// anything that the ball sent out comes round.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "lab/flow_run.hpp"
#include "lab/theory.hpp"
#include "model/free_flow.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr int kBlocks = 32;                // of the measurement
constexpr double kMaxAreaFraction = 0.05;  // from here on the number of parcels grows instead

struct DragPlan {
  double area_fraction = 0.0;
  double radius = 0.0;  // of the ball
  double contact = 0.0;
  double speed = 0.0;  // of the stream
  double area = 0.0;   // of the world outside the ball
  std::int64_t num_parcels = 0;

  double density() const { return static_cast<double>(num_parcels) / area; }
};

double outside_area(const DragCase& c, double radius) {
  const double contact = radius + 0.5;
  return c.length * c.height * radius * radius - kPi * contact * contact;
}

// Parcels that this case takes at an area fraction; it falls as that rises.
double num_needed(const DragCase& c, double area_fraction) {
  const double radius = c.radius_over_path * theory::mean_free_path_m(area_fraction, 0.5);
  return area_fraction / (0.25 * kPi) * outside_area(c, radius);
}

double area_fraction_for(const DragCase& c) {
  if (c.area_fraction > 0.0) return c.area_fraction;
  double low = 1e-9, high = kMaxAreaFraction;
  if (num_needed(c, high) >= static_cast<double>(c.num_parcels)) return high;
  for (int k = 0; k < 100; ++k) {
    const double middle = std::sqrt(low * high);
    (num_needed(c, middle) > static_cast<double>(c.num_parcels) ? low : high) = middle;
  }
  return low;
}

DragPlan plan_drag(const DragCase& c) {
  DragPlan plan;
  plan.area_fraction = area_fraction_for(c);
  plan.radius = c.radius_over_path * theory::mean_free_path_m(plan.area_fraction, 0.5);
  plan.contact = plan.radius + 0.5;
  plan.speed = c.speed_ratio * std::sqrt(2.0);
  plan.area = outside_area(c, plan.radius);
  plan.num_parcels = static_cast<std::int64_t>(std::llround(num_needed(c, plan.area_fraction)));
  return plan;
}

Settings drag_settings(const DragCase& c, const DragPlan& plan) {
  Settings s = unit_gas(plan.num_parcels, plan.area_fraction, Boundary::periodic);
  s.box_follows_parcels = false;
  s.width_m = c.length * plan.radius;
  s.height_m = c.height * plan.radius;
  s.contacts = c.contacts;
  s.seed = c.seed;
  add_resting_ball(s, 1.0, plan.radius);
  s.ball_held = true;
  s.friction = 0.0;
  return s;
}

// Parcels close in front of the ball. The gas flows off along it, in proportion to the angle from the axis;
// what velocities differ from that flow is heat.
struct FrontCell {
  static constexpr double kDepth = 0.1;  // ball radii
  double num = 0.0;
  double outward = 0.0, outward2 = 0.0;  // sums of velocities away from the ball, and of their squares
  double along2 = 0.0, along_angle = 0.0,
         angle2 = 0.0;  // of velocities along it, with the angle, and of that
  int num_samples = 0;

  void add(const ParcelSnapshot& state, const World& world, const DragPlan& plan) {
    const double outer = plan.contact + kDepth * plan.radius;
    for (std::size_t i = 0; i < state.position.size(); ++i) {
      const Vec2d at = to_metres(world, state.position[i]);
      if (at.x >= 0.0 || dot(at, at) >= outer * outer) continue;
      if (std::fabs(at.y) > -at.x * std::tan(kFrontHalfAngle)) continue;
      const Vec2d out = at * (1.0 / length(at));
      const double v_out = dot(to_double(state.velocity[i]), out);
      const double v_along = dot(to_double(state.velocity[i]), perpendicular(out));
      const double angle = std::atan2(-at.y, -at.x);
      num += 1.0;
      outward += v_out;
      outward2 += v_out * v_out;
      along2 += v_along * v_along;
      along_angle += v_along * angle;
      angle2 += angle * angle;
    }
    ++num_samples;
  }
  double density(const DragPlan& plan) const {
    const double outer = plan.contact + kDepth * plan.radius;
    return num / (num_samples * kFrontHalfAngle * (outer * outer - plan.contact * plan.contact));
  }
  double temperature_outward() const { return (outward2 - outward * outward / num) / num; }
  double temperature_along() const { return (along2 - along_angle * along_angle / angle2) / num; }
};

void add_front(json& row, const FrontCell& cell, const DragPlan& plan) {
  const double density = cell.density(plan) / plan.density();
  const double here = std::min(0.69, plan.area_fraction * density);
  const double temperature = 0.5 * (cell.temperature_outward() + cell.temperature_along());
  row["stagnation_density"] = density;
  row["stagnation_temperature"] = temperature;
  row["stagnation_anisotropy"] = cell.temperature_outward() / cell.temperature_along();
  row["stagnation_pressure"] =
      density * temperature * theory::compressibility(here) / theory::compressibility(plan.area_fraction);
}

// Coefficient of the force that this impulse exerts over a time.
double drag_coefficient(const DragPlan& plan, double impulse, double time) {
  return impulse / (time * drag_force_n(1.0, plan.density(), plan.speed, plan.contact));
}

FlowScales scales_of(const DragPlan& plan) {
  const double hot = std::sqrt(1.0 + 0.25 * plan.speed * plan.speed);
  return {theory::collision_rate_per_s(std::min(0.6, 2.5 * plan.area_fraction), hot, 0.5), 2.5 + plan.speed,
          2.0 + plan.speed};
}

}  // namespace

json measure_drag(const DragCase& c, const FlowSteps& steps, Backend& backend) {
  const DragPlan plan = plan_drag(c);
  FlowRun run(drag_settings(c, plan), steps, backend);
  for (Vec2f& v : run.start().velocity) v.x += static_cast<float>(plan.speed);
  run.begin(scales_of(plan));
  const double crossing = plan.radius / plan.speed;
  run.advance(c.start * crossing);
  const double block = (c.end - c.start) * crossing / kBlocks;
  double impulse = 0.0, hits = 0.0;
  FrontCell cell;
  for (int k = 0; k < kBlocks; ++k) {
    const StepTotals totals = run.advance(block).totals;
    impulse += totals.ball_impulse_kg_mps.x;
    hits += static_cast<double>(totals.num_ball_hits);
    if (c.radius_over_path >= 3.0) cell.add(backend.snapshot(), run.physics().world, plan);
  }
  const double time = block * kBlocks, num = static_cast<double>(plan.num_parcels);
  json row = {{"drag", drag_coefficient(plan, impulse, time)},
              {"hits", hits},
              {"start", c.start},
              {"num_parcels", plan.num_parcels},
              {"area_fraction", plan.area_fraction},
              {"ball_radius", plan.radius},
              {"ns_per_disc_time", run.wall_ns() / (num * c.end * crossing)},
              {"collisions", 2.0 * static_cast<double>(run.totals().num_collisions) / num},
              {"max_overlap", run.totals().max_overlap_diameters}};
  if (cell.num > 0.0) add_front(row, cell, plan);
  return row;
}

}  // namespace pf
