// A blast: a hot disc in a cold gas at rest.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "lab/flow_run.hpp"
#include "lab/samples.hpp"
#include "lab/theory.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr int kSamples = 32;
constexpr std::uint32_t kBins = 500;
constexpr double kFirst = 2.5,
                 kLast = 0.84;  // radii of the front: over the hot disc's, over half of the side

struct BlastPlan {
  double path = 1.0;  // mean free path
  double density = 1.0;
  double side = 1.0;
  double energy = 1.0;  // the hot disc has c = 1
  theory::Blast blast;

  double time_at(double radius) const {
    return radius * radius * std::sqrt(blast.energy_share * density / energy);
  }
};

BlastPlan plan_blast(const BlastCase& c) {
  BlastPlan plan;
  plan.path = theory::mean_free_path_m(c.area_fraction, 0.5);
  plan.density = c.area_fraction / (0.25 * kPi);
  plan.side = std::sqrt(static_cast<double>(c.num_parcels) / plan.density);
  plan.blast = theory::strong_blast(c.area_fraction);
  return plan;
}

// The parcels within a radius of the origin get a temperature of 1 and no total momentum; the others rest.
// Returns the number of hot ones, which is their energy as well.
double heat(ParcelSnapshot& state, const World& world, double radius, std::int64_t seed) {
  std::mt19937_64 random(static_cast<std::uint64_t>(seed));
  std::vector<std::size_t> hot;
  for (std::size_t i = 0; i < state.position.size(); ++i) {
    const Vec2d at = to_metres(world, state.position[i]);
    if (dot(at, at) < radius * radius) hot.push_back(i);
    state.velocity[i] = {0.0F, 0.0F};
  }
  std::vector<Vec2d> velocity;
  Vec2d mean;
  for (std::size_t k = 0; k < hot.size(); ++k) {
    const double speed = std::sqrt(-2.0 * std::log(1.0 - uniform(random)));
    const double angle = 2.0 * kPi * uniform(random);
    velocity.push_back({speed * std::cos(angle), speed * std::sin(angle)});
    mean += velocity.back();
  }
  mean = mean * (1.0 / static_cast<double>(hot.size()));
  double square = 0.0;
  for (Vec2d& v : velocity) {
    v -= mean;
    square += dot(v, v);
  }
  const double scale = std::sqrt(2.0 * static_cast<double>(hot.size()) / square);
  for (std::size_t k = 0; k < hot.size(); ++k) state.velocity[hot[k]] = to_float(velocity[k] * scale);
  return static_cast<double>(hot.size());
}

// Outermost radius at which the density passes the mean of both sides of the front.
double front_radius(const Profile& profile, const BlastPlan& plan, double area_fraction) {
  const std::vector<ProfileRow> rows = rows_of(profile, {.radius_m = 0.5});
  const double level = 0.5 * area_fraction * (1.0 + plan.blast.density);
  const auto smooth = [&](std::size_t k) {
    double sum = 0.0;
    for (std::size_t j = k - 2; j <= k + 2; ++j) sum += rows[j].area_fraction;
    return sum / 5.0;
  };
  for (std::size_t k = rows.size() - 4; k > 2; --k) {
    const double outer = smooth(k + 1), inner = smooth(k);
    if (inner >= level && outer < level) {
      const double width = rows[1].position_m - rows[0].position_m;
      return rows[k].position_m + width * (inner - level) / (inner - outer);
    }
  }
  return 0.0;
}

// Behind the front at this time by theory; at the start the hot disc.
FlowScales scales_at(const BlastCase& c, const BlastPlan& plan, double radius) {
  const double front = 0.5 * radius / plan.time_at(radius);
  const double behind = c.area_fraction * plan.blast.density;
  const double c2 = (1.0 - 1.0 / plan.blast.density) / (plan.blast.density * theory::compressibility(behind));
  const double speed = std::min(1.0, front * std::sqrt(c2));
  return {theory::collision_rate_per_s(behind, speed, 0.5), std::min(3.0, 3.0 * front), 1.0};
}

}  // namespace

json measure_blast(const BlastCase& c, const FlowSteps& steps, Backend& backend) {
  BlastPlan plan = plan_blast(c);
  Settings settings = unit_gas(c.num_parcels, c.area_fraction, Boundary::periodic);
  settings.seed = c.seed;
  FlowRun run(settings, steps, backend);
  const double disc = std::sqrt(c.num_hot / (kPi * plan.density));
  plan.energy = heat(run.start(), run.physics().world, disc, c.seed);
  run.begin(scales_at(c, plan, kFirst * disc));
  const double last = 0.5 * kLast * plan.side,
               growth = std::pow(last / (kFirst * disc), 1.0 / (kSamples - 1));
  const ProfileShape shape = profile_shape(run.physics(), ProfileAxis::radius, kBins);
  const double unit_time = plan.time_at(plan.path);
  json samples = json::array();
  double now = 0.0, radius = kFirst * disc;
  for (int k = 0; k < kSamples; ++k, radius *= growth) {
    run.rescale(scales_at(c, plan, radius));
    const double time = plan.time_at(radius);
    run.advance(time - now);
    now = time;
    samples.push_back(
        {now / unit_time, front_radius(backend.profile(shape), plan, c.area_fraction) / plan.path});
  }
  const auto num = static_cast<double>(c.num_parcels);
  return {{"samples", samples},
          {"theory", plan.blast.prefactor},
          {"collisions", 2.0 * static_cast<double>(run.totals().num_collisions) / num},
          {"ns_per_disc_time", run.wall_ns() / (num * now)},
          {"energy_ratio", run.energy() / plan.energy},
          {"max_overlap", run.totals().max_overlap_diameters}};
}

}  // namespace pf
