#include "lab/study_files.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/child_process.hpp"
#include "app/json_number.hpp"
#include "app/report.hpp"
#include "core/error.hpp"
#include "core/program_files.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A part of the message of style.py if matplotlib is missing.
constexpr const char* kMatplotlibHint = "apt install python3-matplotlib";

fs::path plot_folder() {
  const std::vector<fs::path> folders = program_folders("plots");
  std::error_code ignored;
  for (const fs::path& folder : folders) {
    if (fs::is_directory(folder, ignored)) return folder;
  }
  return folders.front();
}

void flatten(const std::string& prefix, const json& value,
             std::vector<std::pair<std::string, std::string>>& row) {
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items())
      flatten(prefix.empty() ? key : prefix + "." + key, inner, row);
  } else if (!value.is_array()) {
    row.emplace_back(prefix, value.is_null()     ? ""
                             : value.is_string() ? value.get<std::string>()
                                                 : value.dump());
  }
}

// RFC 4180.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

void write_text(const fs::path& file, const std::string& text) {
  const std::string problem = replace_file(file, text);
  if (problem.empty()) return;
  throw OutputError(fmt::format("{} cannot be written ({}); check free space and permissions",
                                in_quotes(file.string()), problem));
}

// Returns whether it has the form of a result; does not check its fields.
bool is_result_of(const json& result, const Study& study) {
  if (!result.is_object() || !has_text(result, "study") || result["study"] != study.name ||
      !has_text(result, "version") || !result.contains("machine") || !result.contains("points"))
    return false;
  const json &machine = result["machine"], &points = result["points"];
  return machine.is_object() && machine.value("devices", json()).is_array() &&
         machine.value("measured_under_load", json()).is_boolean() && points.is_array() &&
         std::all_of(points.begin(), points.end(),
                     [](const json& row) { return row.is_object() && has_text(row, "key"); });
}

// Names of devices and scenes need not be UTF-8.
std::string text_of(const json& result) {
  return result.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

json read_json(const fs::path& file) {
  std::ifstream in(file);
  return json::parse(in, nullptr, false);
}

// Also damaged ones.
bool has_studies(const fs::path& folder) {
  std::error_code ignored;
  const fs::directory_iterator entries(folder);
  return std::any_of(begin(entries), end(entries), [&](const fs::directory_entry& entry) {
    if (entry.path().extension() != ".json" || !fs::is_regular_file(entry.path(), ignored)) return false;
    const json result = read_json(entry.path());
    return result.is_discarded() || (result.is_object() && result.contains("study"));
  });
}

}  // namespace

void open_results(const fs::path& folder, Existing existing) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw UserError(fmt::format("--out: {} is not a folder; give another path", in_quotes(folder.string())));
  }
  if (fs::is_directory(folder, error) && ::access(folder.c_str(), R_OK | W_OK | X_OK) != 0) {
    throw UserError(fmt::format("--out: {} cannot be read and written; check its permissions",
                                in_quotes(folder.string())));
  }
  const bool holds_files = fs::is_directory(folder, error) && !fs::is_empty(folder, error);
  if (existing == Existing::resume && holds_files && !has_studies(folder)) {
    throw UserError(fmt::format("--resume: {} holds files, but no study to continue; give another folder",
                                in_quotes(folder.string())));
  }
  if (existing == Existing::refuse && holds_files) {
    throw UserError(fmt::format(
        "--out: {} exists and holds files; give --resume to continue it, --force to overwrite it, or "
        "another folder",
        in_quotes(folder.string())));
  }
  fs::create_directories(folder, error);
  if (error) {
    throw UserError(
        fmt::format("--out: {} cannot be created: {}", in_quotes(folder.string()), error.message()));
  }
}

void refuse_to_resume(const fs::path& folder, const std::string& study, const std::string& reason) {
  throw UserError(
      fmt::format("--resume: {} {}; or give another folder, or --force to measure all points anew",
                  in_quotes((folder / (study + ".json")).string()), reason));
}

