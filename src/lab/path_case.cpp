#include "lab/path_case.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "lab/reference.hpp"

namespace pf {
namespace {

struct Truth {
  std::vector<ReferenceParcel> parcels;
  std::vector<bool> collided;
};

Truth follow_reference(const GasRun& run, const ParcelSnapshot& start, double duration) {
  Reference reference(run.physics, reference_parcels(run.physics.world, start), BallState{});
  std::vector<ReferenceEvent> events;
  reference.run_until(duration, &events);
  Truth truth{reference.parcels(), std::vector<bool>(run.physics.parcels.num, false)};
  for (const ReferenceEvent& event : events) {
    if (event.kind != ReferenceEvent::Kind::pair) continue;
    truth.collided[event.a] = truth.collided[event.b] = true;
  }
  return truth;
}

}  // namespace

nlohmann::json measure_path(const GasCase& gas, const GasSteps& steps, std::unique_ptr<Backend> backend) {
  GasRun run(gas, steps, std::move(backend));
  const double wanted = steps.collisions / theory_rate(gas.area_fraction);
  const double num_steps = std::max(1.0, std::round(wanted / steps.dt));
  const double duration = num_steps * steps.dt;
  const Truth truth = follow_reference(run, equilibrated(gas), duration);
  run.advance(static_cast<std::uint32_t>(num_steps));
  const auto found = reference_parcels(run.physics.world, run.backend->snapshot());
  const Vec2d side = to_metres(run.physics.world, run.physics.world.half) * 2.0;
  std::vector<double> strayed;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!truth.collided[i]) continue;
    const Vec2d apart = found[i].position_m - truth.parcels[i].position_m;
    strayed.push_back(std::hypot(std::remainder(apart.x, side.x), std::remainder(apart.y, side.y)));
  }
  std::sort(strayed.begin(), strayed.end());
  const double n = static_cast<double>(strayed.size());
  // Ranks of the interval: n/2 +- 1.96 sqrt(n)/2, the binomial of how many lie below the median.
  const auto at = [&](double rank) {
    return strayed.at(static_cast<std::size_t>(std::clamp(rank, 0.0, n - 1.0)));
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
          {"num_compared", strayed.size()}};
}

}  // namespace pf
