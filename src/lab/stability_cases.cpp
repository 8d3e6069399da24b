#include "lab/stability_cases.hpp"

#include <algorithm>
#include <cmath>

#include "app/scene_run.hpp"
#include "app/step_request.hpp"
#include "core/random.hpp"
#include "lab/gas_case.hpp"
#include "lab/reference.hpp"

namespace pf {
namespace {

// Elastic discs of unit diameter at given positions in a periodic square.
class FewDiscs {
 public:
  FewDiscs(std::size_t num, double side_m, std::unique_ptr<Backend> with) : backend_(std::move(with)) {
    settings_ = gas_settings({static_cast<std::int64_t>(num), 0.1, 1.0, 1, Boundary::periodic});
    settings_.box_follows_parcels = false;
    settings_.width_m = settings_.height_m = side_m;
    physics_ = spawn_scene(settings_, *backend_).physics;
  }
  void place(const std::vector<Vec2d>& at_m, const std::vector<Vec2f>& velocity) {
    ParcelSnapshot state{{}, velocity};
    for (const Vec2d& at : at_m) state.position.push_back(to_units(physics_.world, at));
    backend_->restore(state);
  }
  StepReport advance(Method method, std::uint32_t num_steps, double dt, double spring_contact = 0.0) {
    settings_.method = method;
    settings_.spring_contact_s = spring_contact;
    return backend_->advance(step_request(settings_, physics_, num_steps, dt));
  }
  double energy() const { return backend_->measure().parcel_energy_j; }
  std::vector<Vec2f> velocities() const { return backend_->snapshot().velocity; }

 private:
  Settings settings_;
  Physics physics_;
  std::unique_ptr<Backend> backend_;
};

// Isolated pairs on a square lattice: a disc at rest, and one that comes along x. It starts a diameter plus a
// random part of a step before the other, at a random offset of at most max_offset across.
struct LatticePairs {
  static constexpr std::uint32_t kPerSide = 142;
  static constexpr std::uint32_t kNum = kPerSide * kPerSide;  // 20,164
  double spacing_m;
  std::vector<Vec2d> at;
  std::vector<Vec2f> velocity;

