// A shock: two halves of a periodic gas fly at each other. The middle acts as a wall; no wall disturbs the
// gas.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "lab/flow_run.hpp"
#include "lab/line_fit.hpp"
#include "lab/theory.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr int kShockSamples = 48;
constexpr std::uint32_t kShockBins = 1000;
constexpr double kWindow = 10.0, kFrontDepth = 12.0;  // around the front, and its depth, in `path`
// The start heats the gas in the middle; that layer spreads by conduction. Share of the front's last
// distance.
constexpr double kWarm = 0.4;

// Lengths and speeds of a case; the gas ahead has c = 1.
struct ShockPlan {
  double path = 1.0;         // mean free path ahead, at least a diameter
  double half_length = 0.0;  // of the world
  double height = 0.0;
  double sound = 1.0;
  theory::Shock shock;
  double duration = 0.0;  // until the edge's rarefaction nears the front
};

ShockPlan plan_shock(const ShockCase& c) {
  ShockPlan plan;
  plan.path = std::max(1.0, theory::mean_free_path_m(c.area_fraction, 0.5));
  plan.half_length = c.half_length * plan.path;
  const double area = static_cast<double>(c.num_parcels) * 0.25 * kPi / c.area_fraction;
  plan.height = area / (2.0 * plan.half_length);
  plan.sound = theory::sound_speed(c.area_fraction);
  plan.shock = theory::shock_of(c.area_fraction, c.mach);
  plan.duration = 0.9 * plan.half_length / (plan.shock.front_speed + plan.shock.gas_speed + plan.sound);
  return plan;
}

Settings shock_settings(const ShockCase& c, const ShockPlan& plan) {
  Settings s = unit_gas(c.num_parcels, c.area_fraction, Boundary::periodic);
  s.width_m = 2.0 * plan.half_length;
  s.height_m = plan.height;
  s.seed = c.seed;
  return s;
}

// Both halves lie on each other, distances from the middle.
struct FoldedBin {
  double num = 0.0, away = 0.0, across = 0.0, square = 0.0;  // sums of parcels and of their velocities

  void add(const ProfileSums& sums, double sign, double unit) {
    num += static_cast<double>(sums.num);
    away += sign * unit * static_cast<double>(sums.along);
    across += unit * static_cast<double>(sums.across);
    square += unit * unit * kProfileSquareUnit * static_cast<double>(sums.square);
  }
  void operator+=(const FoldedBin& o) {
    num += o.num;
    away += o.away;
    across += o.across;
    square += o.square;
  }
  double temperature() const { return 0.5 * (square - (away * away + across * across) / num) / num; }
};

using Folded = std::vector<FoldedBin>;

Folded fold(const Profile& profile) {
  const std::size_t half = profile.bins.size() / 2;
  Folded folded(half);
  for (std::size_t k = 0; k < half; ++k) {
    folded[k].add(profile.bins[half + k], 1.0, profile.shape.unit_mps);
    folded[k].add(profile.bins[half - 1 - k], -1.0, profile.shape.unit_mps);
  }
  return folded;
}

struct Sample {
  double time = 0.0;
  Folded bins;
};

class ShockSamples {
 public:
  ShockSamples(const ShockCase& c, const ShockPlan& plan)
      : plan_(plan), density_(c.area_fraction / (0.25 * kPi)), width_(2.0 * plan.half_length / kShockBins) {}

  void add(double time, const Profile& profile) { samples_.push_back({time, fold(profile)}); }

  // Behind the front: the last quarter of the samples, away from the middle and from the front.
  FoldedBin plateau(double& area) const {
    FoldedBin sum;
    area = 0.0;
    for (std::size_t k = 3 * samples_.size() / 4; k < samples_.size(); ++k) {
      const double front = plan_.shock.front_speed * samples_[k].time;
      const std::size_t first = bin_at(kWarm * plan_.shock.front_speed * plan_.duration);
      const std::size_t last = bin_at(front - kFrontDepth * plan_.path);
      for (std::size_t bin = first; bin < last; ++bin) {
        sum += samples_[k].bins[bin];
        area += 2.0 * width_ * plan_.height;
      }
    }
    return sum;
  }

  // Position of a sharp front with the same number of parcels.
  double front(const Sample& sample, double ratio) const {
    double at = plan_.shock.front_speed * sample.time;
    for (int pass = 0; pass < 3; ++pass) {
      const std::size_t first = bin_at(at - kWindow * plan_.path), last = bin_at(at + kWindow * plan_.path);
      double excess = 0.0;
      for (std::size_t bin = first; bin < last; ++bin)
        excess += sample.bins[bin].num / (2.0 * width_ * plan_.height * density_) - 1.0;
      at = width_ * (static_cast<double>(first) + excess / (ratio - 1.0));
    }
    return at;
  }

  // Slope of the front's position over time, over all samples but the first quarter.
  double front_speed(double ratio) const {
    LineFit fit;
    for (std::size_t k = samples_.size() / 4; k < samples_.size(); ++k)
      fit.add(samples_[k].time, front(samples_[k], ratio));
    return fit.slope();
  }

