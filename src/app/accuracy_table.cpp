#include "app/accuracy_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <initializer_list>

#include "app/accuracy.hpp"
#include "app/json_number.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kTable = "work-precision.json";

// Values on either side of x, or the nearest end if x is outside. One value if x equals it.
std::vector<double> neighbours(std::vector<double> values, double x) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  const auto above = std::lower_bound(values.begin(), values.end(), x * (1.0 - 1e-9));
  if (above == values.end()) return {values.back()};
  if (above == values.begin() || *above < x * (1.0 + 1e-9)) return {*above};
  return {*(above - 1), *above};
}

double nearest_of(const std::vector<double>& values, double x) {
  return *std::min_element(values.begin(), values.end(), [x](double a, double b) {
    return std::fabs(std::log(a / x)) < std::fabs(std::log(b / x));
  });
}

std::vector<double> values_of(const json& rows, const char* key) {
  std::vector<double> values;
  for (const json& row : rows) values.push_back(row.at(key));
  return values;
}

bool has_error(const json& row, const std::string& target) {
  return row.contains("errors") && row["errors"].contains(target);
}

json rows_of_series(const json& table, const std::string& target, const std::string& series) {
  const char* group = needs_ball(target) ? "ball" : "gas";
  json rows = json::array();
  for (const json& row : table.at("points")) {
    if (row.at("group") == group && row.at("device") == series && has_error(row, target)) rows.push_back(row);
  }
  return rows;
}

// Rows of the layer in front of a ball from the study that ships.
json shipped_layer() {
  std::ifstream in(find_asset(fs::path("lab") / "gas-dynamics.json"));
  const json study = json::parse(in, nullptr, false);
  return study.is_object() ? study.value("layer", json::array()) : json::array();
}

bool has_numbers(const json& row, std::initializer_list<const char*> keys) {
  return std::all_of(keys.begin(), keys.end(),
                     [&](const char* key) { return row.contains(key) && row[key].is_number(); });
}

// True for an error as the lab writes it. may_be_null: the others are measured against it.
bool is_error(const json& error, bool may_be_null) {
  if (!error.is_object() || !error.contains("value")) return false;
  const bool is_flag = !error.contains("bound") || error["bound"].is_boolean();
  return is_flag && (error["value"].is_number() || (may_be_null && error["value"].is_null()));
}

// True if a row has all that is read of it here; rows of other groups are not read.
bool is_row(const json& row) {
  if (!row.is_object() || !has_text(row, "group") || !has_text(row, "device")) return false;
  const bool is_size = row["group"] == "parcels";
  if (!is_size && row["group"] != "gas" && row["group"] != "ball") return true;
  if (is_size ? !has_numbers(row, {"num_parcels"})
              : !has_text(row, "method") || !has_numbers(row, {"area_fraction", "restitution",
                                                               "displacement_per_step", "ns_per_disc_time"}))
    return false;
  const std::vector<std::string>& targets = accuracy_targets();
  return std::all_of(targets.begin(), targets.end(), [&](const std::string& target) {
    return !has_error(row, target) || is_error(row["errors"][target], !is_size);
  });
}

bool is_accuracy_table(const json& table) {
  if (!table.is_object() || !has_text(table, "study") || table["study"] != "work-precision") return false;
  if (!table.contains("points") || !table["points"].is_array()) return false;
  return std::all_of(table["points"].begin(), table["points"].end(), is_row);
}