bool resume_study(const fs::path& folder, const Study& study, json& result) {
  const fs::path file = folder / (study.name + ".json");
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return true;
  const json old = read_json(file);
  if (!is_result_of(old, study))
    refuse_to_resume(folder, study.name, "is damaged or no result of this study; remove it");
  const std::string version = old["version"], now = result.at("version").get<std::string>();
  if (version != now)
    refuse_to_resume(
        folder, study.name,
        fmt::format("was measured by version {}, and this is {}; use that version", version, now));
  if (old.value("quick", json()) != result.at("quick"))
    refuse_to_resume(folder, study.name,
                     result.at("quick").get<bool>() ? "was measured without --quick; leave it out"
                                                    : "was measured with --quick; add it");
  result["points"] = old["points"];
  result["machine"] = old["machine"];
  const bool has_points = !old["points"].empty();
  if (has_points && has_text(old, "scene_settings")) result["scene_settings"] = old["scene_settings"];
  // The series of a CUDA device stays, whether or not this machine has one; so do the command that repeats it
  // and whether it is complete.
  const auto is_of_cuda = [](const json& of) {
    return has_text(of, "command") && of["command"].get<std::string>().find(" --cuda") != std::string::npos;
  };
  if (!is_of_cuda(old)) return true;
  const bool has_device = is_of_cuda(result);
  result["command"] = old["command"];
  return has_device || old.value("complete", json()) == true;
}

void add_device(const json& devices, const std::string& series, json& machine) {
  json& known = machine["devices"];
  for (const json& device : devices) {
    if (device.at("series") == series && std::find(known.begin(), known.end(), device) == known.end())
      known.push_back(device);
  }
}

std::string csv_of(const json& points) {
  std::vector<std::string> columns;
  std::vector<std::vector<std::pair<std::string, std::string>>> rows;
  for (const json& point : points) {
    flatten("", point, rows.emplace_back());
    for (const auto& [name, value] : rows.back()) {
      if (std::find(columns.begin(), columns.end(), name) == columns.end()) columns.push_back(name);
    }
  }
  std::string text;
  for (const std::string& name : columns) text += (text.empty() ? "" : ",") + quoted(name);
  text += "\n";
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const auto found =
          std::find_if(row.begin(), row.end(), [&](const auto& cell) { return cell.first == columns[k]; });
      text += (k == 0 ? "" : ",") + (found == row.end() ? "" : quoted(found->second));
    }
    text += "\n";
  }
  return text;
}

void save_study(const fs::path& folder, const json& result) {
  const std::string name = result.at("study");
  write_text(folder / (name + ".json"), text_of(result));
  write_text(folder / (name + ".csv"), csv_of(result.at("points")));
}

void remove_pictures(const fs::path& folder, const std::string& study) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string stem = entry.path().stem().string(), ending = entry.path().extension().string();
    const bool is_of_study = stem == study || stem.starts_with(study + "-");
    if (is_of_study && (ending == ".png" || ending == ".svg")) fs::remove(entry.path(), ignored);
  }
}

std::string keep_accuracy_table(const fs::path& folder, const fs::path& kept) {
  if (kept.empty()) return "";
  const json table = read_json(folder / "work-precision.json");
  if (table.at("quick").get<bool>()) return "--accuracy does not choose by a table measured with --quick";
  std::error_code ignored;
  fs::create_directories(kept.parent_path(), ignored);
  try {
    write_text(kept, text_of(table));
  } catch (const UserError& error) {
    return fmt::format("--accuracy does not get the new table: {}", error.what());
  }
  return "";
}

std::string run_plot(const std::string& script, const fs::path& folder) {
  const fs::path file = plot_folder() / script;
  std::string error_text;
  bool has_python = true;
  try {
    // Distributions install matplotlib for the system's Python.
    ChildProcess python({"/usr/bin/python3", "-B", file.string(), folder.string()}, -1);
    if (python.wait().good) return "";
    error_text = python.last_errors();
  } catch (const DeviceError& error) {
    has_python = false;
    error_text = error.what();
  }
  if (has_python && error_text.find(kMatplotlibHint) == std::string::npos) {
    return fmt::format("{} failed: {}; CSV and JSON have the figures", script, error_text);
  }
  return fmt::format(
      "no pictures, but CSV and JSON have the figures: Python's matplotlib is missing; apt install "
      "python3-matplotlib, here or on another machine with a copy of the folder, then pickleflight lab plot "
      "{}",
      shell_word(folder.string()));
}

}  // namespace pf
