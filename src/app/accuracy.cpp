#include "app/accuracy.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/accuracy_table.hpp"
#include "app/option_values.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// The errors due to the method and to the number of parcels are independent: 0.8^2 + 0.6^2 = 1.
constexpr double kMethodShare = 0.8, kParcelsShare = 0.6;
constexpr double kMaxParcels = 1e6;

// Both errors together.
double error_of(const AccuracyChoice& choice) {
  return std::hypot(choice.expected_error, choice.parcels_error);
}

std::optional<TableEntry> cheapest(const std::vector<TableEntry>& entries) {
  if (entries.empty()) return std::nullopt;
  return *std::min_element(entries.begin(), entries.end(),
                           [](const TableEntry& a, const TableEntry& b) { return a.cost < b.cost; });
}

// Returns the longest step up to max_displacement that meets the error together with all shorter ones: an
// error that happens to cross zero at a long step is no accuracy.
std::optional<TableEntry> longest_within(const std::vector<TableEntry>& entries, double error,
                                         double max_displacement = INFINITY) {
  std::optional<TableEntry> longest;
  for (const TableEntry& entry : entries) {
    if (entry.error > error || entry.displacement > max_displacement * (1.0 + 1e-9)) break;
    longest = entry;
  }
  return longest;
}

// Raises error and cost to those of a ladder at this step, or at its next longer one.
void raise_to(TableEntry& entry, const std::vector<TableEntry>& ladder, bool with_cost) {
  for (const TableEntry& other : ladder) {
    if (other.displacement < entry.displacement * (1.0 - 1e-9)) continue;
    if (other.error > entry.error) {
      entry.error = other.error;
      entry.is_bound = other.is_bound;
    }
    if (with_cost) entry.cost = std::max(entry.cost, other.cost);
    return;
  }
}

// The entry that a method needs in all of the cases: the shortest of their steps, with the largest error and
// cost that any case has there. layer: its errors in the layer in front of a ball, which it has to meet, too;
// empty if there is none. Method `exact` has no error due to the step.
std::optional<TableEntry> entry_for_all(const std::vector<std::vector<TableEntry>>& ladders,
                                        const std::vector<TableEntry>& layer, Method method, double error) {
  double max_displacement = INFINITY;
  if (!layer.empty() && method != Method::exact) {
    const auto longest = longest_within(layer, error);
    if (!longest) return std::nullopt;
    max_displacement = longest->displacement;
  }
  std::optional<TableEntry> shortest;
  for (const std::vector<TableEntry>& ladder : ladders) {
    const auto entry =
        method == Method::exact ? cheapest(ladder) : longest_within(ladder, error, max_displacement);
    if (!entry) return std::nullopt;
    if (!shortest || entry->displacement < shortest->displacement) shortest = entry;
  }
  for (const std::vector<TableEntry>& ladder : ladders) raise_to(*shortest, ladder, true);
  if (method != Method::exact) raise_to(*shortest, layer, false);
  return shortest;
}

// The error of so many parcels: that of the table's next smaller number, or else of its smallest, and from
// there by the law 1 / sqrt(N).
double error_of_parcels(const std::vector<TableSize>& sizes, double num) {
  const auto above =
      std::find_if(sizes.begin(), sizes.end(), [num](const TableSize& size) { return size.num > num; });
  const TableSize& near = above == sizes.begin() ? *above : *(above - 1);
  return near.error * std::sqrt(near.num / num);
}

// The fewest parcels that meet the error. Beyond the table the error follows 1 / sqrt(N).
std::int64_t num_within(const std::vector<TableSize>& sizes, double wanted, AccuracyChoice& choice) {
  const auto meets = [&](const TableSize& size) { return size.error <= wanted; };
  const auto found = std::find_if(sizes.begin(), sizes.end(), meets);
  if (found != sizes.end()) return static_cast<std::int64_t>(found->num);
  const TableSize& last = sizes.back();
  const double ratio = last.error / wanted;
  const double needed = std::ceil(last.num * ratio * ratio), most = std::max(last.num, kMaxParcels);
  choice.remarks.push_back(fmt::format("by the law 1/sqrt(N) it takes {:.3g} parcels{}", needed,
                                       needed <= most ? "" : fmt::format("; {:.0f} is the most", most)));
  return static_cast<std::int64_t>(std::min(needed, most));
}

