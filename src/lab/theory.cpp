#include "lab/theory.hpp"

#include <cmath>

#include "core/portable_math.hpp"
#include "model/free_flow.hpp"
#include "model/kinetic_theory.hpp"
#include "model/measures.hpp"

namespace pf::theory {

double compressibility(double area_fraction) {
  constexpr double kA[13] = {
      1.0,           2.0,          1.12801775,    0.00181895291,  -0.0526134737, 0.0504960168,
      -0.0325537792, 0.0134578632, 0.00140888182, -0.00834273601, 0.00694127367, -0.00262254723,
      0.000355746352};
  const double x = area_fraction / (1.0 - area_fraction);
  double z = 0.0;
  for (int k = 12; k >= 0; --k) z = z * x + kA[k];
  return z - 5.24672938e-9 * std::pow(x, 22) + 5.88054639e-23 * std::pow(x, 57);
}

double contact_value(double area_fraction) {
  return (compressibility(area_fraction) - 1.0) / (2.0 * area_fraction);
}

double collision_rate_per_s(double area_fraction, double speed_mps, double radius_m) {
  return enskog_rate_per_s(area_fraction, speed_mps, radius_m) *
         (contact_value(area_fraction) / pf::contact_value(area_fraction));
}

double mean_free_path_m(double area_fraction, double radius_m) {
  return std::sqrt(0.5 * kPi) / collision_rate_per_s(area_fraction, 1.0, radius_m);
}

double sonine_a2(double e) {
  return 16.0 * (1.0 - e) * (1.0 - 2.0 * e * e) / (57.0 - 25.0 * e + 30.0 * e * e * (1.0 - e));
}

double cooled_fraction_by_collisions(double e, double num_collisions) {
  const double a2 = sonine_a2(e);
  const double per_collision = (1.0 + 3.0 * a2 / 16.0) / (1.0 - a2 / 16.0);
  return std::exp(-0.5 * (1.0 - e * e) * per_collision * num_collisions);
}

double cooled_fraction(double e, double initial_rate_per_s, double time_s) {
  const double rate = (1.0 - e * e) * initial_rate_per_s * (1.0 + 3.0 * sonine_a2(e) / 16.0);
  const double root = 1.0 + 0.25 * rate * time_s;
  return 1.0 / (root * root);
}

double kinematic_viscosity_m2ps(double area_fraction, double speed_mps, double radius_m) {
  const double chi = contact_value(area_fraction), b = 2.0 * area_fraction;
  const double dilute = 1.022 / (4.0 * radius_m) * speed_mps / std::sqrt(kPi);  // over the mass
  const double per_area = area_fraction / (kPi * radius_m * radius_m);
  return dilute * (1.0 / chi + b + 0.8729 * b * b * chi) / per_area;
}

namespace {

// Rates of a shear wave in units of the collision rate; radius and speed 1.
struct ShearWave {
  double damping;  // of its energy, 2 nu k^2
  double cooling;  // of the gas
};

ShearWave shear_wave(double eta, double e, double num_parcels, double num_waves_squared) {
  const double k2 =
      4.0 * kPi * eta / num_parcels * num_waves_squared;  // (2 pi / side)^2, side^2 = pi N / eta
  const double rate = collision_rate_per_s(eta, 1.0, 1.0);
  return {2.0 * kinematic_viscosity_m2ps(eta, 1.0, 1.0) * k2 / rate,
          0.5 * (1.0 - e * e) * (1.0 + 3.0 * sonine_a2(e) / 16.0)};
}

// For any N from 100 on, waves beyond this one decay within a tenth of the time between collisions.
constexpr int kMaxWaves = 12;

// Share of the energy that shear waves hold in excess and keep from one collision to the next.
double excess_share(double eta, double e, double num_parcels, double cooled) {
  double sum = 0.0;
  for (int x = -kMaxWaves; x <= kMaxWaves; ++x) {
    for (int y = -kMaxWaves; y <= kMaxWaves; ++y) {
      const double waves2 = x * x + y * y;
      if (waves2 == 0.0) continue;
      sum += shear_wave_excess(eta, e, num_parcels, waves2, cooled) *
             std::exp(-shear_wave(eta, e, num_parcels, waves2).damping);
    }
  }
  return sum / (2.0 * (num_parcels - 1.0));
}

}  // namespace

double shear_wave_excess(double area_fraction, double restitution, double num_parcels,
                         double num_waves_squared, double cooled) {
  const ShearWave wave = shear_wave(area_fraction, restitution, num_parcels, num_waves_squared);
  // d excess / d cooled = 1 - (damping / cooling - 1) excess.
  const double decay = wave.damping / wave.cooling - 1.0;
  return std::fabs(decay * cooled) < 1e-9 ? cooled : -std::expm1(-decay * cooled) / decay;
}

double cooled_fraction_in_box(double area_fraction, double restitution, double num_parcels,
                              double num_collision_times) {
  constexpr int kSteps = 64;  // of the midpoint rule; its error is 1e-5
  const double cooling = shear_wave(area_fraction, restitution, num_parcels, 1.0).cooling;
  const double dt = num_collision_times / kSteps;
  // `energy` is relative to the start; `cooled` is minus the log of the temperature that collisions see.
  const auto rate_of = [&](double energy, double share) {
    return cooling * std::sqrt(energy) * (1.0 - 1.5 * share);  // T^(3/2) / E
  };
  double energy = 1.0, cooled = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double first = rate_of(energy, excess_share(area_fraction, restitution, num_parcels, cooled));
    const double middle = energy * std::exp(-0.5 * dt * first);
    const double rate =
        rate_of(middle, excess_share(area_fraction, restitution, num_parcels, cooled + 0.5 * dt * first));
    energy *= std::exp(-dt * rate);
    cooled += dt * rate;
  }
  return energy;
}

double drag_specular(double s) { return drag_smooth(s, 1.0); }

double drag_smooth(double s, double e) { return smooth_drag(s, e); }

double drag_rough(double s, double e) { return drag_smooth(s, e) + incident_momentum_drag(s) / 3.0; }

double drag_diffuse(double s, double wall_over_gas) {
  return incident_momentum_drag(s) + 0.25 * kPi * std::sqrt(kPi) / s * std::sqrt(wall_over_gas);
}

double hit_factor(double s) { return free_flow_hits(s); }

double hits_per_s(double contact_m, double number_density_per_m2, double speed_mps, double speed_ratio) {
  return free_flow_hits_per_s(contact_m, number_density_per_m2, speed_mps, speed_ratio);
}

double spin_torque_n_m(double accommodation, double spin_radps, double radius_m, double hit_mass_kgps) {
  return -accommodation * spin_radps * radius_m * radius_m * hit_mass_kgps;
}

double transverse_force_n(double accommodation, double density_kg_m2, double contact_m, double radius_m,
                          double spin_radps, double speed_mps) {
  return -0.5 * accommodation * density_kg_m2 * kPi * contact_m * radius_m * spin_radps * speed_mps;
}

double jacobi_triple_gain(double theta_rad) {
  const double c2 = std::cos(theta_rad) * std::cos(theta_rad);
  return (1.0 - 2.0 * c2) * (1.0 - 2.0 * c2) + 2.0 * c2;
}

double euler_turn_gain(double theta_rad) { return std::sqrt(1.0 + theta_rad * theta_rad); }

}  // namespace pf::theory
