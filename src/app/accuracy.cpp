#include "app/accuracy.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.hpp"
#include "core/text.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kTable = "work-precision.json";
// Method and number of parcels err independently: 0.8^2 + 0.6^2 = 1.
constexpr double kMethodShare = 0.8, kParcelsShare = 0.6;
constexpr double kMaxParcels = 1e6;

struct Case {
  double area_fraction, restitution;
};

bool needs_ball(const std::string& of) { return of == "path" || of == "drag"; }

// Table values on either side of x, the nearest end if x is outside; equal if x is one of them.
std::vector<double> neighbours(std::vector<double> values, double x) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  const auto above = std::lower_bound(values.begin(), values.end(), x * (1.0 - 1e-9));
  if (above == values.end()) return {values.back()};
  if (above == values.begin() || *above < x * (1.0 + 1e-9)) return {*above};
  return {*(above - 1), *above};
}

struct Entry {
  double displacement, error, cost;
  bool is_bound;
};

// The entries of a method in one case, shortest step first.
std::vector<Entry> ladder(const json& rows, const Case& at, const char* method, const std::string& of) {
  std::vector<Entry> entries;
  for (const json& row : rows) {
    if (row.at("area_fraction") != at.area_fraction || row.at("restitution") != at.restitution ||
        row.at("method") != method) {
      continue;
    }
    const json& error = row.at("errors").at(of);
    entries.push_back({row.at("displacement_per_step"),
                       error.at("value").is_null() ? 0.0 : error["value"].get<double>(),
                       row.at("ns_per_disc_time"), error.value("bound", false)});
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.displacement < b.displacement; });
  return entries;
}

// The longest step that meets the error, all shorter ones of the ladder meeting it too: an error that happens
// to cross zero at a long step is no accuracy. `exact` has no step error: its cheapest.
std::optional<Entry> allowed(const std::vector<Entry>& entries, double error, bool is_exact) {
  std::optional<Entry> found;
  for (const Entry& entry : entries) {
    if (is_exact) {
      if (!found || entry.cost < found->cost) found = entry;
    } else if (entry.error <= error) {
      found = entry;
    } else {
      break;
    }
  }
  return found;
}

// What a method needs in all neighbouring cases: the shortest of their steps, and the largest error and cost
// that the cases have there, or at the next longer step of theirs.
std::optional<Entry> allowed_everywhere(const json& rows, const std::vector<Case>& cases, const char* method,
                                        const std::string& of, double error) {
  const bool is_exact = std::string(method) == "exact";
  std::optional<Entry> shortest;
  for (const Case& at : cases) {
    const auto entry = allowed(ladder(rows, at, method, of), error, is_exact);
    if (!entry) return std::nullopt;
    if (!shortest || entry->displacement < shortest->displacement) shortest = entry;
  }
  for (const Case& at : cases) {
    for (const Entry& entry : ladder(rows, at, method, of)) {
      if (entry.displacement < shortest->displacement * (1.0 - 1e-9)) continue;
      if (entry.error > shortest->error) {
        shortest->error = entry.error;
        shortest->is_bound = entry.is_bound;
      }
      shortest->cost = std::max(shortest->cost, entry.cost);
      break;
    }
  }
  return shortest;
}

// Rows with this error, of the backend's series, or of the CPU's where the table has no other.
json rows_for(const json& table, const std::string& of, const std::string& backend, AccuracyChoice& choice) {
  const auto of_series = [&](const std::string& series) {
    json rows = json::array();
    for (const json& row : table.at("points")) {
      const std::string group = row.at("group");
      const bool fits = group == (needs_ball(of) ? "ball" : "gas") && row.at("device") == series;
      if (fits && row.contains("errors") && row["errors"].contains(of)) rows.push_back(row);
    }
    return rows;
  };
  json rows = of_series(backend);
  if (rows.empty() && backend != "cpu") {
    choice.remarks.push_back("the table has no " + backend + " series: costs are ranked as on a CPU");
    rows = of_series("cpu");
  }
  if (rows.empty())
    throw UserError("--accuracy: the table has no errors of " + of +
                    "; measure one: pickleflight lab work-precision");
  return rows;
}

std::vector<Case> cases_of(const json& rows, const Settings& scene) {
  std::vector<double> fractions, restitutions;
  for (const json& row : rows) {
    fractions.push_back(row.at("area_fraction"));
    restitutions.push_back(row.at("restitution"));
  }
  std::vector<Case> cases;
  for (const double fraction : neighbours(fractions, scene.area_fraction)) {
    for (const double restitution : neighbours(restitutions, scene.restitution))
      cases.push_back({fraction, restitution});
  }
  return cases;
}