  LatticePairs(double step_m, double spacing, double max_offset) : spacing_m(spacing) {
    for (std::uint32_t i = 0; i < kNum; ++i) {
      const double half = 0.5 * kPerSide * spacing_m;
      const Vec2d target{(i % kPerSide + 0.5) * spacing_m - half, (i / kPerSide + 0.5) * spacing_m - half};
      const double across = max_offset * (2.0 * uniform(random_bits(7, i, 0)) - 1.0);
      const double phase = step_m * uniform(random_bits(7, i, 1));
      at.insert(at.end(), {target, target + Vec2d{-1.0 - phase, across}});
      velocity.insert(velocity.end(), {{0.0F, 0.0F}, {1.0F, 0.0F}});
    }
  }
  double side_m() const { return kPerSide * spacing_m; }
};

// Half the side of a square world of num discs at area fraction 0.1.
double far_side_diameters(double num_parcels) { return 0.5 * std::sqrt(num_parcels * 0.25 * kPi / 0.1); }

}  // namespace

Share missed_share(Method method, double step_diameters, std::unique_ptr<Backend> backend) {
  const auto num_steps = static_cast<std::uint32_t>(std::ceil(2.0 / step_diameters)) + 2;
  const LatticePairs pairs(step_diameters, 2.0 * (num_steps + 1) * step_diameters + 4.0, 1.0);
  FewDiscs discs(2 * LatticePairs::kNum, pairs.side_m(), std::move(backend));
  discs.place(pairs.at, pairs.velocity);
  const StepReport report = discs.advance(method, num_steps, step_diameters);
  const double missed = 1.0 - static_cast<double>(report.totals.num_collisions) / LatticePairs::kNum;
  return {missed,
          std::sqrt(std::max(missed * (1.0 - missed), 1.0 / LatticePairs::kNum) / LatticePairs::kNum)};
}

double turned_speed(double theta_rad, Backend& backend) {
  Settings s;
  s.air = Air::vacuum;
  s.ball_x_m = s.ball_y_m = 0.0;
  s.width_m = s.height_m = 1000.0;
  const auto [physics, start] = spawn_scene(s, backend);
  const double dt_s = theta_rad / (physics.ball.magnus_per_rad * start.spin_radps);
  const auto num_steps = static_cast<std::uint32_t>(std::round(2.0 * kPi / theta_rad));
  const BallState end = backend.advance(step_request(s, physics, num_steps, dt_s)).ball;
  return std::sqrt(dot(end.velocity_mps, end.velocity_mps) / dot(start.velocity_mps, start.velocity_mps));
}

double euler_turned_speed(double theta_rad) {
  Vec2d v{1.0, 0.0};
  const int num_steps = static_cast<int>(std::round(2.0 * kPi / theta_rad));
  for (int k = 0; k < num_steps; ++k) v += perpendicular(v) * theta_rad;
  return length(v);
}

double spring_pair_energy(double step_over_contact, std::unique_ptr<Backend> backend) {
  // So short a contact lets the pair overlap by at most a hundredth of a diameter.
  constexpr double kContact = 0.01;
  const double dt = step_over_contact * kContact;
  const LatticePairs pairs(dt, 6.0, 0.0);
  FewDiscs discs(2 * LatticePairs::kNum, pairs.side_m(), std::move(backend));
  discs.place(pairs.at, pairs.velocity);
  const double before = discs.energy();
  discs.advance(Method::spring, static_cast<std::uint32_t>(std::ceil(2.0 * kContact / dt)) + 4, dt, kContact);
  return discs.energy() / before;
}

double fork_energy(Method method, double theta_rad, std::unique_ptr<Backend> backend) {
  FewDiscs discs(3, 16.0, std::move(backend));
  const double near = 1.0 - 1e-7;  // a minimal overlap
  const Vec2d partner{near * std::cos(theta_rad), near * std::sin(theta_rad)};
  discs.place({{0.0, 0.0}, partner, {partner.x, -partner.y}}, {{1.0F, 0.0F}, {}, {}});
  const double before = discs.energy();
  discs.advance(method, method == Method::spring ? 200 : 1, 1e-4);
  return discs.energy() / before;
}

double head_on_energy(Method method, std::unique_ptr<Backend> backend) {
  FewDiscs discs(3, 16.0, std::move(backend));
  const double near = 1.0 - 1e-7;
  discs.place({{-near, 0.0}, {0.0, 0.0}, {near, 0.0}}, {{1.0F, 0.0F}, {}, {-1.0F, 0.0F}});
  const double before = discs.energy();
  discs.advance(method, method == Method::spring ? 200 : 1, 1e-4);
  return discs.energy() / before;
}

Collapse cool_with_clock(double restitution, double rate_times_clock, double collisions) {
  const GasCase gas{1024, 0.25, restitution};
  const GasRun start(gas, {Method::exact, 0.01}, make_cpu_backend(1));
  const double rate = theory_rate(gas.area_fraction);
  ReferenceOptions options;
  options.contact_clock_s = rate_times_clock / rate;
  Reference reference(start.physics, reference_parcels(start.physics.world, equilibrated(gas)), BallState{},
                      options);
  const double duration = collisions / rate;
  // Time has stopped when so many collisions no longer advance it. Many alone only mean dense clusters.
  constexpr std::uint64_t kCollisionsPerDisc = 10, kMaxBatches = 100;
  constexpr double kMinAdvance = 1e-6;
  const std::uint64_t batch = kCollisionsPerDisc * static_cast<std::uint64_t>(gas.num_parcels);
  Collapse result;
  for (std::uint64_t k = 0; k < kMaxBatches && !result.collapsed; ++k) {
    const double before = reference.now_s();
    if (reference.run_until(duration, nullptr, batch)) break;
    result.collapsed = reference.now_s() - before < kMinAdvance * before;
  }
  result.reached_share = std::min(1.0, reference.now_s() / duration);
  result.events_per_disc =
      2.0 * static_cast<double>(reference.totals().num_collisions) / static_cast<double>(gas.num_parcels);
  return result;
}

double float_position_step(double num_parcels) {
  const auto far = static_cast<float>(far_side_diameters(num_parcels));
  return static_cast<double>(far) - static_cast<double>(std::nextafter(far, 0.0F));
}

double unit_position_step(double num_parcels) {
  const double side = 2.0 * far_side_diameters(num_parcels);
  return make_world(side, side, Boundary::periodic).unit_m;
}

}  // namespace pf
