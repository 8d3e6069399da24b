// All settings, in the units of the user interface, and the table that describes them. Scene files, --set,
// --help, the panel's ranges and saved scenes read this table.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "model/physics.hpp"
#include "model/profile.hpp"

namespace pf {

// automatic: while the ball is small in the picture.
enum class MagnifierMode : std::uint8_t { automatic, on, off };
inline const std::vector<std::string> kMagnifierNames = {"auto", "on", "off"};
enum class Inertia : std::uint8_t { ring, sphere, disk };  // I = m R^2, 2/3 m R^2, 1/2 m R^2

struct Settings {
  // scene
  std::string name = "court";
  std::string description;
  // world
  double width_m = 13.4;
  double height_m = 6.1;
  Boundary boundary = Boundary::open;
  bool box_follows_parcels = false;  // area from N, parcel radius and area fraction; the aspect is kept
  // air
  Air air = Air::parcels;
  std::int64_t num_parcels = 0;  // 0: num_parcels_cpu or num_parcels_gpu, by backend
  std::int64_t num_parcels_cpu = 20000;
  std::int64_t num_parcels_gpu = 1000000;
  double area_fraction = 0.1;
  double areal_density_kg_m2 = 1.76e-3;
  double parcel_radius_m = 0.0;      // 0: from area fraction and N
  double drawn_area_fraction = 0.0;  // for the renderer alone; 0: parcels are drawn in true size
  double parcel_mass_kg = 0.0;       // 0: from areal density and N
  double parcel_speed_mps = 1.0;     // standard deviation per component
  double flow_x_mps = 0.0;
  double flow_y_mps = 0.0;
  double hot_radius_m = 0.0;  // of a disc in the middle whose parcels start with hot_speed_mps
  double hot_speed_mps = 0.0;
  double restitution = 0.9;
  double impulse_scale = 1.0;
  bool contacts = true;
  // ball
  bool ball_present = true;
  bool ball_held = false;
  double ball_mass_kg = 0.026;
  double ball_radius_m = 0.185;
  Inertia inertia = Inertia::sphere;
  double ball_x_m = -6.4;
  double ball_y_m = -1.4;
  double ball_vx_mps = 15.0;
  double ball_vy_mps = 0.0;
  double ball_spin_radps = 25.0;
  double friction = 0.3;
  bool magnus = true;
  double k_magnus = 0.0005;  // a = k_M (omega x v) / m_b
  // run
  Method method = Method::impulse;
  Neighbors neighbors = Neighbors::grid;
  double dt_s = 0.0;                    // 0: from displacement_per_step
  double displacement_per_step = 0.25;  // largest expected displacement of a parcel per step, in diameters
  std::int64_t substeps = 0;            // steps per frame; 0: from time_scale, at most max_substeps
  std::int64_t max_substeps = 32;
  double time_scale = 0.1;  // simulated over wall time
  double frame_rate_hz = 60.0;
  double frame_budget_ms = 50.0;  // of a window: time of a frame's steps before the flight is slowed; 0: none
  double seconds = 0.0;           // length of a headless run at frame_rate_hz; 0: until the ball leaves
  std::int64_t seed = 1;
  std::int64_t threads = 0;       // 0: all
  double spring_contact_s = 0.0;  // contact duration of `spring`; 0: 20 steps
  bool allow_unstable = false;    // `spring` may take steps beyond its stability bound
  double contact_clock = 1e-3;    // contact duration of the TC model in `exact`, mean free times
  double contact_clock_s = 0.0;   // the same in seconds; 0: from contact_clock
  ProfileAxis profile = ProfileAxis::off;
  std::int64_t profile_bins = 128;
  bool relaunch = true;  // launch the ball again a second after it left the world
  // view
  bool follow_ball = false;  // the camera keeps the ball in the middle
  MagnifierMode magnifier = MagnifierMode::automatic;

  bool operator==(const Settings&) const = default;
};

// Names of an enumeration's values, in their order, and access to the value as an index.
struct Choice {
  std::vector<std::string> names;
  int (*get)(const Settings&);
  void (*set)(Settings&, int);
};

// The effects of a changed setting on a flight.
struct Effects {
  bool parcels = false;  // new ones are spawned
  bool flight = true;    // the state from then on; false also if it counts from the next launch on
  bool cost = true;      // what a step costs
};

// One row per setting.
struct Field {
  std::string section;  // of the scene file
  std::string key;      // --set and messages use `section.key`
  std::string unit;     // "" if a pure number
  std::string doc;      // one line
  double min = 0.0;     // allowed range of a number, ends included
  double max = 0.0;
  std::variant<double Settings::*, std::int64_t Settings::*, bool Settings::*, std::string Settings::*,
               Choice>
      member;
  Effects effects{};

  std::string path() const { return section + "." + key; }
};

const std::vector<Field>& fields();

// A double represents every whole number up to this one: the ends of a field's range are doubles.
constexpr double kMaxExactInteger = 0x1p53;

// Formats a limit for people: 0.7, 20 million, 1 billion, 2^53.
std::string limit_text(double limit);
// The allowed range of a number without its unit, as "0 to 1 billion".
std::string range_text(const Field& field);

// A field's value as text, as in a scene file (strings without quotes).
std::string value_text(const Field& field, const Settings& settings);
// path: "section.key" of a field.
std::string value_text(const std::string& path, const Settings& settings);
// Formats the value with five digits, for people.
std::string short_value_text(const Field& field, const Settings& settings);

// Compares and copies a field without going through text.
bool is_same(const Field& field, const Settings& a, const Settings& b);
void copy_field(const Field& field, const Settings& from, Settings& to);

// Returns whether the two differ in a setting with that effect.
bool differ(const Settings& a, const Settings& b, bool Effects::*effect);
// The settings with that effect; all others have their defaults.
Settings only(const Settings& settings, bool Effects::*effect);

// Sets a field from text. where: place for the message, such as "--set air.restitution" or "court.toml:12".
// Throws UserError (place, value, allowed range, remedy) if the text is malformed, NaN, or out of range.
void set_from_text(const Field& field, Settings& settings, const std::string& text, const std::string& where);

// Checks that every number of `settings` is finite and in the range of its field, for settings that were not
// read from text. Throws UserError as set_from_text() does. where: see there.
void check_settings(const Settings& settings, const std::string& where);

// The field named `section.key`. Throws UserError with the nearest known name. where: see set_from_text().
const Field& find_field(std::string_view path, std::string_view where);

// The name nearest to `name` by edit distance, for messages; empty if none is near: if more than two letters
// and two of five are wrong. names: not empty.
std::string nearest_name(const std::string& name, const std::vector<std::string>& names);
// The same with `before` and `after` around it, or nothing.
std::string say_nearest(std::string_view before, const std::string& name,
                        const std::vector<std::string>& names, std::string_view after = "");

}  // namespace pf
