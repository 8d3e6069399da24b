#include "lab/lab.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>

#include "app/accuracy_table.hpp"
#include "core/error.hpp"
#include "core/progress_line.hpp"
#include "core/text.hpp"
#include "lab/lab_ranks.hpp"
#include "lab/machine_load.hpp"
#include "lab/parallel_for.hpp"
#include "lab/study_files.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

using nlohmann::json;

// Prints a line to stderr. Never throws: fmt::print does where stderr cannot be written.
void print_note(const std::string& note) {
  ProgressLine::clear();
  if (!note.empty()) std::fputs((note + '\n').c_str(), stderr);
}

// Progress through a study's points.
class Progress {
 public:
  Progress(std::string name, std::size_t num, std::size_t num_known)
      : name_(std::move(name)), num_(num), num_known_(num_known) {}

  void show(std::size_t done, const std::string& next) {
    if (!line_.is_due()) return;
    const double share = static_cast<double>(done - num_known_) / static_cast<double>(num_ - num_known_);
    line_.show(fmt::format("{}: {} of {} points{}  {}", name_, done, num_,
                           time_left_text(share, line_.spent_s()), next));
  }
  void end(const std::string& line) const { print_note(fmt::format("{}: {}", name_, line)); }

 private:
  std::string name_;
  std::size_t num_, num_known_;
  ProgressLine line_{0.0, 0.0};
};

json machine_of(const LabContext& context) {
  json names = json::array();
  for (const LabDevice& device : context.devices) {
    names.push_back({{"series", device.name}, {"device", device.make()->device()}});
  }
  return {{"devices", names}, {"cores", std::thread::hardware_concurrency()}, {"measured_under_load", false}};
}

void note_load(const MachineLoad& load, json& machine) {
  const double share = load.cores_used_by_others() / std::max(1U, std::thread::hardware_concurrency());
  machine["share_of_cores_used_by_others"] =
      std::max(share, machine.value("share_of_cores_used_by_others", 0.0));
  machine["measured_under_load"] = machine["measured_under_load"].get<bool>() || share > kMaxUnloadedShare;
}

json start_result(const Study& study, const LabContext& context, const std::filesystem::path& out) {
  const std::string scene = study.name == "terms" && context.scene != LabContext{}.scene
                                ? " --scene " + shell_word(context.scene)
                                : "";
  json result = {
      {"kind", "lab"},
      {"study", study.name},
      {"title", study.title},
      {"reading", study.reading},
      {"version", PF_VERSION},
      {"quick", context.quick},
      {"command",
       fmt::format("pickleflight lab {}{}{}{} --out {}", study.name, context.quick ? " --quick" : "",
                   context.devices.size() > 1 && study.has_device_series ? " --cuda" : "", scene,
                   shell_word(out.string()))},
      {"machine", machine_of(context)},
      {"complete", false},
      {"points", json::array()}};
  if (study.name == "terms") result["scene_settings"] = scene_text(load_scene(context.scene));
  return result;
}

// Rows of the points of a plan, in the plan's order.
class Rows {
 public:
  // known: rows of an earlier run. Rows of points that the plan lacks (another device's) are kept at the end.
  Rows(const std::vector<LabPoint>& plan, const json& known) : rows_(plan.size()) {
    for (const json& row : known) {
      const std::string key = row.value("key", "");
      const auto point =
          std::find_if(plan.begin(), plan.end(), [&](const LabPoint& p) { return p.key == key; });
      std::vector<json>& kept =
          point == plan.end() ? others_ : rows_[static_cast<std::size_t>(point - plan.begin())];
      kept.push_back(row);
    }
  }
  bool has(std::size_t point) const { return !rows_[point].empty(); }
  void set(std::size_t point, json measured, const std::string& key) {
    if (!measured.is_array()) measured = json::array({std::move(measured)});
    for (json& row : measured) {
      measured_series_.insert(row.value("device", "cpu"));
      row["key"] = key;
      rows_[point].push_back(std::move(row));
    }
  }
  const std::set<std::string>& measured_series() const { return measured_series_; }
  std::size_t num_done() const {
    return static_cast<std::size_t>(
        std::count_if(rows_.begin(), rows_.end(), [](const auto& rows) { return !rows.empty(); }));
  }
  json all() const {
    json list = json::array();
    for (const auto& rows : rows_) {
      for (const json& row : rows) list.push_back(row);
    }
    for (const json& row : others_) list.push_back(row);
    return list;
  }

