#include "app/option_bench.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/frame_names.hpp"
#include "app/option_values.hpp"
#include "core/error.hpp"

namespace pf {

namespace fs = std::filesystem;

void check_sweep(const CLI::App& app, const Typed& typed, const Options& options) {
  if (!options.sweep && typed.sweep_max) throw UserError("--sweep-max: needs --sweep; add it");
  const bool has_others = options.draw_target != "auto" || options.domain_link != "auto" || typed.scene ||
                          typed.size || typed.accuracy || typed.of || typed.frames || typed.steps ||
                          typed.warmup || typed.repeats || !typed.sets.empty() || !typed.flags.empty() ||
                          !typed.record.empty() || options.bench_panel || options.bench_flight ||
                          typed.force || typed.domains || app.count("--cuda") > 0;
  if (options.sweep && has_others) {
    throw UserError(
        "--sweep: chooses scene, settings and frames itself; it allows only --sweep-max, --json and "
        "--cuda-no-fallback; leave out the rest");
  }
}

namespace {

// Refuses options that the timed work does not use, instead of ignoring them silently.
void check_frame_bench(const CLI::App& app, const Typed& typed, const Options& options) {
  const bool has_steps = typed.steps || typed.warmup || typed.repeats;
  if (options.bench_flight && (typed.frames || has_steps))
    throw UserError(
        "--flight: times all frames of a flight, once; leave out --frames, --steps, --warmup, --repeats");
  if (typed.frames && (has_steps || options.seconds_given))
    throw UserError(
        "--frames: times so many frames, once; leave out --steps, --warmup, --repeats, --seconds");
  if (options.sweep || typed.frames) return;
  for (const char* flag : {"--size", "--draw-target"}) {
    if (app.count(flag) > 0)
      throw UserError(fmt::format("{}: needs --frames N, since nothing else is drawn; add it", flag));
  }
  if (options.seconds_given && !options.bench_flight)
    throw UserError("--seconds: needs --flight, since --steps are timed otherwise; add it or leave it out");
}

}  // namespace

void read_frame_bench(const CLI::App& app, const Typed& typed, Options& options) {
  const bool has_record = app.count("--record") > 0;
  check_frame_bench(app, typed, options);
  if (!typed.frames && (has_record || options.bench_panel)) {
    throw UserError(fmt::format("{}: needs --frames N, since steps alone are not drawn; add it",
                                has_record ? "--record" : "--panel"));
  }
  if (!has_record && app.count("--record-time") > 0)
    throw UserError("--record-time: needs --record FILE; add it");
  check_name("--record-time", typed.record_time, kRecordTimes);
  options.record_real_time = typed.record_time == "real";
  options.record = typed.record == kNullDevice ? fs::path(kNullDevice) : record_file(app, typed.record);
  if (!has_record || typed.size) return;
  options.width_px = 1920;
  options.height_px = 1080;
}

}  // namespace pf