// Sets the number of parcels, unless it was given, and its error.
void choose_parcels(const json& table, const AccuracyWish& wish, AccuracyChoice& choice) {
  const bool matters = needs_ball(choice.of) || choice.settings.boundary == Boundary::walls;
  const std::vector<TableSize> sizes = matters ? sizes_of(table, choice.of) : std::vector<TableSize>{};
  if (sizes.empty()) return;
  const double wanted = kParcelsShare * wish.error;
  std::int64_t& num = choice.settings.num_parcels;
  const bool is_kept = wish.keep_parcels || radius_sets_density(choice.settings);
  if (!is_kept) num = num_within(sizes, wanted, choice);
  if (num <= 0) return;  // a number that only the backend knows
  choice.parcels_error = error_of_parcels(sizes, static_cast<double>(num));
  if (is_kept && error_of(choice) > wish.error && choice.parcels_error > wanted)
    choice.remarks.push_back(fmt::format("{} parcels, as given, are too few for this accuracy", num));
}

void check_target(const Settings& scene, const std::string& target) {
  if (scene.air != Air::parcels)
    throw UserError("--accuracy: the scene has no parcels, its flight is exact; leave it out");
  if (needs_ball(target) && (!scene.ball_present || scene.ball_held)) {
    throw UserError(fmt::format(
        "--of: {} needs a ball that flies, and the scene has none; give rate or pressure", target));
  }
  if (!scene.contacts) {
    throw UserError(
        "--accuracy: the scene's parcels do not collide (air.contacts = false), and the table is of their "
        "collisions; leave it out");
  }
}

// The table's gas is at rest, without hot places.
void remark_on_flows(const Settings& scene, std::vector<std::string>& remarks) {
  if (scene.flow_x_mps == 0.0 && scene.flow_y_mps == 0.0 && scene.hot_radius_m == 0.0) return;
  remarks.push_back("the table is of a gas at rest: where this one flows or is hot, errors may be larger");
}

