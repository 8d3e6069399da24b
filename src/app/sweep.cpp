#include "app/sweep.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <stdlib.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/child_process.hpp"
#include "app/report.hpp"
#include "app/sweep_plan.hpp"
#include "core/error.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kFrameRate_hz = 60.0;     // converts a number of frames to seconds of a run
constexpr double kTimeout_ms = 180'000.0;  // start and spawning included
constexpr const char* kScene = "court";

// Settings that reproduce the seed's frame: the ball in its court, one step per frame, walls.
const std::vector<std::string> kSettings = {"run.substeps=1", "world.boundary=walls"};

json definitions() {
  return {
      {"frame", "wall time from the end of one frame to the end of the next; means over the timed frames"},
      {"physics", "the phases of a step; on a GPU measured by its own events"},
      {"render", "phases map, unmap, draw and present"},
      {"overhead",
       "the frame less physics and render: overlay, input, the loop itself; 0 where a GPU works beside the "
       "host and the parts exceed the frame; percentages are of the sum of the three"},
      {"gpu_utilization_percent",
       "share of the wall time in which the device's events were busy with physics; null on a CPU"},
      {"parcel_memory_bytes",
       "state and scratch that the backend holds for the parcels: GPU memory for CUDA"},
      {"process_peak_bytes", "peak of the process's main memory, program and renderer included"},
      {"extrapolated",
       "not run, since it would take over 20 s: from the largest measured point of the series, "
       "all-pairs as N^2, grid as N"},
  };
}

// Result of the run of one point.
struct Outcome {
  json report;          // null: it failed or was stopped
  std::string failure;  // reason; empty if it was stopped
  std::uint64_t peak_host_bytes = 0;
};

// File for the report of a run, in a temporary folder of its own.
class ReportFile {
 public:
  ReportFile() {
    std::string folder = (fs::temp_directory_path() / "pickleflight-sweep-XXXXXX").string();
    if (::mkdtemp(folder.data()) == nullptr) {
      throw OutputError(fmt::format("{}: no temporary folder can be made ({}); set TMPDIR to another folder",
                                    in_quotes(folder), std::strerror(errno)));
    }
    path_ = fs::path(folder) / "report.json";
  }
  ~ReportFile() {
    std::error_code ignored;
    fs::remove_all(path_.parent_path(), ignored);
  }
  ReportFile(const ReportFile&) = delete;
  ReportFile& operator=(const ReportFile&) = delete;
  const fs::path& path() const { return path_; }
  void clear() const {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }

 private:
  fs::path path_;
};

std::vector<std::string> run_arguments(const SweepSeries& series, std::int64_t num_parcels, FrameCount frames,
                                       const fs::path& report) {
  const double seconds = (frames.warmup + frames.timed) / kFrameRate_hz;
  std::vector<std::string> all = {fs::read_symlink("/proc/self/exe").string(), "run", "--headless"};
  const auto add = [&all](const char* flag, const std::string& value) {
    all.push_back(flag);
    all.push_back(value);
  };
  add("--scene", kScene);
  for (const std::string& setting : kSettings) add("--set", setting);
  add("-p", fmt::format("{}", num_parcels));
  add("--neighbors", series.neighbors == Neighbors::grid ? "grid" : "all-pairs");
  add("--threads", fmt::format("{}", series.threads));
  add("--seconds", fmt::format("{}", seconds));
  add("--warmup", fmt::format("{}", frames.warmup));
  add("--report", report.string());
  if (series.cuda) all.push_back("--cuda-no-fallback");
  return all;
}