 private:
  std::vector<std::vector<json>> rows_;  // by point
  std::vector<json> others_;
  std::set<std::string> measured_series_;
};

// Measures the points that `rows` lacks. Saves the result after each point; of a study that runs in parallel
// after each second.
void measure_points(const Study& study, const std::vector<LabPoint>& points, const LabOptions& options,
                    LabRanks& ranks, Rows& rows, json& result) {
  Progress progress(study.name, points.size(), rows.num_done());
  std::mutex guard;
  Clock::time_point saved = Clock::now();
  const auto measure_all = [&](const std::vector<std::size_t>& wanted, bool in_parallel) {
    LabRanks::Work work{study.name, {}, in_parallel};
    for (const std::size_t at : wanted) work.points.push_back(points[at]);
    const auto before = [&](std::size_t k) {
      const std::lock_guard lock(guard);
      progress.show(rows.num_done(), work.points[k].key);
    };
    const auto keep = [&](std::size_t k, json measured) {
      const std::lock_guard lock(guard);
      rows.set(wanted[k], std::move(measured), work.points[k].key);
      if (study.runs_in_parallel && milliseconds_since(saved) < 1000.0) return;
      saved = Clock::now();
      result["points"] = rows.all();
      save_study(options.out, result);
    };
    try {
      ranks.measure(work, before, keep);
    } catch (...) {  // what is measured is kept for --resume
      result["points"] = rows.all();
      save_study(options.out, result);
      throw;
    }
  };
  std::vector<std::size_t> missing, alone;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!rows.has(k)) (study.runs_in_parallel && points[k].is_timing ? alone : missing).push_back(k);
  }
  measure_all(missing, study.runs_in_parallel);
  measure_all(alone, false);
  result["points"] = rows.all();
  save_study(options.out, result);
  progress.end(fmt::format("{} of {} points, {}", rows.num_done(), points.size(),
                           (options.out / (study.name + ".*")).string()));
}

void print_texts(std::FILE* file, const json& result, const char* key, const std::string& before) {
  for (const json& text : result.value(key, json::array()))
    std::fputs(fmt::format("{}{}\n", before, text.get<std::string>()).c_str(), file);
  std::fflush(file);
}

// Runs a plot script; prints what went wrong and returns false if it failed.
bool draw(const std::string& script, const std::filesystem::path& folder) {
  const std::string error = run_plot(script, folder);
  print_note(error);
  return error.empty();
}

// Returns whether all points are measured and agree with their references.
bool run_study(const Study& study, const LabContext& context, const LabOptions& options, LabRanks& ranks) {
  json result = start_result(study, context, options.out);
  if (ranks.num() > 1) result["machine"]["processes"] = ranks.num();
  const json devices = result["machine"]["devices"];
  bool others_are_complete = true;  // series that this run does not measure
  if (options.resume) {
    others_are_complete = resume_study(options.out, study, result);
  } else {
    remove_pictures(options.out, study.name);
  }
  const std::vector<LabPoint> points = study.plan(context);
  Rows rows(points, result["points"]);
  const std::size_t num_known = rows.num_done();
  const MachineLoad load;
  measure_points(study, points, options, ranks, rows, result);
  for (const std::string& series : rows.measured_series()) add_device(devices, series, result["machine"]);
  result["complete"] = others_are_complete && rows.num_done() == points.size();
  // With several ranks much of the load of others is that of the other ranks.
  if (rows.num_done() > num_known && ranks.num() == 1) note_load(load, result["machine"]);
  study.conclude(result);
  save_study(options.out, result);
  if (result["complete"].get<bool>() && study.name == "work-precision")
    print_note(keep_accuracy_table(options.out, cached_table_file()));
  draw(study.name + ".py", options.out);
  print_texts(stdout, result, "words", result["complete"].get<bool>() ? "" : "so far: ");
  print_texts(stderr, result, "failed", study.name + ": disagrees with its reference: ");
  return result["complete"].get<bool>() && result.value("failed", json::array()).empty();
}

