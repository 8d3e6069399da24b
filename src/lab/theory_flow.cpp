// Theory of flows: shocks, the stop in front of a blunt body, blasts.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/portable_math.hpp"
#include "lab/theory.hpp"

namespace pf::theory {
namespace {

// Kolafa and Rottner's fit ends near here (docs/physics.md, 'Equation of state').
constexpr double kMaxAreaFraction = 0.69;

// d Z / d eta.
double slope_of(EquationOfState z, double eta) {
  const double h = 1e-5 * eta;
  return (z(eta + h) - z(eta - h)) / (2.0 * h);
}

// State behind a shock of this density ratio, from the conservation laws; inflow2: squared speed of the gas
// ahead relative to the front, over c^2. Infinite where no shock is that strong.
struct Jump {
  double temperature = INFINITY, pressure = INFINITY, inflow2 = INFINITY;
};

Jump jump_of(double eta, double density, EquationOfState z) {
  const double ahead = z(eta), behind = z(eta * density);
  const double room = 1.0 - 0.5 * behind * (density - 1.0);
  if (room <= 0.0) return {};
  Jump jump;
  jump.temperature = (1.0 + 0.5 * ahead * (1.0 - 1.0 / density)) / room;
  jump.pressure = density * jump.temperature * behind / ahead;
  jump.inflow2 = ahead * (jump.pressure - 1.0) / (1.0 - 1.0 / density);
  return jump;
}

// Largest density ratio at which is_below(ratio) holds, by bisection. is_below: monotone.
template <class IsBelow>
double density_ratio(double eta, const IsBelow& is_below) {
  double low = 1.0, high = std::min(100.0, kMaxAreaFraction / eta);
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (low + high);
    (is_below(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

double sound_speed(double area_fraction, EquationOfState z) {
  const double value = z(area_fraction);
  return std::sqrt(value + area_fraction * slope_of(z, area_fraction) + value * value);
}

Shock shock_of(double area_fraction, double mach, EquationOfState z) {
  const double inflow = mach * sound_speed(area_fraction, z);
  const double density = density_ratio(area_fraction, [&](double ratio) {
    return jump_of(area_fraction, std::max(ratio, 1.0 + 1e-12), z).inflow2 < inflow * inflow;
  });
  const Jump jump = jump_of(area_fraction, density, z);
  return {density, jump.pressure, jump.temperature, inflow * (1.0 - 1.0 / density), inflow / density};
}

double pitot_pressure_ratio(double area_fraction, double mach, EquationOfState z) {
  constexpr double kStep = 1e-4;  // of the logarithm of the density; the error is below 1e-6
  const Shock shock = shock_of(area_fraction, mach, z);
  const auto enthalpy = [&](double eta, double c2) { return c2 * (1.0 + z(eta)); };
  double eta = area_fraction * shock.density, c2 = shock.temperature;
  const double total = enthalpy(eta, c2) + 0.5 * shock.front_speed * shock.front_speed;
  while (true) {  // d ln c^2 = Z d ln rho along an isentrope
    const double middle = z(eta * std::exp(0.5 * kStep));
    const double next_eta = eta * std::exp(kStep), next_c2 = c2 * std::exp(kStep * middle);
    const double now = enthalpy(eta, c2), next = enthalpy(next_eta, next_c2);
    if (next >= total) {
      const double share = (total - now) / (next - now);
      const double pressure = eta * c2 * z(eta), next_pressure = next_eta * next_c2 * z(next_eta);
      return (pressure + share * (next_pressure - pressure)) / (area_fraction * z(area_fraction));
    }
    eta = next_eta;
    c2 = next_c2;
  }
}

double pressure_around_axis(double on_axis, double half_angle) {
  return 1.0 + (on_axis - 1.0) * (0.5 + 0.25 * std::sin(2.0 * half_angle) / half_angle);
}

namespace {

// Behind the front, at xi = r / R: velocity over the front's, log of the density over that ahead, log of c^2
// over the front's speed squared.
using SimilarState = std::array<double, 3>;

// d profile / d ln xi: conservation of mass, momentum and energy.
SimilarState slope_of(const SimilarState& at, double xi, double eta, EquationOfState z) {
  const double density = std::exp(at[1]), c2 = std::exp(at[2]), here = eta * density;
  const double value = z(here), steepness = here > 0.0 ? here * slope_of(z, here) : 0.0;
  const double flow = at[0] - xi;  // relative to the similar point
  // mass: v' + flow g' = -v / xi; energy: t' = Z g' + 2 / flow; momentum: flow v' + c2 ((Z + eta Z') g' + Z
  // t') = v.
  const double of_g = -flow * flow + c2 * (value + steepness + value * value);
  const double g = (at[0] + flow * at[0] / xi - 2.0 * c2 * value / flow) / of_g;
  return {xi * (-at[0] / xi - flow * g), xi * g, xi * (value * g + 2.0 / flow)};
}

SimilarState moved(const SimilarState& from, const SimilarState& slope, double step) {
  SimilarState to = from;
  for (std::size_t k = 0; k < to.size(); ++k) to[k] += step * slope[k];
  return to;
}

SimilarState runge_kutta_step(const SimilarState& at, double log_xi, double step, double eta,
                              EquationOfState z) {
  const auto slope = [&](const SimilarState& profile, double share) {
    return slope_of(profile, std::exp(log_xi + share * step), eta, z);
  };
  const SimilarState a = slope(at, 0.0), b = slope(moved(at, a, 0.5 * step), 0.5);
  const SimilarState c = slope(moved(at, b, 0.5 * step), 0.5), d = slope(moved(at, c, step), 1.0);
  SimilarState next = at;
  for (std::size_t k = 0; k < next.size(); ++k)
    next[k] += step / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
  return next;
}

// Energy per ln xi, kinetic and thermal.
double energy_density(const SimilarState& at, double xi) {
  return (0.5 * std::exp(at[1]) * at[0] * at[0] + std::exp(at[1] + at[2])) * xi * xi;
}

}  // namespace

Blast strong_blast(double area_fraction, EquationOfState z) {
  constexpr int kSteps = 20000;
  constexpr double kLogEnd = -7.0;  // further in, the pressure is constant
  Blast blast;
  blast.density = density_ratio(
      area_fraction, [&](double ratio) { return 0.5 * z(area_fraction * ratio) * (ratio - 1.0) < 1.0; });
  const double speed = 1.0 - 1.0 / blast.density;
  SimilarState at{speed, std::log(blast.density),
                  std::log(speed / (blast.density * z(area_fraction * blast.density)))};
  const double step = kLogEnd / kSteps;
  double energy = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const SimilarState next = runge_kutta_step(at, k * step, step, area_fraction, z);
    energy -= 0.5 * step *
              (energy_density(at, std::exp(k * step)) + energy_density(next, std::exp((k + 1) * step)));
    at = next;
  }
  energy += 0.5 * energy_density(at, std::exp(kLogEnd));
  blast.energy_share = 0.5 * kPi * energy;  // front speed R / 2t
  blast.prefactor = std::pow(blast.energy_share, -0.25);
  return blast;
}

}  // namespace pf::theory