// Whether the scene is denser, or loses more energy, than any case of the table: only `exact` is safe there.
bool is_beyond(const json& rows, const Settings& scene) {
  double densest = 0.0, softest = 1.0;
  for (const json& row : rows) {
    densest = std::max(densest, row.at("area_fraction").get<double>());
    softest = std::min(softest, row.at("restitution").get<double>());
  }
  return scene.area_fraction > densest * 1.001 || scene.restitution < softest * 0.999;
}

struct Size {
  double num, error;
};

// The error that the number of parcels makes, rows of group "parcels".
std::vector<Size> sizes_of(const json& table, const std::string& of) {
  std::vector<Size> sizes;
  for (const json& row : table.at("points")) {
    if (row.at("group") != "parcels" || !row.contains("errors") || !row["errors"].contains(of)) continue;
    sizes.push_back({row.at("num_parcels"), row["errors"][of].at("value")});
  }
  std::sort(sizes.begin(), sizes.end(), [](const Size& a, const Size& b) { return a.num < b.num; });
  return sizes;
}

// The fewest parcels that meet the error; beyond the table by its law 1 / sqrt(N).
void choose_parcels(const json& table, const AccuracyWish& wish, AccuracyChoice& choice) {
  const bool matters = needs_ball(choice.of) || choice.settings.boundary == Boundary::walls;
  const std::vector<Size> sizes = matters ? sizes_of(table, choice.of) : std::vector<Size>{};
  if (wish.keep_parcels || sizes.empty()) return;
  const double wanted = kParcelsShare * wish.error;
  const auto meets = [&](const Size& size) { return size.error <= wanted; };
  const auto found = std::find_if(sizes.begin(), sizes.end(), meets);
  if (found != sizes.end()) {
    choice.settings.num_parcels = static_cast<std::int64_t>(found->num);
    choice.parcels_error = found->error;
    return;
  }
  const Size& last = sizes.back();
  const double ratio = last.error / wanted;
  const double num = std::min(std::ceil(last.num * ratio * ratio), kMaxParcels);
  choice.settings.num_parcels = static_cast<std::int64_t>(num);
  choice.parcels_error = last.error * std::sqrt(last.num / num);
  choice.remarks.push_back(fmt::format("{:.0f} parcels by the law 1/sqrt(N), the table ends at {:.0f}{}", num,
                                       last.num, num < kMaxParcels ? "" : "; more would be needed"));
}

}  // namespace

const std::vector<std::string>& accuracy_targets() {
  static const std::vector<std::string> targets = {"rate", "pressure", "path", "drag"};
  return targets;
}

double read_accuracy(const std::string& place, const std::string& text) {
  const bool is_percent = text.ends_with('%');
  const std::string digits = is_percent ? text.substr(0, text.size() - 1) : text;
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (is_percent) value *= 0.01;
  const bool is_number = error == std::errc() && end == digits.data() + digits.size() && !digits.empty();
  if (is_number && value > 0.0 && value < 1.0) return value;
  throw UserError(
      fmt::format("{}: {} is not an accuracy; give a relative error between 0 and 1, as 1% or 0.01", place,
                  in_quotes(text)));
}

AccuracyChoice choose_by_accuracy(const json& table, const Settings& scene, const AccuracyWish& wish,
                                  const std::string& backend) {
  AccuracyChoice choice;
  choice.settings = scene;
  choice.of = !wish.of.empty() ? wish.of : scene.ball_present && !scene.ball_held ? "drag" : "rate";
  if (scene.air != Air::parcels)
    throw UserError("--accuracy: the scene has no parcels, its flight is exact; leave it out");
  if (needs_ball(choice.of) && (!scene.ball_present || scene.ball_held)) {
    throw UserError(fmt::format(
        "--of: {} is of a ball that flies, and the scene has none; give rate or pressure", choice.of));
  }
  const json rows = rows_for(table, choice.of, backend, choice);
  const std::vector<Case> cases = cases_of(rows, scene);
  const bool beyond = is_beyond(rows, scene);
  if (beyond) choice.remarks.push_back("denser or softer than any case of the table: only exact is safe");
  std::optional<Entry> best;
  for (const MethodRow& method : kMethods) {
    if (beyond && method.method != Method::exact) continue;
    const auto entry = allowed_everywhere(rows, cases, method.name, choice.of, kMethodShare * wish.error);
    if (!entry || (best && best->cost <= entry->cost)) continue;
    best = entry;
    choice.settings.method = method.method;
  }
  if (!best)
    throw UserError("--accuracy: the table lacks method exact; measure one: pickleflight lab work-precision");
  choice.settings.dt_s = 0.0;
  choice.settings.substeps = 0;
  choice.settings.displacement_per_step = best->displacement;
  choice.settings.spring_contact_s = 0.0;  // as in the table: 20 steps
  choice.expected_error = best->error;
  choice.is_bound = best->is_bound;
  choice.ns_per_disc_time = best->cost;
  choose_parcels(table, wish, choice);
  return choice;
}

