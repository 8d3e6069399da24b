// The table of settings, one row each, by section of the scene file. Ranges exclude nonsense and overflow.
// derive_physics() checks combinations.
#include "model/methods.hpp"
#include "scene/settings.hpp"

namespace pf {
namespace {

constexpr double kMaxParcels = 1e9;
constexpr double kMaxSpeed = 1e5;
constexpr double kMaxText = 1000;

constexpr Effects kNothing{false, false, false};
constexpr Effects kNewParcels{true, true, true};
constexpr Effects kOtherParcels{true, true, false};  // new ones that cost the same
constexpr Effects kFlightAlone{false, true, false};
constexpr Effects kCostAlone{false, false, true};
constexpr Effects kNextLaunch = kNothing;  // in the present flight

// Names for an enumeration member of Settings.
template <auto kMember>
Choice choice(std::vector<std::string> names) {
  using Value = std::remove_cvref_t<decltype(Settings{}.*kMember)>;
  return {std::move(names), [](const Settings& s) { return static_cast<int>(s.*kMember); },
          [](Settings& s, int index) { s.*kMember = static_cast<Value>(index); }};
}

std::vector<Field> scene_and_world_fields() {
  return {
      {"scene", "description", "", "description of the scene", 0, kMaxText, &Settings::description, kNothing},
      {"world", "width_m", "m", "side along x, centred on the origin", 1e-3, 1e6, &Settings::width_m,
       kNewParcels},
      {"world", "height_m", "m", "side along y, centred on the origin", 1e-3, 1e6, &Settings::height_m,
       kNewParcels},
      {"world", "boundary", "", "at the edge, parcels leave, are reflected, or enter on the other side", 0, 0,
       choice<&Settings::boundary>({"open", "walls", "periodic"}), kNewParcels},
      {"world", "box_follows_parcels", "",
       "compute the area from number of parcels, radius and area fraction; the aspect is kept", 0, 0,
       &Settings::box_follows_parcels, kNewParcels},
  };
}

std::vector<Field> air_fields() {
  return {
      {"air", "kind", "", "model of the air; drag is in closed form, without parcels", 0, 0,
       choice<&Settings::air>({"vacuum", "drag", "parcels"}), kNewParcels},
      {"air", "num_parcels", "", "number of parcels; 0: num_parcels_cpu or num_parcels_gpu, by backend", 0,
       kMaxParcels, &Settings::num_parcels, kNewParcels},
      {"air", "num_parcels_cpu", "", "number of parcels on a CPU when num_parcels is 0", 1, kMaxParcels,
       &Settings::num_parcels_cpu, kNothing},
      {"air", "num_parcels_gpu", "", "number of parcels on a GPU when num_parcels is 0", 1, kMaxParcels,
       &Settings::num_parcels_gpu, kNothing},
      {"air", "area_fraction", "", "share of the area that parcels cover", 1e-12, 0.7,
       &Settings::area_fraction, kNewParcels},
      {"air", "areal_density_kg_m2", "kg/m^2", "mass of all parcels per area", 1e-12, 1e6,
       &Settings::areal_density_kg_m2, kNewParcels},
      {"air", "parcel_radius_m", "m", "parcel radius; 0: from area fraction and number", 0, 1e3,
       &Settings::parcel_radius_m, kNewParcels},
      {"air", "drawn_area_fraction", "",
       "draw parcels as if they covered this share of the area; 0: in true size", 0, 1,
       &Settings::drawn_area_fraction, kNothing},
      {"air", "parcel_mass_kg", "kg", "parcel mass; 0: from areal density and number", 0, 1e6,
       &Settings::parcel_mass_kg, kNewParcels},
      {"air", "parcel_speed_mps", "m/s", "standard deviation of each velocity component at the start", 0,
       kMaxSpeed, &Settings::parcel_speed_mps, kNewParcels},
      {"air", "flow_x_mps", "m/s", "mean velocity of the parcels along x", -kMaxSpeed, kMaxSpeed,
       &Settings::flow_x_mps, kNewParcels},
      {"air", "flow_y_mps", "m/s", "mean velocity of the parcels along y", -kMaxSpeed, kMaxSpeed,
       &Settings::flow_y_mps, kNewParcels},
      {"air", "hot_radius_m", "m", "radius of a hot disc in the middle; 0: none", 0, 1e6,
       &Settings::hot_radius_m, kNewParcels},
      {"air", "hot_speed_mps", "m/s",
       "standard deviation of each velocity component in the hot disc at the start", 0, kMaxSpeed,
       &Settings::hot_speed_mps, kNewParcels},
      {"air", "restitution", "", "normal speed after over before a collision, of parcels and ball", 0, 1,
       &Settings::restitution},
      {"air", "impulse_scale", "", "method impulse: factor on parcel-parcel impulses; 1 is correct physics",
       0, 10, &Settings::impulse_scale},
      {"air", "contacts", "", "parcels collide with each other", 0, 0, &Settings::contacts},
  };
}

std::vector<Field> ball_fields() {
  return {
      {"ball", "present", "", "the scene has a ball", 0, 0, &Settings::ball_present, kNewParcels},
      {"ball", "held", "", "hold the ball still; impulses on it are still summed", 0, 0,
       &Settings::ball_held},
      {"ball", "mass_kg", "kg", "mass of the ball", 1e-9, 1e6, &Settings::ball_mass_kg},
      {"ball", "radius_m", "m", "radius of the ball", 1e-6, 1e5, &Settings::ball_radius_m, kNewParcels},
      {"ball", "inertia", "", "moment of inertia: ring m R^2, sphere 2/3 m R^2, disk 1/2 m R^2", 0, 0,
       choice<&Settings::inertia>({"ring", "sphere", "disk"})},
      {"ball", "x_m", "m", "initial x of the ball, from the centre", -1e6, 1e6, &Settings::ball_x_m,
       kNextLaunch},
      {"ball", "y_m", "m", "initial y of the ball, from the centre", -1e6, 1e6, &Settings::ball_y_m,
       kNextLaunch},
      {"ball", "vx_mps", "m/s", "initial velocity of the ball along x", -kMaxSpeed, kMaxSpeed,
       &Settings::ball_vx_mps, kNextLaunch},
      {"ball", "vy_mps", "m/s", "initial velocity of the ball along y", -kMaxSpeed, kMaxSpeed,
       &Settings::ball_vy_mps, kNextLaunch},
      {"ball", "spin_radps", "rad/s", "initial spin of the ball, counter-clockwise seen from above", -1e5,
       1e5, &Settings::ball_spin_radps, kFlightAlone},
      {"ball", "friction", "", "Coulomb coefficient between ball and parcel", 0, 100, &Settings::friction},
      {"ball", "magnus", "", "spin bends the flight (Magnus effect)", 0, 0, &Settings::magnus},
      {"ball", "k_magnus", "kg", "Magnus factor k in acceleration = k (spin x velocity) / ball mass", -1e3,
       1e3, &Settings::k_magnus},
  };
}

std::vector<Field> run_fields() {
  return {
      {"run", "method", "", "collision method", 0, 0, choice<&Settings::method>(method_names())},
      {"run", "neighbors", "", "search for partners: sorted cells, or every pair (slow, for checks)", 0, 0,
       choice<&Settings::neighbors>({"grid", "all-pairs"}), kCostAlone},
      {"run", "dt_s", "s", "time step; 0: from displacement_per_step", 0, 1e3, &Settings::dt_s},
      {"run", "displacement_per_step", "diameters",
       "largest expected displacement of a parcel per step, when dt_s is 0", 1e-6, 100,
       &Settings::displacement_per_step},
      {"run", "substeps", "", "steps per frame; 0: from time_scale", 0, 1e6, &Settings::substeps},
      {"run", "max_substeps", "", "maximum steps per frame when substeps is 0", 1, 1e6,
       &Settings::max_substeps},
      {"run", "time_scale", "", "simulated over wall time; 0.1 is ten times slower", 1e-6, 100,
       &Settings::time_scale, kCostAlone},
      {"run", "frame_rate_hz", "Hz", "frames per second of wall time and of a film", 1, 1000,
       &Settings::frame_rate_hz},
      {"run", "frame_budget_ms", "ms",
       "time for the steps of a frame in a window, which then goes on in the next one and slows the flight; "
       "0: no limit",
       0, 1e6, &Settings::frame_budget_ms, kNothing},
      {"run", "seconds", "s", "length of a headless run's film; 0: until the ball leaves, but at most 60 s",
       0, 1e6, &Settings::seconds, kNothing},
      {"run", "seed", "", "seed of the random numbers", 0, kMaxExactInteger, &Settings::seed, kOtherParcels},
      {"run", "threads", "", "CPU threads; 0: all", 0, 1024, &Settings::threads, kCostAlone},
      {"run", "spring_contact_s", "s", "contact duration of method spring; 0: 20 steps", 0, 1e3,
       &Settings::spring_contact_s},
      {"run", "allow_unstable", "", "allow steps of method spring beyond its stability bound (--force)", 0, 0,
       &Settings::allow_unstable},
      {"run", "contact_clock", "mean free times",
       "exact: a collision this soon after the last one loses no energy (TC model), so that collapsing heaps "
       "do not stop time; 0: off",
       0, 10, &Settings::contact_clock},
      {"run", "contact_clock_s", "s", "the same in seconds; 0: from contact_clock", 0, 1e3,
       &Settings::contact_clock_s},
      {"run", "profile", "",
       "density, velocity and temperature along x, or by distance from the middle: in picture and report", 0,
       0, choice<&Settings::profile>({"off", "x", "radius"}), kNothing},
      {"run", "profile_bins", "", "bins of the profile", 1, kMaxProfileBins, &Settings::profile_bins,
       kNothing},
      {"run", "relaunch", "", "launch the ball again a second after it left the world", 0, 0,
       &Settings::relaunch, kNothing},
  };
}

std::vector<Field> view_fields() {
  return {
      {"view", "follow", "", "the camera keeps the ball in the middle", 0, 0, &Settings::follow_ball,
       kNothing},
      {"view", "magnifier", "", "a picture of the ball, magnified; auto: while the ball is small", 0, 0,
       choice<&Settings::magnifier>(kMagnifierNames), kNothing},
  };
}

std::vector<Field> all_fields() {
  std::vector<Field> all = scene_and_world_fields();
  for (const auto& part : {air_fields(), ball_fields(), run_fields(), view_fields()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

}  // namespace

const std::vector<Field>& fields() {
  static const std::vector<Field> table = all_fields();
  return table;
}

}  // namespace pf
