// `--accuracy 1% --of rate`: the cheapest method, time step and number of parcels that meet an error, from a
// table that `pickleflight lab work-precision` measured. Table and scene alone decide, never a clock.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

struct AccuracyWish {
  double error = 0.0;         // relative, in (0, 1); 0: none is asked for
  std::string of;             // one of accuracy_targets(); empty: drag if a ball flies, else rate
  bool keep_parcels = false;  // their number was given and stays
};

const std::vector<std::string>& accuracy_targets();

// "1%" or "0.01" in (0, 1). Throws UserError naming place.
double read_accuracy(const std::string& place, const std::string& text);

struct AccuracyChoice {
  Settings settings;  // the scene with method, displacement_per_step, number of parcels chosen
  std::string of;
  double expected_error = 0.0;  // of the method, from the table; an upper limit where is_bound
  bool is_bound = false;
  double parcels_error = 0.0;     // from the number of parcels: scatter, or walls; 0: not known or not chosen
  double ns_per_disc_time = 0.0;  // what the table says it costs, per disc and d/c
  std::vector<std::string> remarks;  // what the table does not cover
};

// table: the JSON of the study. backend: "cpu" or "cuda", whose series counts if the table has it. The scene
// lies between cases of the table: the step taken is the shortest that any neighbouring case asks for. Throws
// UserError if the scene has no parcels, or the target needs a ball and there is none.
AccuracyChoice choose_by_accuracy(const nlohmann::json& table, const Settings& scene,
                                  const AccuracyWish& wish, const std::string& backend);

// One setting of a method: what it costs, in nanoseconds per disc and time d/c, and its relative error (an
// upper limit where is_bound; 0: the others are measured against it).
struct WorkPrecisionPoint {
  double ns_per_disc_time = 0.0;
  double error = 0.0;
  bool is_bound = false;
};

// What the table says about the case that is nearest to a scene.
struct WorkPrecision {
  std::string of;
  double area_fraction = 0.0, restitution = 0.0;           // of that case
  std::array<std::vector<WorkPrecisionPoint>, 3> methods;  // by Method, shortest step first
  std::optional<WorkPrecisionPoint> present;               // of the scene's own method and step
};

// displacement: of the scene's step (displacement_of_step). Between two steps of the table the present point
// is interpolated, beyond them it is the nearest. Empty if the table has nothing of this kind.
WorkPrecision work_precision(const nlohmann::json& table, const Settings& scene, const std::string& of,
                             const std::string& backend, double displacement);

// The table measured on this machine, if there is one, else the one that ships.
std::filesystem::path accuracy_table_file();
// Where a table measured here is kept: $XDG_CACHE_HOME/pickleflight/work-precision.json, or under ~/.cache.
std::filesystem::path cached_table_file();

// Reads the table; throws UserError if it is none.
nlohmann::json read_accuracy_table(const std::filesystem::path& file);

// What was chosen and what it expects, some lines.
std::string describe(const AccuracyChoice& choice, const std::filesystem::path& table);

}  // namespace pf