  // Pressure in the middle over that ahead: the momentum that the gas near the middle gains, relative to the
  // gas ahead, per time and length. No equation of state enters for the gas behind.
  double pressure(double pressure_ahead) const {
    const Sample& first = samples_[samples_.size() / 4];
    const Sample& last = samples_.back();
    const double gained = momentum(last) - momentum(first);
    return 1.0 + gained / (2.0 * plan_.height * (last.time - first.time) * pressure_ahead);
  }

  json last_profile() const {
    json rows = json::array();
    constexpr std::size_t kTogether = 4;
    const Folded& bins = samples_.back().bins;
    for (std::size_t k = 0; k + kTogether <= end_bin(); k += kTogether) {
      FoldedBin sum;
      for (std::size_t j = 0; j < kTogether; ++j) sum += bins[k + j];
      rows.push_back({width_ * (static_cast<double>(k) + 0.5 * kTogether) / plan_.path,
                      sum.num / (2.0 * kTogether * width_ * plan_.height * density_), sum.away / sum.num,
                      sum.temperature()});
    }
    return rows;
  }

  double density() const { return density_; }

 private:
  std::size_t bin_at(double x) const {
    return static_cast<std::size_t>(std::clamp(x / width_, 0.0, 0.5 * kShockBins));
  }
  // Beyond the front and before the rarefaction at the end.
  std::size_t end_bin() const {
    return bin_at(plan_.shock.front_speed * plan_.duration + 0.06 * plan_.half_length);
  }
  double momentum(const Sample& sample) const {
    double sum = 0.0;
    for (std::size_t bin = 0; bin < end_bin(); ++bin)
      sum += sample.bins[bin].away + plan_.shock.gas_speed * sample.bins[bin].num;
    return sum;
  }

  ShockPlan plan_;
  double density_;  // parcels per area ahead
  double width_;    // of a bin
  std::vector<Sample> samples_;
};

// Each half gets a mean velocity towards the middle, exactly.
void throw_halves(ParcelSnapshot& state, double speed) {
  for (const bool right : {false, true}) {
    Vec2d mean;
    double num = 0.0;
    for (std::size_t i = 0; i < state.position.size(); ++i) {
      if ((state.position[i].x >= 0) != right) continue;
      mean += to_double(state.velocity[i]);
      num += 1.0;
    }
    const Vec2d change = Vec2d{right ? -speed : speed, 0.0} - mean * (1.0 / num);
    for (std::size_t i = 0; i < state.position.size(); ++i) {
      if ((state.position[i].x >= 0) == right)
        state.velocity[i] = to_float(to_double(state.velocity[i]) + change);
    }
  }
}

FlowScales scales_of(const ShockCase& c, const ShockPlan& plan) {
  const double hot = std::sqrt(plan.shock.temperature);
  const double behind = std::min(0.65, c.area_fraction * plan.shock.density);
  return {theory::collision_rate_per_s(behind, hot, 0.5), std::max(2.5 + plan.shock.gas_speed, 2.5 * hot),
          2.0 + plan.shock.gas_speed};
}

}  // namespace

json measure_shock(const ShockCase& c, const FlowSteps& steps, Backend& backend) {
  const ShockPlan plan = plan_shock(c);
  FlowRun run(shock_settings(c, plan), steps, backend);
  throw_halves(run.start(), plan.shock.gas_speed);
  run.begin(scales_of(c, plan));
  const double energy = run.energy();
  ShockSamples samples(c, plan);
  const ProfileShape shape = profile_shape(run.physics(), ProfileAxis::x, kShockBins);
  for (int k = 1; k <= kShockSamples; ++k) {
    run.advance(plan.duration / kShockSamples);
    samples.add(plan.duration * k / kShockSamples, backend.profile(shape));
  }
  double area = 0.0;
  const FoldedBin behind = samples.plateau(area);
  const double ratio = behind.num / (area * samples.density());
  const double pressure_ahead = samples.density() * theory::compressibility(c.area_fraction);
  const auto num = static_cast<double>(c.num_parcels);
  json row = {{"density", ratio},
              {"temperature", behind.temperature()},
              {"pressure", samples.pressure(pressure_ahead)},
              {"front_speed", samples.front_speed(ratio)},
              {"density_theory", plan.shock.density},
              {"temperature_theory", plan.shock.temperature},
              {"pressure_theory", plan.shock.pressure},
              {"front_speed_theory", plan.shock.front_speed},
              {"collisions", 2.0 * static_cast<double>(run.totals().num_collisions) / num},
              {"ns_per_disc_time", run.wall_ns() / (num * plan.duration)},
              {"energy_ratio", run.energy() / energy},
              {"max_overlap", run.totals().max_overlap_diameters},
              {"num_invalid", run.totals().num_invalid}};
  if (c.seed == 1) row["profile"] = samples.last_profile();
  return row;
}

}  // namespace pf
