// Validation of single collisions of two bodies.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/scene_run.hpp"
#include "app/step_request.hpp"
#include "core/timing.hpp"
#include "lab/gas_case.hpp"
#include "lab/parallel_for.hpp"
#include "lab/reference.hpp"
#include "lab/samples.hpp"
#include "lab/theory.hpp"
#include "lab/validate.hpp"
#include "model/kinetic_theory.hpp"

namespace pf {
namespace {

constexpr int kNumPairs = 10000;
constexpr double kApart = 24.0;  // diameters between pairs; a pair flies less

// Isolated pairs that fly at each other with relative speed 1. Their impact parameters are spread evenly over
// the contact distance. They start 2 to 4 diameters before the closest approach: at a uniform phase of every
// step of which 2 diameters are a multiple.
class PassingPairs {
 public:
  explicit PassingPairs(Method method) : run_(settings(method), parallel_threads()) {
    std::mt19937_64 random(7);
    const double half = 0.5 * kApart * 100.0;
    ParcelSnapshot state = run_.backend->snapshot();
    for (int k = 0; k < kNumPairs; ++k) {
      const Vec2d centre{kApart * (k % 100 + 0.5) - half, kApart * (k / 100 + 0.5) - half};
      const double angle = 2.0 * kPi * uniform(random);
      const Vec2d along{std::cos(angle), std::sin(angle)};
      const double impact = (k + 0.5) / kNumPairs;
      const Vec2d offset = along * (2.0 + 2.0 * uniform(random)) + perpendicular(along) * impact;
      for (const int side : {0, 1}) {
        const Vec2d sign = offset * (side == 0 ? 0.5 : -0.5);
        state.position[2 * k + side] = to_units(run_.physics.world, centre - sign);
        state.velocity[2 * k + side] = to_float(along * (side == 0 ? 0.5 : -0.5));
      }
    }
    run_.backend->restore(state);
    start_ = run_.backend->snapshot();
  }

  // Advances until all pairs have passed, in steps of step_diameters.
  StepTotals pass(double step_diameters) {
    return run_.advance(static_cast<std::uint32_t>(std::ceil(kPassed_s / step_diameters)), step_diameters)
        .totals;
  }

  SceneRun& run() { return run_; }
  const ParcelSnapshot& start() const { return start_; }
  static constexpr double kPassed_s = 6.0;

 private:
  static Settings settings(Method method) {
    constexpr double kAreaPerParcel = kApart * kApart / 2.0;
    Settings s = unit_gas(2 * kNumPairs, kPi * 0.25 / kAreaPerParcel, Boundary::periodic);
    s.method = method;
    return s;
  }

  SceneRun run_;
  ParcelSnapshot start_;
};

// Compares velocities after one collision each with those of serial double arithmetic.
void add_two_body(const RowSink& add) {
  const Clock::time_point start = Clock::now();
  PassingPairs pairs(Method::exact);
  pairs.pass(0.25);
  const Physics& physics = pairs.run().physics;
  Reference reference(physics, reference_parcels(physics.world, pairs.start()), {});
  reference.run_until(PassingPairs::kPassed_s);
  const ParcelSnapshot found = pairs.run().backend->snapshot();
  const std::vector<ReferenceParcel> expected = reference.parcels();
  double worst = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Vec2d off = to_double(found.velocity[i]) - expected[i].velocity_mps;
    worst = std::max(worst, length(off));
  }
  // The stored normal is off by one or two position units. The error of the velocity grows towards grazing.
  ValidationRow row;
  row.reference = "two bodies: largest error of a velocity";
  row.relative = false;
  row.measured = worst;
  row.tolerance = 1e-4;
  row.seconds = milliseconds_since(start) * 1e-3;
  add(row);
}

// `impulse` finds a pair that overlaps and approaches at the end of a step, on half of the chord. It misses
// as many as a test for overlap alone with steps twice as long.
void add_missed(Method method, double step_diameters, const RowSink& add) {
  const Clock::time_point start = Clock::now();
  PassingPairs pairs(method);
  const StepTotals totals = pairs.pass(step_diameters);
  const double missed = 1.0 - static_cast<double>(totals.num_collisions) / kNumPairs;
  ValidationRow row;
  row.method = method;
  row.judged = method == Method::exact;
  row.reference = fmt::format("missed collisions, {:g} diameters a step", step_diameters);
  row.relative = false;
  row.expected = row.judged ? 0.0 : missed_fraction(2.0 * step_diameters);
  row.measured = missed;
  row.sigma = row.judged ? 0.0 : std::sqrt(missed * (1.0 - missed) / kNumPairs);
  row.seconds = milliseconds_since(start) * 1e-3;
  add(row);
}

// Sum of the velocity changes that `events` give a ball of the starting velocity and spin. Each parcel comes
// along its first trajectory, since parcels do not collide with each other.
Vec2d summed_hits(const SceneRun& run, const ParcelSnapshot& before, const std::vector<EventRecord>& events) {
  const Physics& physics = run.physics;
  const double tick_s = tick_seconds(physics.world, physics.reference_speed_mps);
  Vec2d change;
  for (const EventRecord& event : events) {
    const double time_s = static_cast<double>(event.tick) * tick_s;
    const Vec2d velocity = to_double(before.velocity[event.first]);
    const Vec2d at = to_metres(physics.world, before.position[event.first]) + velocity * time_s;
    const Vec2d offset = at - run.ball.velocity_mps * time_s;
    const Vec2d normal = offset * (1.0 / length(offset));
    const BallImpulse hit = ball_impulse(physics.ball, physics.parcels, normal,
                                         velocity - run.ball.velocity_mps, run.ball.spin_radps);
    change -= hit.per_mass_mps * (physics.parcels.mass_kg / physics.ball.mass_kg);
  }
  return change;
}

// Compares the velocity change of a ball of 2.6e6 parcel masses with the sum over its hits.
void add_heavy_ball(const RowSink& add) {
  const Clock::time_point start = Clock::now();
  Settings s = unit_gas(4000, 0.4, Boundary::periodic);
  s.method = Method::exact;
  s.contacts = false;
  add_resting_ball(s, 2.6e6, 12.0);
  s.ball_vx_mps = 0.5;
  s.ball_spin_radps = 0.1;
  SceneRun run(s, 1);
  const ParcelSnapshot before = run.backend->snapshot();
  std::vector<EventRecord> events;
  StepRequest request = step_request(s, run.physics, 1, 3.0);
  request.events = &events;
  const BallState after = run.backend->advance(request).ball;
  ValidationRow row;
  row.reference = fmt::format("ball 2.6e6 times as heavy: {} hits, dv", events.size());
  row.expected = summed_hits(run, before, events).x;
  row.measured = after.velocity_mps.x - run.ball.velocity_mps.x;
  // The sum takes the ball as it was before all hits: it is off by hits times the mass ratio.
  row.tolerance = 1e-3;
  row.seconds = milliseconds_since(start) * 1e-3;
  add(row);
}

}  // namespace

std::vector<ValidationCase> pair_cases(const ValidationPlan&) {
  std::vector<ValidationCase> cases = {{"two bodies", add_two_body},
                                       {"heavy ball", [](const RowSink& add) { add_heavy_ball(add); }}};
  for (const double step_diameters : {0.1, 0.5, 2.0}) {
    for (const Method method : {Method::exact, Method::impulse}) {
      cases.push_back({fmt::format("missed/{}/{}", method_name(method), step_diameters),
                       [=](const RowSink& add) { add_missed(method, step_diameters, add); }});
    }
  }
  return cases;
}

}  // namespace pf