Outcome run_point(const std::vector<std::string>& arguments, const ReportFile& file,
                  const std::atomic<bool>& stop) {
  file.clear();
  ChildProcess child(arguments, -1);
  const Clock::time_point start = Clock::now();
  std::optional<ChildExit> end;
  bool stopped = false;
  while (!(end = child.poll())) {
    if (stop && !stopped) child.signal(SIGINT);
    stopped = stopped || stop;
    if (milliseconds_since(start) > kTimeout_ms) {
      return {nullptr, fmt::format("timed out after {:.0f} s", 1e-3 * kTimeout_ms), 0};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (stopped) return {};
  if (!end->good) return {nullptr, child.last_errors(), end->peak_host_bytes};
  std::ifstream stream(file.path());
  json report = json::parse(stream, nullptr, false);
  if (report.is_discarded()) return {nullptr, "its report cannot be read", end->peak_host_bytes};
  return {std::move(report), "", end->peak_host_bytes};
}

json percent(double part, double whole) { return whole > 0.0 ? json(100.0 * part / whole) : json(nullptr); }

FrameCost cost_of(const json& report) {
  const json& frames = report.at("frames");
  return {frames.at("physics_ms"), frames.at("render_ms"), frames.at("overhead_ms")};
}

json measured_point(const SweepSeries& series, std::int64_t num_parcels, const Outcome& outcome) {
  const FrameCost cost = cost_of(outcome.report);
  const json& frames = outcome.report.at("frames");
  const double frame_ms = frames.at("frame_ms");
  const int num = frames.at("num");
  return {
      {"num_parcels", num_parcels},
      {"extrapolated", false},
      {"warmup_frames", frames.at("warmup")},
      {"frames", num},
      {"total_ms", num * frame_ms},
      {"frame_ms", frame_ms},
      {"physics_ms", cost.physics_ms},
      {"render_ms", cost.render_ms},
      {"overhead_ms", cost.overhead_ms},
      {"physics_percent", percent(cost.physics_ms, cost.total_ms())},
      {"render_percent", percent(cost.render_ms, cost.total_ms())},
      {"overhead_percent", percent(cost.overhead_ms, cost.total_ms())},
      {"gpu_utilization_percent", series.cuda ? percent(cost.physics_ms, frame_ms) : json(nullptr)},
      {"parcel_memory_bytes", outcome.report.at("memory_bytes")},
      {"process_peak_bytes", outcome.peak_host_bytes},
  };
}

// Extrapolates physics alone, since its law is known. That of the renderer is not.
json extrapolated_point(std::int64_t num_parcels, std::int64_t from, double physics_ms) {
  return {{"num_parcels", num_parcels},
          {"extrapolated", true},
          {"extrapolated_from", from},
          {"physics_ms", physics_ms}};
}

void print_header(const std::string& name, const std::string& device) {
  fmt::print(
      "\n{} ({})\n{:>11} {:>6} {:>10} {:>11} {:>10} {:>10} {:>10}  {:>7} {:>7} {:>7} {:>9} {:>9} {:>6}\n",
      name, device, "N", "frames", "total ms", "physics ms", "render ms", "overhead", "frame ms", "phys %",
      "rend %", "over %", "air MB", "host MB", "GPU %");
}

void print_point(const json& point) {
  const std::int64_t num = point.at("num_parcels");
  if (point.at("extrapolated")) {
    fmt::print("{:>11} {:>6} {:>10} {:>11.4g} extrapolated from N = {}\n", num, "-", "-",
               point.at("physics_ms").get<double>(), point.at("extrapolated_from").get<std::int64_t>());
    return;
  }
  const auto value = [&point](const char* key) { return point.at(key).get<double>(); };
  const json& busy = point.at("gpu_utilization_percent");
  fmt::print(
      "{:>11} {:>6} {:>10.1f} {:>11.4g} {:>10.4g} {:>10.4g} {:>10.4g}  {:>7.2f} {:>7.2f} {:>7.2f} {:>9.2f} "
      "{:>9.1f} {:>6}\n",
      num, point.at("frames").get<int>(), value("total_ms"), value("physics_ms"), value("render_ms"),
      value("overhead_ms"), value("frame_ms"), value("physics_percent"), value("render_percent"),
      value("overhead_percent"), 1e-6 * value("parcel_memory_bytes"), 1e-6 * value("process_peak_bytes"),
      busy.is_null() ? "-" : fmt::format("{:.1f}", busy.get<double>()));
}

class Sweep {
 public:
  Sweep(const Options& options, const std::atomic<bool>& stop) : options_(options), stop_(stop) {
    result_ = {{"kind", "sweep"},
               {"version", PF_VERSION},
               {"scene", kScene},
               {"settings", kSettings},
               {"definitions", definitions()},
               {"series", json::array()},
               {"skipped", json::array()},
               {"complete", false}};
  }

  void skip(const SweepSeries& series, const std::string& reason) {
    fmt::print("\n{}: skipped, {}\n", series.name, reason);
    result_["skipped"].push_back({{"name", series.name}, {"reason", reason}});
    save();
  }

  void run(const SweepSeries& series);

  int finish() {
    if (stop_) fmt::print("\nstopped; the points above are finished\n");
    result_["complete"] = !stop_ && !failed_;
    save();
    return stop_ || failed_ ? 1 : 0;
  }

 private:
  void save() const {
    if (!options_.bench_json.empty()) write_report(options_.bench_json, result_);
    std::fflush(stdout);
  }
  void add(json& series, const json& point) {
    series["points"].push_back(point);
    result_["series"].back() = series;
    save();
    print_point(point);
  }

  const Options& options_;
  const std::atomic<bool>& stop_;
  ReportFile file_;
  json result_;
  bool failed_ = false;
};

void Sweep::run(const SweepSeries& series) {
  json entry = {{"name", series.name},
                {"backend", series.cuda ? "cuda" : "cpu"},
                {"threads", series.cuda ? json(nullptr) : json(series.threads)},
                {"neighbors", series.neighbors == Neighbors::grid ? "grid" : "all-pairs"},
                {"points", json::array()}};
  std::optional<FrameCost> known;  // of the largest measured point
  std::int64_t known_size = 0;
  for (const std::int64_t size : sweep_sizes(options_.sweep_max)) {
    if (stop_) return;
    std::optional<FrameCost> expected;
    if (known) expected = scaled_cost(*known, known_size, size, series.neighbors);
    const std::optional<FrameCount> frames = plan_frames(expected);
    if (!frames) {
      add(entry, extrapolated_point(size, known_size, expected->physics_ms));
      continue;
    }
    const Outcome outcome = run_point(run_arguments(series, size, *frames, file_.path()), file_, stop_);
    if (outcome.report.is_null()) {
      if (outcome.failure.empty()) return;
      fmt::print("{}, N = {}: failed, the series ends here: {}\n", series.name, size, outcome.failure);
      result_["skipped"].push_back(
          {{"name", series.name}, {"from_num_parcels", size}, {"reason", outcome.failure}});
      failed_ = true;
      return save();
    }
    if (!known) {
      entry["device"] = outcome.report.at("device");
      entry["renderer"] = outcome.report.at("renderer");
      result_["series"].push_back(entry);
      print_header(series.name, entry["device"]);
    }
    known = cost_of(outcome.report);
    known_size = size;
    add(entry, measured_point(series, size, outcome));
  }
}

}  // namespace

int run_sweep(const Options& options, const std::string& cuda_obstacle, const std::atomic<bool>& stop) {
  Sweep sweep(options, stop);
  for (const SweepSeries& series : sweep_series()) {
    if (stop) break;
    if (series.cuda && !cuda_obstacle.empty())
      sweep.skip(series, cuda_obstacle);
    else
      sweep.run(series);
  }
  return sweep.finish();
}

}  // namespace pf
