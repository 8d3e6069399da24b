// Main program: joins command line, backend, simulation and stage. Turns errors that end the program into
// exit codes; Ranks::serve does so on the other ranks.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>

#include "app/accuracy.hpp"
#include "app/accuracy_table.hpp"
#include "app/bench.hpp"
#include "app/flight_bench.hpp"
#include "app/memory.hpp"
#include "app/options.hpp"
#include "app/profile_log.hpp"
#include "app/report.hpp"
#include "app/simulation.hpp"
#include "app/sweep.hpp"
#include "backend/domains/rank_threads.hpp"
#include "backends.hpp"
#include "core/error.hpp"
#include "data/read_start.hpp"
#include "data/run_files.hpp"
#include "lab/lab.hpp"
#include "lab/validate.hpp"
#include "mpi/launcher.hpp"
#include "process.hpp"
#include "ranks.hpp"
#include "scene/scene_file.hpp"
#include "view/domain_draw_target.hpp"
#include "view/stage.hpp"
#if PF_HAVE_CUDA
#include "cuda/gl/gl_interop.hpp"
#include "view/host_draw_target.hpp"
#endif

namespace pf {
namespace {

// The device on which GL draws, so that buffers can be shared. 0 if unknown.
int device_for(const GlContextInfo& info) {
#if PF_HAVE_CUDA
  if (cuda_obstacle().empty()) return cuda_device_of_gl(info.cuda_device);
#endif
  return info.cuda_device < 0 ? 0 : info.cuda_device;
}

void set_draw_target(const Options& options, [[maybe_unused]] const Backend& backend,
                     [[maybe_unused]] StageHooks& hooks) {
#if PF_HAVE_CUDA
  if (backend.name() == "cuda" && backend.num_domains() == 1 && options.draw_target != "images") {
    hooks.max_parcels = 1'000'000'000;
    hooks.make_draw_target = [kind = options.draw_target](Backend& running) -> std::unique_ptr<GlDrawTarget> {
      if (running.name() == "cuda") return make_cuda_draw_target(kind);
      return std::make_unique<HostDrawTarget>("CPU backend");
    };
    return;
  }
#endif
  if (backend.num_domains() > 1) {
    using Use = DomainDrawTarget::Use;
    const Use use = options.draw_target == "images" ? Use::images
                    : options.draw_target == "host" ? Use::host
                                                    : Use::by_number;
    if (backend.name() == "cuda") hooks.max_parcels = 1'000'000'000;
    const auto num = static_cast<std::size_t>(resolve_num_parcels(options.settings, backend.name()));
    hooks.make_draw_target = [use, num](Backend& running) -> std::unique_ptr<GlDrawTarget> {
      if (running.images() != nullptr) return std::make_unique<DomainDrawTarget>(use, num);
      return std::make_unique<HostDrawTarget>("CPU backend");
    };
  } else if (options.draw_target == "images") {
    throw UserError("--draw-target: images needs several domains (--domains, mpirun); leave it out");
  }
  if (options.draw_target == "interop" || options.draw_target == "staged") {
    if (backend.name() == "cuda")
      throw UserError("--draw-target: " + options.draw_target +
                      " works in one domain only; leave it out, or leave out --domains and mpirun");
    throw UserError("--draw-target: " + options.draw_target +
                    " needs the CUDA backend (--cuda); the CPU backend draws through: host");
  }
}

struct StageRun {
  int exit_code = 0;
  nlohmann::json report;
};

// Before anything flies.
void check_room_for_cues(const Options& options, const Simulation& simulation) {
  for (const Cue& cue : cues_of(options)) {
    try {
      simulation.check_room(cue.settings);
    } catch (const UserError& error) {
      throw UserError(fmt::format("--cues: {}: this cue cannot run: {}", cue.place, error.what()));
    }
  }
}

StageRun run_on_stage(const Options& options, const Ranks& ranks) {
  stop_gracefully();
  expect_failing_writes();
  StageHooks hooks;
  hooks.announce = announce;
  hooks.panel_map = options.panel_map;
  const std::unique_ptr<GlContext> context = open_stage_context(options, hooks);
  const int device = device_for(context->info());
  hooks.make_backend = [device](const std::string& name, std::int64_t threads) {
    return name == "cuda" ? cuda_backend_on(device) : make_cpu_backend(static_cast<unsigned>(threads));
  };
  std::unique_ptr<Backend> backend = choose_backend(options, device, ranks);
  set_draw_target(options, *backend, hooks);
  const std::string device_name = backend->device();
  const bool may_fall_back = backend->name() != "cpu" && !options.cuda_no_fallback && ranks.num() == 1;
  const RunState* start = options.data.start.get();
  Simulation simulation =
      start ? Simulation(*start, std::move(backend)) : Simulation(options.settings, std::move(backend));
  if (may_fall_back) {
    simulation.set_fallback(
        [&options] { return make_cpu_backend(static_cast<unsigned>(options.settings.threads)); });
  }
  check_room_for_cues(options, simulation);
  RunRecord record(*simulation.view().physics, start ? start->initial : simulation.backend().measure(),
                   device_name);
  if (start) record.continue_from(start->totals, start->simulated_s);
  record.set_warmup(options.warmup_frames);
  const int exit_code = run_stage(options, *context, simulation, record, hooks);
  const FrameView& view = simulation.view();
  record.set_device(simulation.backend().device());
  record.set_part("clock_s", view.simulated_s);  // less than simulated_s after a jump back
  nlohmann::json report = record.finish(simulation.settings(), *view.physics, simulation.backend(), view.ball,
                                        view.ball_distance_m);
  if (view.profile != nullptr) report["profile"] = profile_report(view);
  report["renderer"] = context->info().renderer;
  report["frames"] = record.frame_report();
  return {exit_code, std::move(report)};
}

int run(const Options& options, const Ranks& ranks) {
  check_replaced(options.data);
  if (!options.save_scene.empty()) save_new_scene_file(options.save_scene, options.settings);
  const StageRun run = run_on_stage(options, ranks);
  if (!options.report.empty()) write_report(options.report, run.report);
  return run.exit_code;
}

// Times the same frames without and with a film, in turn, so that a change of the machine's speed affects
// both.
StageRun bench_recording(const Options& options, const Ranks& ranks) {
  constexpr int kRounds = 3;
  Options without = options;
  without.record.clear();
  std::vector<nlohmann::json> plain;
  std::vector<nlohmann::json> recorded;
  int exit_code = 0;
  for (int round = 0; round < kRounds && !stop_requested; ++round) {
    StageRun bare = run_on_stage(without, ranks);
    if (stop_requested) break;
    StageRun run = run_on_stage(options, ranks);
    if (stop_requested) break;
    plain.push_back(std::move(bare.report));
    exit_code = std::max(exit_code, run.exit_code);
    recorded.push_back(std::move(run.report));
  }
  if (recorded.empty()) throw UserError("bench: stopped before the first measurement");
  nlohmann::json report = recorded.back();
  report["recording"] = recording_cost(plain, recorded);
  return {exit_code, std::move(report)};
}

// Times whole frames, offscreen, with overlay and, if requested, panel.
int bench_frames(Options options, const Ranks& ranks) {
  options.headless = true;
  options.record_panel = options.bench_panel;
  options.settings.seconds = options.bench_frames / options.settings.frame_rate_hz;
  const StageRun run =
      options.record.empty() ? run_on_stage(options, ranks) : bench_recording(options, ranks);
  print_frame_times(run.report);
  if (!options.bench_json.empty()) write_report(options.bench_json, run.report);
  return run.exit_code;
}

int bench(const Options& options, const Ranks& ranks) {
  if (options.sweep) {
    if (num_ranks_by_launcher() > 0) throw UserError("--sweep: starts runs of its own; leave out mpirun");
    const std::string obstacle = cuda_obstacle();
    if (options.cuda_no_fallback && !obstacle.empty()) throw DeviceError("--cuda-no-fallback: " + obstacle);
    stop_gracefully();
    return run_sweep(options, obstacle, stop_requested);
  }
  if (options.bench_frames > 0) return bench_frames(options, ranks);
  std::unique_ptr<Backend> backend = choose_backend(options, 0, ranks);
  if (options.bench_flight) {
    stop_gracefully();
    return run_flight_bench(options, std::move(backend), stop_requested);
  }
  if (backend->name() == "cpu") {
    Settings settings = options.settings;
    settings.num_parcels = resolve_num_parcels(settings, backend->name());
    check_memory(settings.num_parcels, host_bytes_here(*backend, settings), available_memory_bytes());
  }
  run_bench(options, *backend);
  return 0;
}

// Returns 1 if a row fails.
int validate(const Options& options) {
  const ValidationPlan plan = {options.lab.quick};
  fmt::print("{}\n", table_head());
  const auto show = [](const ValidationRow& row) {
    fmt::print("{}\n", table_line(row));
    std::fflush(stdout);
  };
  const nlohmann::json result = to_json(run_validation(plan, show), plan);
  if (!options.lab.json.empty()) write_report(options.lab.json, result);
  return result["passed"].get<bool>() ? 0 : 1;
}

// The devices of this rank: of several GPUs in a machine each rank takes one.
LabMachine lab_machine(const Options& options, const Ranks& ranks) {
  const unsigned num_threads = ranks.num() > 1 ? threads_of_rank(*ranks.carrier(), 0) : 0;
  LabMachine machine{{{"cpu", [=] { return make_cpu_backend(num_threads); }}}, ranks.carrier(), num_threads};
  const std::string obstacle = options.cuda ? cuda_obstacle() : "";
  if (options.cuda_no_fallback && !obstacle.empty()) throw DeviceError("--cuda-no-fallback: " + obstacle);
  if (!obstacle.empty() && ranks.leads()) announce("--cuda: " + obstacle + "; only the CPU is measured");
  const int device = static_cast<int>(ranks.carrier()->rank_here()) % num_gpus();
  if (options.cuda && obstacle.empty())
    machine.devices.push_back({"cuda", [=] { return cuda_backend_on(device); }});
  return machine;
}

int lab(const Options& options, const Ranks& ranks) {
  if (options.lab.study == "plot") return plot_lab(options.lab.out);
  if (options.lab.study == "validate" && options.lab.out.empty()) return validate(options);
  stop_gracefully();
  return run_lab(options.lab, lab_machine(options, ranks), stop_requested);
}

int list() {
  for (const SceneEntry& scene : list_scenes()) {
    fmt::print("{:<18} {}\n", scene.name, load_scene(scene.name).description);
  }
  return 0;
}

// Chooses method, time step and parcels by --accuracy, and prints the choice.
void choose_settings(Options& options, const Ranks& ranks) {
  if (options.accuracy.error <= 0.0) return;
  options.accuracy.refused = refused_methods(options, ranks);
  const std::string backend = options.cuda && cuda_obstacle().empty() ? "cuda" : "cpu";
  const std::filesystem::path table = accuracy_table_file();
  options.settings.num_parcels = resolve_num_parcels(options.settings, backend);
  options.chosen =
      choose_by_accuracy(read_accuracy_table(table), options.settings, options.accuracy, backend);
  options.chosen->table = table;
  options.settings = options.chosen->settings;
  fmt::print("{}", describe(*options.chosen, table));
  std::fflush(stdout);  // before the flight, also into a pipe
}

int dispatch(int argc, char** argv, const Ranks& ranks) {
  ParseResult parsed = parse_options(argc, argv);
  if (!parsed.options) {
    fmt::print("{}", parsed.text);
    return parsed.exit_code;
  }
  choose_settings(*parsed.options, ranks);
  read_start(*parsed.options);
  switch (parsed.options->command) {
    case Command::bench:
      return bench(*parsed.options, ranks);
    case Command::scenes:
      return list();
    case Command::lab:
      return lab(*parsed.options, ranks);
    default:
      return run(*parsed.options, ranks);
  }
}

// Prints what failed. Returns the exit code.
int explain(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const OutputError& error) {
    announce(fmt::format("pickleflight: {}", error.what()));
    return 1;
  } catch (const UserError& error) {
    announce(fmt::format("pickleflight: {}", error.what()));
    return 2;
  } catch (const DeviceError& error) {
    announce(fmt::format("pickleflight: {}", error.what()));
  } catch (const std::bad_alloc&) {
    announce("pickleflight: out of memory; give fewer parcels (-p) or a smaller --size");
  } catch (const std::system_error& error) {
    announce(fmt::format("pickleflight: {}", text_of(error)));
  } catch (const std::exception& error) {  // no other should be left
    announce(fmt::format("pickleflight: an unexpected error: {}; please report it", error.what()));
  }
  return 3;
}

// Returns the exit code. Errors of the user leave the other ranks in order.
int run_all(int argc, char** argv, const Ranks& ranks) {
  try {
    return dispatch(argc, argv, ranks);
  } catch (const BrokenRanks& broken) {
    explain(broken.cause);
  } catch (const std::exception&) {
    if (const int exit_code = explain(std::current_exception()); exit_code < 3) return exit_code;
  }
  return ranks.fail(3);
}

}  // namespace
}  // namespace pf

int main(int argc, char** argv) {
  pf::reserve_standard_streams();
  try {
    pf::Ranks ranks(argc, argv);
    if (ranks.leads()) return pf::after_output(pf::run_all(argc, argv, ranks));
    return ranks.serve(
        [&] {  // with the same arguments
          const pf::Options options = *pf::parse_options(argc, argv).options;
          pf::help_run_lab(options.lab, pf::lab_machine(options, ranks));
        },
        pf::find_domain_gpus);
  } catch (const pf::UserError& error) {
    pf::announce(fmt::format("pickleflight: {}", error.what()));
    return 2;
  }
}
