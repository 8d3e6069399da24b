#include "data/run_state_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/input_log.hpp"
#include "app/json_number.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

using nlohmann::json;

// null stands for NaN.
struct Storing {
  json& to;
  void operator()(const char* key, double value) { to[key] = number_or_null(value); }
  void operator()(const char* key, Vec2d value) {
    to[key] = {number_or_null(value.x), number_or_null(value.y)};
  }
  void operator()(const char* key, const std::optional<double>& value) {
    if (value) to[key] = number_or_null(*value);
  }
  template <class T>
  void operator()(const char* key, const T& value) {
    if constexpr (std::is_enum_v<T>)
      to[key] = static_cast<int>(value);
    else
      to[key] = value;
  }
  void time(const char* key, const auto& value) { (*this)(key, value); }
  void if_known(const char* key, const auto& value) { (*this)(key, value); }
  void velocity(const char* key, Vec2d value) { (*this)(key, value); }
  void at_most(std::uint32_t, const char* key, std::uint32_t value) { (*this)(key, value); }
};

constexpr std::uint64_t last_of(Air) { return static_cast<std::uint64_t>(Air::parcels); }
constexpr std::uint64_t last_of(Method) { return kMethods.size() - 1; }

// Refuses whatever the program would not have written.
class Reading {
 public:
  // name: of the part, for messages that begin with `where`.
  Reading(const json& from, const char* name, const std::string& where)
      : from_(from), name_(name), where_(where) {}

  void operator()(const char* key, double& value) const { value = number(key, at(key)); }
  void operator()(const char* key, Vec2d& value) const {
    const json& pair = at(key);
    if (!pair.is_array() || pair.size() != 2) refuse(key, "a pair of numbers");
    value = {number(key, pair[0]), number(key, pair[1])};
  }
  void operator()(const char* key, std::optional<double>& value) const {
    value.reset();
    if (from_.contains(key)) value = number(key, at(key));
  }
  template <class T>
  void operator()(const char* key, T& value) const {
    // Counts are not negative. The ball's tick counts from now.
    constexpr std::int64_t kMin = std::is_same_v<T, std::int32_t> ? INT32_MIN : 0;
    if constexpr (std::is_same_v<T, bool>) {
      if (!at(key).is_boolean()) refuse(key, "true or false");
      value = at(key).template get<bool>();
    } else if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(whole(key, kMin, last_of(T{})));
    } else {
      value = static_cast<T>(whole(key, kMin, std::numeric_limits<T>::max()));
    }
  }
  // Leaves what older files lack as it is.
  void if_known(const char* key, auto& value) const {
    if (from_.contains(key)) (*this)(key, value);
  }
  // Reads a time or a duration, which must not be negative.
  void time(const char* key, double& value) const {
    (*this)(key, value);
    if (!(value >= 0.0)) refuse(key, "a number that is not negative");
  }
  void time(const char* key, std::optional<double>& value) const {
    (*this)(key, value);
    if (value && !(*value >= 0.0)) refuse(key, "a number that is not negative");
  }
  // Reads a velocity that settings may have.
  void velocity(const char* key, Vec2d& value) const {
    const double max_mps = find_field("ball.vx_mps", where_).max;
    (*this)(key, value);
    if (!(std::fabs(value.x) <= max_mps && std::fabs(value.y) <= max_mps))
      refuse(key, fmt::format("a pair of numbers of at most {:g}", max_mps));
  }
  void at_most(std::uint32_t limit, const char* key, std::uint32_t& value) const {
    value = static_cast<std::uint32_t>(whole(key, 0, limit));
  }

 private:
  [[noreturn]] void fail(const char* key, const std::string& reason) const {
    throw UserError(
        fmt::format("{}: the state of the run is damaged: {}.{} {}; give an earlier checkpoint, or another "
                    "frame of a dump",
                    where_, name_, key, reason));
  }
  [[noreturn]] void refuse(const char* key, const std::string& allowed) const {
    const std::string value = at(key).dump(-1, ' ', false, json::error_handler_t::replace);
    fail(key, fmt::format("is {}, and must be {}", in_quotes(value), allowed));
  }
  const json& at(const char* key) const {
    const auto found = from_.find(key);
    if (found == from_.end()) fail(key, "is missing");
    return *found;
  }
  double number(const char* key, const json& stored) const {
    if (stored.is_null()) return std::numeric_limits<double>::quiet_NaN();
    if (!stored.is_number()) refuse(key, "a number, or null");
    return stored.get<double>();
  }
  // A number from min, at most 0, to max. A negative one comes back modulo 2^64.
  std::uint64_t whole(const char* key, std::int64_t min, std::uint64_t max) const {
    const json& stored = at(key);
    const bool fits = stored.is_number_unsigned()
                          ? stored.get<std::uint64_t>() <= max
                          : stored.is_number_integer() && stored.get<std::int64_t>() >= min;
    if (!fits) refuse(key, fmt::format("a whole number from {} to {}", min, max));
    return stored.get<std::uint64_t>();
  }

  const json& from_;
  const char* name_;
  const std::string& where_;
};