std::string names_without(const MethodSet& refused) {
  std::vector<std::string> names;
  for (const MethodRow& row : kMethods) {
    if (!refused[static_cast<std::size_t>(row.method)]) names.emplace_back(row.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string why_none(const AccuracyWish& wish, bool beyond) {
  if (!wish.refused[static_cast<std::size_t>(Method::exact)])
    return "--accuracy: the table lacks method exact; measure one: pickleflight lab work-precision";
  return fmt::format(
      "--accuracy: by the table only exact is so accurate here, and it works in one domain only; leave out "
      "--domains and mpirun{}",
      beyond ? "" : ", or allow a larger error");
}

// Sets the method and its step.
void choose_method(const TableRows& table, const AccuracyWish& wish, AccuracyChoice& choice) {
  const std::vector<TableCase> cases = cases_around(table.rows, choice.settings);
  const bool beyond = is_beyond(table.rows, choice.settings);
  if (beyond) choice.remarks.push_back("denser or softer than any case of the table: only exact is safe");
  std::optional<TableEntry> best;
  for (const MethodRow& row : kMethods) {
    const bool is_refused = wish.refused[static_cast<std::size_t>(row.method)];
    if (is_refused || (beyond && row.method != Method::exact)) continue;
    std::vector<std::vector<TableEntry>> ladders;
    for (const TableCase& at : cases) ladders.push_back(entries_of(table.rows, at, row.name, choice.of));
    const std::vector<TableEntry> layer = layer_entries(table.layer, row.name, choice.of);
    const auto entry = entry_for_all(ladders, layer, row.method, kMethodShare * wish.error);
    if (!entry || (best && best->cost <= entry->cost)) continue;
    best = entry;
    choice.settings.method = row.method;
  }
  if (!best) throw UserError(why_none(wish, beyond));
  if (wish.refused != MethodSet{}) {
    choice.remarks.push_back("chosen among the methods that several domains can fly: " +
                             names_without(wish.refused));
  }
  choice.settings.dt_s = 0.0;
  choice.settings.substeps = 0;
  choice.settings.displacement_per_step = best->displacement;
  choice.settings.spring_contact_s = 0.0;  // as in the table: 20 steps
  choice.expected_error = best->error;
  choice.is_bound = best->is_bound;
  choice.ns_per_disc_time = best->cost;
}

WorkPrecisionPoint point_of(const TableEntry& entry) { return {entry.cost, entry.error, entry.is_bound}; }

// Interpolates linearly in logarithms.
std::optional<WorkPrecisionPoint> interpolated(const std::vector<TableEntry>& entries, double displacement) {
  if (entries.empty()) return std::nullopt;
  if (displacement <= entries.front().displacement) return point_of(entries.front());
  for (std::size_t i = 1; i < entries.size(); ++i) {
    const TableEntry& a = entries[i - 1];
    const TableEntry& b = entries[i];
    if (displacement > b.displacement) continue;
    const double share = std::log(displacement / a.displacement) / std::log(b.displacement / a.displacement);
    const auto mix = [share](double x, double y) {
      return x > 0.0 && y > 0.0 ? x * std::pow(y / x, share) : y;
    };
    return WorkPrecisionPoint{mix(a.cost, b.cost), mix(a.error, b.error), a.is_bound || b.is_bound};
  }
  return point_of(entries.back());
}

}  // namespace

const std::vector<std::string>& accuracy_targets() {
  static const std::vector<std::string> targets = {"rate", "pressure", "path", "drag"};
  return targets;
}

std::string target_of(const Settings& scene) {
  return scene.ball_present && !scene.ball_held ? "drag" : "rate";
}

double read_accuracy(const std::string& place, const std::string& text) {
  const bool is_percent = text.ends_with('%');
  const std::string digits = is_percent ? text.substr(0, text.size() - 1) : text;
  const double value = number_in(digits).value_or(0.0) * (is_percent ? 0.01 : 1.0);
  if (value > 0.0 && value < 1.0) return value;
  throw UserError(
      fmt::format("{}: {} is not an accuracy; give a relative error between 0 and 1, as 1% or 0.01", place,
                  in_quotes(text)));
}

AccuracyChoice choose_by_accuracy(const json& table, const Settings& scene, const AccuracyWish& wish,
                                  const std::string& backend) {
  AccuracyChoice choice;
  choice.settings = scene;
  choice.asked_error = wish.error;
  choice.of = !wish.of.empty() ? wish.of : target_of(scene);
  check_target(scene, choice.of);
  const TableRows rows = rows_with(table, choice.of, backend);
  if (rows.is_other_series)
    choice.remarks.push_back("the table has no " + backend + " series: costs are ranked as on a CPU");
  remark_on_flows(scene, choice.remarks);
  choose_method(rows, wish, choice);
  choose_parcels(table, wish, choice);
  return choice;
}

WorkPrecision work_precision(const json& table, const Settings& scene, const std::string& of,
                             const std::string& backend, double displacement) {
  WorkPrecision result;
  result.of = of;
  json rows;
  try {
    rows = rows_with(table, of, backend).rows;
  } catch (const UserError&) {
    return result;
  }
  const TableCase at = nearest_case(rows, scene);
  result.area_fraction = at.area_fraction;
  result.restitution = at.restitution;
  for (const MethodRow& row : kMethods) {
    std::vector<TableEntry> entries = entries_of(rows, at, row.name, of);
    std::erase_if(entries, [](const TableEntry& e) { return !(e.cost > 0.0); });  // no logarithm
    for (const TableEntry& entry : entries)
      result.methods[static_cast<std::size_t>(row.method)].push_back(point_of(entry));
    if (row.method == scene.method) result.current = interpolated(entries, displacement);
  }
  return result;
}

std::string describe(const AccuracyChoice& choice, const fs::path& table) {
  const Settings& s = choice.settings;
  const Physics physics = derive_physics(s);
  const FramePlan plan = plan_frame(s, physics, initial_ball(s));
  const auto percent = [](double share) {
    return share < 0.0995 ? fmt::format("{:.2g} %", 100.0 * share) : fmt::format("{:.0f} %", 100.0 * share);
  };
  const std::string of_method = choice.expected_error > 0.0
                                    ? (choice.is_bound ? "less than " : "") + percent(choice.expected_error)
                                    : "none";
  const std::string of_parcels =
      choice.parcels_error > 0.0 ? fmt::format(", {} by the number of parcels", percent(choice.parcels_error))
                                 : "";
  const double error = error_of(choice);
  std::string text;
  if (error > choice.asked_error)
    text = fmt::format("--accuracy: {} is not reached: the error of {} may be {}\n",
                       percent(choice.asked_error), choice.of, percent(error));
  text += fmt::format(
      "--accuracy: method {}, dt {:.3g} s ({} step{} a frame), {} parcels\n"
      "  expected error of {}: {} by the method{}; table: {:.3g} ns per disc and d/c\n  from {}\n",
      method_name(s.method), plan.dt_s, plan.num_steps, plan.num_steps == 1 ? "" : "s", physics.parcels.num,
      choice.of, of_method, of_parcels, choice.ns_per_disc_time, table.string());
  for (const std::string& remark : choice.remarks) text += "  " + remark + "\n";
  return text;
}

json to_json(const std::optional<AccuracyChoice>& choice) {
  if (!choice) return nullptr;
  const auto known = [](double error) { return error > 0.0 ? json(error) : json(nullptr); };
  return {{"of", choice->of},
          {"asked_error", choice->asked_error},
          {"expected_error", known(choice->expected_error)},
          {"is_bound", choice->is_bound},
          {"parcels_error", known(choice->parcels_error)},
          {"displacement_per_step", choice->settings.displacement_per_step},
          {"ns_per_disc_time", choice->ns_per_disc_time},
          {"table", choice->table.string()},
          {"remarks", choice->remarks}};
}

}  // namespace pf
