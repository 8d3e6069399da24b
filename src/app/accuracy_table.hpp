// The table of errors and costs that `pickleflight lab work-precision` measured: where it lies, and its rows.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

// The table measured on this machine if there is one, unless that was with --quick; else the one that ships.
std::filesystem::path accuracy_table_file();
// File of a table measured here: $XDG_CACHE_HOME/pickleflight/work-precision.json, or under ~/.cache.
std::filesystem::path cached_table_file();

// The table of study work-precision in a file, with the rows that study gas-dynamics measured in the layer in
// front of a ball, which ship, as "layer": errors there depend on no machine. Throws UserError if the file
// holds no table.
nlohmann::json read_accuracy_table(const std::filesystem::path& file);

// Targets `path` and `drag` are errors of the ball's flight.
bool needs_ball(const std::string& target);

struct TableRows {
  nlohmann::json rows;
  nlohmann::json layer;          // rows of the layer in front of a ball; empty if the table has none
  bool is_other_series = false;  // the table has no series of this backend; the rows are the CPU's
};
// Rows with an error of `target`, from the backend's series ("cpu" or "cuda") or else from the CPU's. Throws
// UserError if there are none.
TableRows rows_with(const nlohmann::json& table, const std::string& target, const std::string& backend);

// A measured gas.
struct TableCase {
  double area_fraction, restitution;
};
// Cases around the scene: in each of the two quantities the next lower and the next higher value of the
// table. If the scene lies outside, or on a value, there is only one.
std::vector<TableCase> cases_around(const nlohmann::json& rows, const Settings& scene);
// The case nearest to the scene, by ratios.
TableCase nearest_case(const nlohmann::json& rows, const Settings& scene);
// True if the scene is denser, or loses more energy, than any case.
bool is_beyond(const nlohmann::json& rows, const Settings& scene);

// A method with one step length in one case.
struct TableEntry {
  double displacement;  // run.displacement_per_step
  double error;         // relative
  double cost;          // ns per disc and time d/c
  bool is_bound;        // the error is an upper bound
};
// Entries of a method in one case, shortest step first.
std::vector<TableEntry> entries_of(const nlohmann::json& rows, const TableCase& at, const char* method,
                                   const std::string& target);

// Entries of a method in the layer in front of a ball, shortest step first. Empty unless the target is drag.
std::vector<TableEntry> layer_entries(const nlohmann::json& layer, const char* method,
                                      const std::string& target);

struct TableSize {
  double num, error;
};
// Error due to the number of parcels, fewest first.
std::vector<TableSize> sizes_of(const nlohmann::json& table, const std::string& target);

}  // namespace pf