// ---- what is stored, once for both directions

template <class Archive, class Ball>
void visit_ball(Archive& a, Ball& ball) {
  a("position_m", ball.position_m);
  a("velocity_mps", ball.velocity_mps);
  a("spin_radps", ball.spin_radps);
  a("angle_rad", ball.angle_rad);
}

template <class Archive, class Exact>
void visit_exact(Archive& a, Exact& exact) {
  a("now", exact.now);
  a.at_most(kMaxTickExponent, "tick_exponent", exact.tick_exponent);
  a("ball_holds", exact.ball_holds);
  a("ball_anchor_units", exact.ball.anchor_units);
  a("ball_velocity_mps", exact.ball.velocity_mps);
  a("ball_spin_radps", exact.ball.spin_radps);
  a("ball_tick", exact.ball.tick);
}

template <class Archive, class Totals>
void visit_totals(Archive& a, Totals& totals) {
  a("num_steps", totals.num_steps);
  a("num_collisions", totals.num_collisions);
  a("num_ball_hits", totals.num_ball_hits);
  a("num_retired", totals.num_retired);
  a("num_invalid", totals.num_invalid);
  a("first_invalid_step", totals.first_invalid_step);
  a("first_invalid_id", totals.first_invalid_id);
  a("impulse_sum_mps", totals.impulse_sum_mps);
  a("max_overlap_diameters", totals.max_overlap_diameters);
  a("num_sorts", totals.num_sorts);
  a("num_rounds", totals.num_rounds);
  a("num_events", totals.num_events);
  a("num_solved_events", totals.num_solved_events);
  a("largest_cluster", totals.largest_cluster);
  a("num_retried_steps", totals.num_retried_steps);
  a("event_hash", totals.event_hash);
  a("ball_impulse_kg_mps", totals.ball_impulse_kg_mps);
  a("ball_torque_impulse_kg_m2ps", totals.ball_torque_impulse_kg_m2ps);
}

template <class Archive, class Record>
void visit_flight(Archive& a, Record& flight) {
  a("number", flight.number);
  a("launch", flight.launch);
  a("fresh_air", flight.fresh_air);
  a("disturbed", flight.disturbed);
  a("air", flight.air);
  a("method", flight.method);
  a.time("set_dt_s", flight.set_dt_s);
  a("half_step", flight.half_step);
  a.time("dt_s", flight.dt_s);
  a.velocity("launch_mps", flight.launch_mps);
  a("spin_radps", flight.spin_radps);
  a("num_steps", flight.num_steps);
  a.time("compute_ms", flight.compute_ms);
  a("start_energy_j", flight.start_energy_j);
  a("end_energy_j", flight.end_energy_j);
}

template <class Archive, class Initial>
void visit_initial(Archive& a, Initial& initial) {
  a("parcel_energy_j", initial.parcel_energy_j);
  a("ball_energy_j", initial.ball_energy_j);
  a("momentum_kg_mps", initial.momentum_kg_mps);
  a.if_known("ball_momentum_kg_mps", initial.ball_momentum_kg_mps);
  a("momentum_scale_kg_mps", initial.momentum_scale_kg_mps);
  a("num_live", initial.num_live);
}

