// What theory says of a gas of hard discs and of a disc that flies through it: the yardsticks of the lab.
// Units SI. area fraction eta = n pi r^2; c = sqrt(kT/m), speed per component; S = V / (sqrt(2) c), speed
// ratio of the ball. Free molecular means: mean free path much above the ball's radius.
#pragma once

namespace pf::theory {

// Z = P / (n kT) of the equilibrium fluid after Kolafa and Rottner, Mol. Phys. 104, 3435 (2006): 1e-6 up to
// area fraction 0.65, 1e-5 at 0.67; area fraction in [0, 0.69].
double compressibility(double area_fraction);

// Contact value of the pair distribution that belongs to it: Z = 1 + 2 eta chi. area fraction in (0, 0.69].
double contact_value(double area_fraction);

// Collisions per parcel and second, Enskog; exact in equilibrium, since the contact value is.
double collision_rate_per_s(double area_fraction, double speed_mps, double radius_m);

double mean_free_path_m(double area_fraction, double radius_m);

// Z from what a run measured: sum over collisions of |impulse| / m, in time_s, by num parcels of temperature
// c^2 (virial theorem). With total momentum zero c^2 = energy / (m (N - 1)).
double measured_compressibility(double impulse_sum_mps, double time_s, double num, double c2_m2ps2,
                                double diameter_m);

// Excess of the fourth moment of the velocities of a cooling gas, van Noije and Ernst 1998, two dimensions.
double sonine_a2(double restitution);

// T / T0 after num_collisions per parcel (counted, not times the initial rate) of homogeneous cooling:
// exp(-(1 - e^2) tau (1 + 3 a2 / 16) / 2). The correction is that of the energy lost per collision, relative
// to that of a Maxwellian: (1 + 3 a2 / 16) of the cooling rate over (1 - a2 / 16) of the collision rate.
double cooled_fraction_by_collisions(double restitution, double num_collisions);

// T / T0 after time_s: Haff 1983 with the Sonine correction. initial_rate_per_s: collision rate at T0 by
// Enskog.
double cooled_fraction(double restitution, double initial_rate_per_s, double time_s);

// Kinematic shear viscosity of parcels of temperature c^2 by Enskog's theory, constants of Gass 1971, J.
// Chem. Phys. 54, 1898.
double kinematic_viscosity_m2ps(double area_fraction, double speed_mps, double radius_m);

// What a cooling gas in a periodic square has in each shear wave of num_waves = |k| side / (2 pi), over what
// equipartition gives it, after its temperature fell by exp(-cooled), from equilibrium on: viscosity damps
// the wave and stirs it, cooling lifts it (van Noije, Ernst, Brito and Orza 1997, Phys. Rev. Lett. 79, 411).
double shear_wave_excess(double area_fraction, double restitution, double num_parcels,
                         double num_waves_squared, double cooled);

// T / T0 of num_parcels in a periodic square after num_collision_times / (collision rate at T0): Haff's law
// with the Sonine correction, where the temperature that collisions see is lower than that of all motion
// (kT = K / (N - 1)) by what shear waves hold in excess (Brito and Ernst 1998, Europhys. Lett. 43, 497). A
// wave counts by what of it is left after a time between collisions. The numbers of parcels that this is for
// are above 100 (corrections of 1 / N to rate, moments and freedoms cancel to 0.1 % at 200), and below that
// of clusters.
double cooled_fraction_in_box(double area_fraction, double restitution, double num_parcels,
                              double num_collision_times);

// Share of collisions that a test for overlap at the end of each step does not see: a pair moves by
// step_diameters contact distances (relative) per step. Exact: Delta^2 / 24 for small Delta, 1 - pi / (2
// Delta) from 2 on.
double missed_fraction(double step_diameters);

// Free-molecular drag coefficients of a disc, F = Cd rho V^2 R_c, R_c = R + r (Schaaf and Chambre form). S to
// infinity: cold_drag_coefficient in model/ball.hpp.
double drag_specular(double speed_ratio);                       // smooth, elastic
double drag_smooth(double speed_ratio, double restitution);     // smooth, heavy ball
double drag_rough(double speed_ratio, double restitution);      // no slip after the impact, heavy ball
double drag_diffuse(double speed_ratio, double wall_over_gas);  // wall temperature over gas temperature

// M^ / (2 S): hits per second over 2 R_c n V.
double hit_factor(double speed_ratio);
double hits_per_s(double contact_m, double number_density_per_m2, double speed_mps, double speed_ratio);

// On a rough ball of accommodation alpha that spins. hit_mass_kgps: parcel mass times hits per second.
double spin_torque_n_m(double accommodation, double spin_radps, double radius_m, double hit_mass_kgps);
// Along z x V: opposite to the Magnus force of a sphere in a dense gas (Weidman and Herczynski 2004).
double transverse_force_n(double accommodation, double density_kg_m2, double contact_m, double radius_m,
                          double spin_radps, double speed_mps);

// Energy after over before, when all impulses are taken from the old state: an elastic parcel runs into two
// resting ones at angles +- theta_rad of its path.
double jacobi_triple_gain(double theta_rad);

// Speed after over before of one explicit Euler step of a velocity turning by theta_rad.
double euler_turn_gain(double theta_rad);

}  // namespace pf::theory