// Returns whether a table was measured with --quick. Earlier versions kept such tables.
bool is_quick_table(const fs::path& file) {
  std::ifstream in(file);
  const json table = json::parse(in, nullptr, false);
  return table.is_object() && table.value("quick", json()) == true;
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

bool needs_ball(const std::string& target) { return target == "path" || target == "drag"; }

fs::path cached_table_file() {
  const std::string cache = variable("XDG_CACHE_HOME");
  if (!cache.empty()) return fs::path(cache) / "pickleflight" / kTable;
  const std::string home = variable("HOME");
  return home.empty() ? fs::path() : fs::path(home) / ".cache" / "pickleflight" / kTable;
}

fs::path accuracy_table_file() {
  std::error_code ignored;
  const fs::path cached = cached_table_file();
  const bool counts = !cached.empty() && fs::exists(cached, ignored) && !is_quick_table(cached);
  return counts ? cached : find_asset(fs::path("lab") / kTable);
}

json read_accuracy_table(const fs::path& file) {
  std::ifstream in(file);
  json table = json::parse(in, nullptr, false);
  if (is_accuracy_table(table)) {
    table["layer"] = shipped_layer();
    return table;
  }
  throw UserError(fmt::format(
      "--accuracy: {} is not a table of the lab; delete it, or measure one: pickleflight lab work-precision",
      in_quotes(file.string())));
}

TableRows rows_with(const json& table, const std::string& target, const std::string& backend) {
  const json layer = table.value("layer", json::array());
  TableRows result{rows_of_series(table, target, backend), layer};
  if (result.rows.empty() && backend != "cpu") result = {rows_of_series(table, target, "cpu"), layer, true};
  if (!result.rows.empty()) return result;
  throw UserError("--accuracy: the table has no errors of " + target +
                  "; measure one: pickleflight lab work-precision");
}

// The share of the area that the scene's parcels cover.
double covered_share(const Settings& scene) {
  const bool follows = radius_sets_density(scene) && scene.num_parcels > 0;
  return follows ? area_fraction_of(derive_physics(scene)) : scene.area_fraction;
}

std::vector<TableCase> cases_around(const json& rows, const Settings& scene) {
  std::vector<TableCase> cases;
  for (const double fraction : neighbours(values_of(rows, "area_fraction"), covered_share(scene))) {
    for (const double restitution : neighbours(values_of(rows, "restitution"), scene.restitution))
      cases.push_back({fraction, restitution});
  }
  return cases;
}

TableCase nearest_case(const json& rows, const Settings& scene) {
  constexpr double kMinRestitution = 1e-3;  // its logarithm is needed
  return {nearest_of(values_of(rows, "area_fraction"), covered_share(scene)),
          nearest_of(values_of(rows, "restitution"), std::max(scene.restitution, kMinRestitution))};
}

bool is_beyond(const json& rows, const Settings& scene) {
  const std::vector<double> fractions = values_of(rows, "area_fraction");
  const std::vector<double> restitutions = values_of(rows, "restitution");
  return covered_share(scene) > *std::max_element(fractions.begin(), fractions.end()) * 1.001 ||
         scene.restitution < *std::min_element(restitutions.begin(), restitutions.end()) * 0.999;
}

std::vector<TableEntry> entries_of(const json& rows, const TableCase& at, const char* method,
                                   const std::string& target) {
  std::vector<TableEntry> entries;
  for (const json& row : rows) {
    if (row.at("area_fraction") != at.area_fraction || row.at("restitution") != at.restitution ||
        row.at("method") != method) {
      continue;
    }
    const json& error = row.at("errors").at(target);
    entries.push_back({row.at("displacement_per_step"),
                       error.at("value").is_null() ? 0.0 : error["value"].get<double>(),
                       row.at("ns_per_disc_time"), error.value("bound", false)});
  }
  std::sort(entries.begin(), entries.end(),
            [](const TableEntry& a, const TableEntry& b) { return a.displacement < b.displacement; });
  return entries;
}

std::vector<TableEntry> layer_entries(const json& layer, const char* method, const std::string& target) {
  json rows = json::array();
  for (const json& row : layer) {
    if (row.at("device") == "cpu" && has_error(row, target)) rows.push_back(row);
  }
  if (rows.empty()) return {};
  const json& first = rows.front();
  return entries_of(rows, {first.at("area_fraction"), first.at("restitution")}, method, target);
}

std::vector<TableSize> sizes_of(const json& table, const std::string& target) {
  std::vector<TableSize> sizes;
  for (const json& row : table.at("points")) {
    if (row.at("group") != "parcels" || !has_error(row, target)) continue;
    sizes.push_back({row.at("num_parcels"), row["errors"][target].at("value")});
  }
  std::sort(sizes.begin(), sizes.end(), [](const TableSize& a, const TableSize& b) { return a.num < b.num; });
  // An error that changes its sign is small in between, which is no accuracy.
  for (std::size_t i = sizes.size(); i-- > 1;)
    sizes[i - 1].error = std::max(sizes[i - 1].error, sizes[i].error);
  return sizes;
}

}  // namespace pf
