// Theory of a gas of hard discs and of a disc that flies through it: references of the lab. SI units. Area
// fraction eta = n pi r^2; c = sqrt(kT/m), speed per component; S = V / (sqrt(2) c), speed ratio of the ball.
// In a free-molecular gas the mean free path is much longer than the ball's radius.
#pragma once

namespace pf::theory {

// Z = P / (n kT) of the equilibrium fluid after Kolafa and Rottner, Mol. Phys. 104, 3435 (2006): error 1e-6
// up to area fraction 0.65, 1e-5 at 0.67. area_fraction: in [0, 0.69].
double compressibility(double area_fraction);

// Contact value chi of the pair distribution, from Z = 1 + 2 eta chi. area_fraction: in (0, 0.69].
double contact_value(double area_fraction);

// Collisions per parcel and second, after Enskog; as exact in equilibrium as the contact value.
double collision_rate_per_s(double area_fraction, double speed_mps, double radius_m);

double mean_free_path_m(double area_fraction, double radius_m);

// Excess of the fourth velocity moment of a cooling gas in two dimensions (van Noije and Ernst 1998).
double sonine_a2(double restitution);

// T / T0 of homogeneous cooling after num_collisions per parcel, counted: exp(-(1 - e^2) tau k / 2). The
// correction k is the energy lost per collision relative to a Maxwellian: (1 + 3 a2 / 16) of the cooling rate
// over (1 - a2 / 16) of the collision rate.
double cooled_fraction_by_collisions(double restitution, double num_collisions);

// T / T0 after time_s: Haff 1983 with the Sonine correction. initial_rate_per_s: Enskog's collision rate at
// T0.
double cooled_fraction(double restitution, double initial_rate_per_s, double time_s);

// Kinematic shear viscosity of parcels of temperature c^2 by Enskog's theory, constants of Gass 1971, J.
// Chem. Phys. 54, 1898.
double kinematic_viscosity_m2ps(double area_fraction, double speed_mps, double radius_m);

// Energy of a cooling gas in each shear wave of num_waves = |k| side / (2 pi) in a periodic square, in excess
// of equipartition and relative to it. The temperature has fallen by exp(-cooled) since equilibrium.
// Viscosity damps and stirs the wave, cooling lifts it (van Noije, Ernst, Brito and Orza 1997, Phys. Rev.
// Lett. 79, 411).
double shear_wave_excess(double area_fraction, double restitution, double num_parcels,
                         double num_waves_squared, double cooled);

// T / T0 of num_parcels in a periodic square after num_collision_times / (collision rate at T0): Haff's law
// with the Sonine correction. Collisions see a lower temperature than that of all motion, kT = K / (N - 1):
// shear waves hold the excess (Brito and Ernst 1998, Europhys. Lett. 43, 497). A wave counts with the share
// that survives the time between collisions. Valid above 100 parcels (corrections of 1 / N to rate, moments
// and freedoms cancel to 0.1 % at 200) and below the number from which clusters form.
double cooled_fraction_in_box(double area_fraction, double restitution, double num_parcels,
                              double num_collision_times);

// Free-molecular drag coefficients of a disc, F = Cd rho V^2 R_c, R_c = R + r (Schaaf and Chambre form). The
// limit of infinite S is cold_drag_coefficient in model/ball.hpp.
double drag_specular(double speed_ratio);                       // smooth, elastic
double drag_smooth(double speed_ratio, double restitution);     // smooth, heavy ball
double drag_rough(double speed_ratio, double restitution);      // no slip after the impact, heavy ball
double drag_diffuse(double speed_ratio, double wall_over_gas);  // wall temperature over gas temperature

// Hits per second over 2 R_c n V.
double hit_factor(double speed_ratio);
double hits_per_s(double contact_m, double number_density_per_m2, double speed_mps, double speed_ratio);

// Torque on a spinning rough ball of accommodation alpha. hit_mass_kgps: parcel mass times hits per second.
double spin_torque_n_m(double accommodation, double spin_radps, double radius_m, double hit_mass_kgps);
// Force along z x V, opposite to the Magnus force of a sphere in a dense gas (Weidman and Herczynski 2004).
double transverse_force_n(double accommodation, double density_kg_m2, double contact_m, double radius_m,
                          double spin_radps, double speed_mps);

// Z of a gas by area fraction. For the theory of flows a gas with e = p / (Z rho) = c^2; a constant Z is an
// ideal gas of heat ratio 1 + Z, so that published figures of such gases can check the code.
using EquationOfState = double (*)(double area_fraction);

// Sound speed over c: c_s^2 = c^2 (Z + eta Z' + Z^2).
double sound_speed(double area_fraction, EquationOfState z = compressibility);

// A steady shock: ratios of what is behind it to what is ahead of it, and speeds over c ahead of it.
struct Shock {
  double density = 1.0, pressure = 1.0, temperature = 1.0;
  double gas_speed = 0.0;    // change of the gas's velocity: of the piston, or of a gas thrown at a wall
  double front_speed = 0.0;  // relative to the gas behind it
};
// Rankine-Hugoniot relations with an equation of state. area_fraction: ahead, > 0. mach: > 1.
Shock shock_of(double area_fraction, double mach, EquationOfState z = compressibility);

// Pressure in front of a blunt body over that of the stream: a normal shock, then an isentropic stop
// (Rayleigh pitot formula for a constant Z).
double pitot_pressure_ratio(double area_fraction, double mach, EquationOfState z = compressibility);
// Mean over angles up to half_angle [rad] from the axis of the pressure on a round body, over the stream's,
// where on the axis it is `on_axis` of that: p = p1 + (p0 - p1) cos^2 (Lees 1955, modified Newtonian flow).
double pressure_around_axis(double on_axis, double half_angle);

// A strong blast in the plane, R = prefactor (E t^2 / rho)^(1/4), after Taylor, von Neumann and Sedov:
// Euler's equations in similarity form, with the gas ahead at rest and cold.
struct Blast {
  double density = 1.0;       // behind the front over ahead
  double energy_share = 0.0;  // alpha = E t^2 / (rho R^4)
  double prefactor = 0.0;     // alpha^(-1/4)
};
Blast strong_blast(double area_fraction, EquationOfState z = compressibility);

// Energy after over before if all impulses follow from the old state: an elastic parcel hits two resting ones
// at angles +- theta_rad from its path.
double jacobi_triple_gain(double theta_rad);

// Speed after over before of an explicit Euler step of a velocity that turns by theta_rad.
double euler_turn_gain(double theta_rad);

}  // namespace pf::theory