template <class Archive, class State>
void visit_run(Archive& a, State& state) {
  a("step", state.backend.parcels.step);
  a("ball_was_set", state.backend.ball_was_set);
  a.time("exact_s", state.backend.exact_s);
  a("air_seed", state.air_seed);
  a("flight_seed", state.flight_seed);
  a.time("simulated_s", state.simulated_s);
  a.time("shown_s", state.shown_s);
  a.time("launched_at_s", state.launched_at_s);
  a.time("landed_for_s", state.landed_for_s);
  a("ball_distance_m", state.ball_distance_m);
  a("collision_rate_per_s", state.collision_rate_per_s);
  a("num_launches", state.num_launches);
  a("num_flights", state.num_flights);
  a("last_number", state.last_number);
  a("landed", state.landed);
  a("left_once", state.left_once);
  a("by_hand", state.by_hand);
  a("paused", state.paused);
  a.time("scene_dt_s", state.scene_dt_s);
  a("watched_energy_j", state.watched.start_j);
  a.if_known("watched_frames", state.watched.num_frames);
  a.if_known("watched_told", state.watched.has_told);
  a("num_frames", state.num_frames);
  a("frames_after_flight", state.frames_after_flight);
}

template <class Part, class Visit>
json part_of(const Part& part, const Visit& visit) {
  json object = json::object();
  Storing storing{object};
  visit(storing, part);
  return object;
}

// Calls apply(name, part, visit) for each part that is written and read alike.
template <class State, class Do>
void for_each_part(State& state, const Do& apply) {
  apply("run", state, [](auto& a, auto& s) { visit_run(a, s); });
  apply("ball", state.backend.ball, [](auto& a, auto& s) { visit_ball(a, s); });
  apply("totals", state.totals, [](auto& a, auto& s) { visit_totals(a, s); });
  apply("flight", state.flight, [](auto& a, auto& s) { visit_flight(a, s); });
  apply("initial", state.initial, [](auto& a, auto& s) { visit_initial(a, s); });
}

}  // namespace

std::vector<std::string> settings_lines(const Settings& settings) {
  std::vector<std::string> lines;
  for (const Field& field : fields()) lines.push_back(edit_text(field, settings));
  return lines;
}

std::string run_state_text(const RunState& state, const std::vector<std::string>& base) {
  json object = {{"scene", state.settings.name}, {"settings", json::array()}};
  const std::vector<std::string> lines = settings_lines(state.settings);
  for (const std::string& line : lines) {
    if (std::find(base.begin(), base.end(), line) == base.end()) object["settings"].push_back(line);
  }
  for_each_part(state, [&](const char* name, const auto& part, const auto& visit) {
    object[name] = part_of(part, visit);
  });
  const auto visit = [](auto& a, auto& s) { visit_exact(a, s); };
  if (state.backend.exact.active) object["exact"] = part_of(state.backend.exact, visit);
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

RunState run_state_from_text(const std::string& text, const std::vector<std::string>& base,
                             const std::string& where, RunState state) {
  try {
    const json object = json::parse(text);
    state.settings.name = object.at("scene").get<std::string>();
    apply_edits(base, state.settings, where);
    apply_edits(object.at("settings").get<std::vector<std::string>>(), state.settings, where);
    const auto read = [&](const char* name, auto& part, const auto& visit) {
      Reading reading(object.at(name), name, where);
      visit(reading, part);
    };
    for_each_part(state, read);
    ExactSnapshot& exact = state.backend.exact;
    exact.active = object.contains("exact");
    if (exact.active) read("exact", exact, [](auto& a, auto& s) { visit_exact(a, s); });
  } catch (const json::exception&) {
    throw UserError(fmt::format(
        "{}: does not have the state of a run; give a file that --checkpoint or --dump wrote", where));
  }
  return state;
}

}  // namespace pf
