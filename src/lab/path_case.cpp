#include "lab/path_case.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "lab/reference.hpp"

namespace pf {
namespace {

struct ReferenceRun {
  std::vector<ReferenceParcel> parcels;
  std::vector<bool> collided;
};

ReferenceRun run_reference(const GasRun& run, const ParcelSnapshot& start, double duration) {
  Reference reference(run.physics, reference_parcels(run.physics.world, start), BallState{});
  std::vector<ReferenceEvent> events;
  reference.run_until(duration, &events);
  ReferenceRun result{reference.parcels(), std::vector<bool>(run.physics.parcels.num, false)};
  for (const ReferenceEvent& event : events) {
    if (event.kind != ReferenceEvent::Kind::pair) continue;
    result.collided[event.a] = result.collided[event.b] = true;
  }
  return result;
}

}  // namespace

nlohmann::json measure_path(const GasCase& gas, const GasSteps& steps, std::unique_ptr<Backend> backend) {
  GasRun run(gas, steps, std::move(backend));
  const double wanted = steps.collisions / theory_rate(gas.area_fraction);
  const double num_steps = std::max(1.0, std::round(wanted / steps.dt));
  const double duration = num_steps * steps.dt;
  const ReferenceRun expected = run_reference(run, equilibrated(gas), duration);
  run.advance(static_cast<std::uint32_t>(num_steps));
  const auto measured = reference_parcels(run.physics.world, run.backend->snapshot());
  const Vec2d side = to_metres(run.physics.world, run.physics.world.half) * 2.0;
  std::vector<double> distances;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (!expected.collided[i]) continue;
    const Vec2d offset = measured[i].position_m - expected.parcels[i].position_m;
    distances.push_back(std::hypot(std::remainder(offset.x, side.x), std::remainder(offset.y, side.y)));
  }
  std::sort(distances.begin(), distances.end());
  const double n = static_cast<double>(distances.size());
  // Ranks of the interval: n/2 +- 1.96 sqrt(n)/2, since the number of values below the median is binomial.
  const auto at = [&](double rank) {
    return distances.at(static_cast<std::size_t>(std::clamp(rank, 0.0, n - 1.0)));
  };
  const double half_width = 0.98 * std::sqrt(n);
  return {{"method", method_name(steps.method)},
          {"area_fraction", gas.area_fraction},
          {"restitution", gas.restitution},
          {"num_parcels", gas.num_parcels},
          {"dt", steps.dt},
          {"duration", duration},
          {"path_error", at(0.5 * n)},
          {"path_low", at(0.5 * n - half_width)},
          {"path_high", at(0.5 * n + half_width)},
          {"num_compared", distances.size()}};
}

}  // namespace pf