// The keys of study terms begin with the scene: a term is compared with the same flight with all of them.
void check_scene(const json& result, const LabContext& context, const LabOptions& options) {
  for (const json& row : result.at("points")) {
    const std::string key = row.at("key"), scene = key.substr(0, key.rfind('/'));
    if (scene != context.scene)
      refuse_to_resume(options.out, "terms", fmt::format("was measured with --scene {}; give that", scene));
  }
  if (result.at("scene_settings") != scene_text(load_scene(context.scene))) {
    refuse_to_resume(
        options.out, "terms",
        fmt::format("was measured when scene {} had other settings; give it those again", context.scene));
  }
}

// Throws UserError if the earlier run in the folder cannot be continued.
void check_resume(const Study& study, const LabContext& context, const LabOptions& options) {
  json result = start_result(study, context, options.out);
  resume_study(options.out, study, result);
  if (study.name == "terms") check_scene(result, context, options);
  try {
    study.conclude(result);
  } catch (const json::exception&) {
    refuse_to_resume(options.out, study.name, "lacks figures of its points; remove it");
  }
}

LabContext context_of(const LabOptions& options, const LabMachine& machine) {
  limit_parallel_threads(machine.num_threads);
  return {options.quick, machine.devices, options.scene};
}

std::vector<Study> chosen(const std::string& name) {
  if (name == "all") return studies();
  for (const Study& study : studies()) {
    if (study.name == name) return {study};
  }
  throw UserError(fmt::format("lab: {} is not a study", in_quotes(name)));
}

}  // namespace

const std::vector<Study>& studies() {
  static const std::vector<Study> all = {work_precision_study(), stability_study(),    contact_clock_study(),
                                         terms_study(),          gas_dynamics_study(), validate_study()};
  return all;
}

int plot_lab(const std::filesystem::path& folder) {
  std::vector<std::string> scripts;
  for (const Study& study : studies()) {
    std::error_code unreadable;  // is told below as a folder without results
    if (std::filesystem::exists(folder / (study.name + ".json"), unreadable))
      scripts.push_back(study.name + ".py");
  }
  if (scripts.empty()) {
    throw UserError(fmt::format("lab plot: {} holds no result of a study; give the folder of --out",
                                in_quotes(folder.string())));
  }
  scripts.emplace_back("report.py");
  bool drawn = true;
  for (const std::string& script : scripts) {
    drawn = draw(script, folder) && drawn;
  }
  return drawn ? 0 : 1;
}

int run_lab(const LabOptions& options, const LabMachine& machine, const std::atomic<bool>& stop) {
  const std::vector<Study> wanted = chosen(options.study);
  const LabContext context = context_of(options, machine);
  // Planning refuses wrong options before any work, and before the folder is made.
  for (const Study& study : wanted) study.plan(context);
  std::error_code unreadable;  // is told by open_results()
  if (options.resume && !std::filesystem::exists(options.out, unreadable) && !unreadable)
    print_note(
        fmt::format("--resume: {} does not exist; all points are measured", in_quotes(options.out.string())));
  open_results(options.out, options.resume  ? Existing::resume
                            : options.force ? Existing::overwrite
                                            : Existing::refuse);
  for (const Study& study : options.resume ? wanted : std::vector<Study>()) {
    check_resume(study, context, options);
  }
  LabRanks ranks(machine.carrier, machine.num_threads, stop);
  bool complete = true;
  for (const Study& study : wanted) {
    if (stop) break;
    complete = run_study(study, context, options, ranks) && complete;
  }
  draw("report.py", options.out);
  if (stop) {
    print_note(fmt::format("stopped; the finished points are in {}; continue with{}{} --resume",
                           options.out.string(), options.quick ? " --quick" : "",
                           context.devices.size() > 1 ? " --cuda" : ""));
  }
  return complete && !stop ? 0 : 1;
}

void help_run_lab(const LabOptions& options, const LabMachine& machine) {
  help_lab(*machine.carrier, context_of(options, machine), machine.num_threads);
}

}  // namespace pf
