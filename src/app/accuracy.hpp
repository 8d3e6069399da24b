// `--accuracy 1% --of rate`: the cheapest method, time step and number of parcels that meet an error, from a
// table that `pickleflight lab work-precision` measured. The choice depends on table and scene alone, never
// on a clock.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/methods.hpp"
#include "scene/settings.hpp"

namespace pf {

struct AccuracyWish {
  double error = 0.0;         // relative, in (0, 1); 0: no wish
  std::string of;             // one of accuracy_targets(); empty: target_of() the scene
  bool keep_parcels = false;  // the number of parcels was given
  MethodSet refused{};        // methods that the backend cannot fly
};

const std::vector<std::string>& accuracy_targets();

// The target where none is wished: drag if a ball flies, otherwise rate.
std::string target_of(const Settings& scene);

// Reads "1%" or "0.01", in (0, 1). Throws UserError that begins with place.
double read_accuracy(const std::string& place, const std::string& text);

struct AccuracyChoice {
  Settings settings;  // the scene with chosen method, displacement_per_step and number of parcels
  std::string of;
  double asked_error = 0.0;
  double expected_error = 0.0;  // of the method, from the table; an upper limit if is_bound
  bool is_bound = false;
  double parcels_error = 0.0;        // due to the number of parcels: scatter, or walls; 0: unknown
  double ns_per_disc_time = 0.0;     // cost from the table, per disc and time d/c
  std::vector<std::string> remarks;  // limits of the table
  std::filesystem::path table;       // its file, if it is from one
};

// table: the JSON of the study. backend: "cpu" or "cuda"; its series is used if the table has one. A scene
// between cases of the table gets the shortest step that any neighbouring case needs. Throws UserError if the
// scene has no parcels, or none that collide with each other, if the target needs a ball and there is none,
// or if only a refused method is so accurate.
AccuracyChoice choose_by_accuracy(const nlohmann::json& table, const Settings& scene,
                                  const AccuracyWish& wish, const std::string& backend);

// One setting of a method: its cost in nanoseconds per disc and time d/c, and its relative error (an upper
// limit if is_bound; 0: the others are measured against it).
struct WorkPrecisionPoint {
  double ns_per_disc_time = 0.0;
  double error = 0.0;
  bool is_bound = false;
};

// The table's points for the case nearest to a scene.
struct WorkPrecision {
  std::string of;
  double area_fraction = 0.0, restitution = 0.0;                         // of that case
  std::array<std::vector<WorkPrecisionPoint>, kMethods.size()> methods;  // by Method, shortest step first
  std::optional<WorkPrecisionPoint> current;                             // of the scene's own method and step
};

// displacement: of the scene's step (displacement_of_step()). The current point is interpolated between steps
// of the table; beyond them it is the nearest. Empty if the table has no such errors.
WorkPrecision work_precision(const nlohmann::json& table, const Settings& scene, const std::string& of,
                             const std::string& backend, double displacement);

// The choice and its expected error, in some lines.
std::string describe(const AccuracyChoice& choice, const std::filesystem::path& table);

// For a report. Keys: of, asked_error, expected_error (of the method; null: the table resolves none),
// is_bound, parcels_error (null: unknown, or without effect), displacement_per_step, ns_per_disc_time, table,
// remarks. null without a choice.
nlohmann::json to_json(const std::optional<AccuracyChoice>& choice);

}  // namespace pf