namespace {

double nearest_of(const std::vector<double>& values, double x) {
  return *std::min_element(values.begin(), values.end(), [x](double a, double b) {
    return std::fabs(std::log(a / x)) < std::fabs(std::log(b / x));
  });
}

// Straight lines between the entries, in logarithms.
std::optional<WorkPrecisionPoint> between(const std::vector<Entry>& entries, double displacement) {
  if (entries.empty()) return std::nullopt;
  const auto point = [](const Entry& e) { return WorkPrecisionPoint{e.cost, e.error, e.is_bound}; };
  if (displacement <= entries.front().displacement) return point(entries.front());
  for (std::size_t i = 1; i < entries.size(); ++i) {
    const Entry& a = entries[i - 1];
    const Entry& b = entries[i];
    if (displacement > b.displacement) continue;
    const double share = std::log(displacement / a.displacement) / std::log(b.displacement / a.displacement);
    const auto mix = [share](double x, double y) {
      return x > 0.0 && y > 0.0 ? x * std::pow(y / x, share) : y;
    };
    return WorkPrecisionPoint{mix(a.cost, b.cost), mix(a.error, b.error), a.is_bound || b.is_bound};
  }
  return point(entries.back());
}

}  // namespace

WorkPrecision work_precision(const json& table, const Settings& scene, const std::string& of,
                             const std::string& backend, double displacement) {
  WorkPrecision picture;
  picture.of = of;
  AccuracyChoice remarks;
  json rows;
  try {
    rows = rows_for(table, of, backend, remarks);
  } catch (const UserError&) {
    return picture;
  }
  std::vector<double> fractions, restitutions;
  for (const json& row : rows) {
    fractions.push_back(row.at("area_fraction"));
    restitutions.push_back(row.at("restitution"));
  }
  const Case at = {nearest_of(fractions, scene.area_fraction),
                   nearest_of(restitutions, std::max(scene.restitution, 1e-3))};
  picture.area_fraction = at.area_fraction;
  picture.restitution = at.restitution;
  for (const MethodRow& method : kMethods) {
    std::vector<Entry> entries = ladder(rows, at, method.name, of);
    std::erase_if(entries, [](const Entry& e) { return !(e.cost > 0.0); });  // no logarithm
    for (const Entry& entry : entries)
      picture.methods[static_cast<std::size_t>(method.method)].push_back(
          {entry.cost, entry.error, entry.is_bound});
    if (method.method == scene.method) picture.present = between(entries, displacement);
  }
  return picture;
}

fs::path cached_table_file() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::string() : std::string(value);
  };
  const std::string cache = variable("XDG_CACHE_HOME");
  if (!cache.empty()) return fs::path(cache) / "pickleflight" / kTable;
  const std::string home = variable("HOME");
  return home.empty() ? fs::path() : fs::path(home) / ".cache" / "pickleflight" / kTable;
}

fs::path accuracy_table_file() {
  std::error_code ignored;
  const fs::path cached = cached_table_file();
  return !cached.empty() && fs::exists(cached, ignored) ? cached : find_asset(fs::path("lab") / kTable);
}

json read_accuracy_table(const fs::path& file) {
  std::ifstream in(file);
  json table = json::parse(in, nullptr, false);
  const bool is_table = table.is_object() && table.value("study", "") == "work-precision" &&
                        table.contains("points") && table["points"].is_array();
  if (is_table) return table;
  throw UserError(fmt::format(
      "--accuracy: {} is no table of the lab; delete it, or measure one: pickleflight lab work-precision",
      in_quotes(file.string())));
}

std::string describe(const AccuracyChoice& choice, const fs::path& table) {
  const Settings& s = choice.settings;
  const Physics physics = derive_physics(s);
  const FramePlan plan = plan_frame(s, physics, initial_ball(s));
  std::string text = fmt::format(
      "--accuracy: method {}, dt {:.3g} s ({} substeps a frame), {} parcels\n"
      "  expected: {} within {}{:.2g} %{}; table: {:.3g} ns per disc and d/c\n  from {}\n",
      method_name(s.method), plan.dt_s, plan.num_steps, physics.parcels.num, choice.of,
      choice.is_bound ? "less than " : "", 100.0 * choice.expected_error,
      choice.parcels_error > 0.0
          ? fmt::format(", {:.2g} % from the number of parcels", 100.0 * choice.parcels_error)
          : "",
      choice.ns_per_disc_time, table.string());
  for (const std::string& remark : choice.remarks) text += "  " + remark + "\n";
  return text;
}

}  // namespace pf
