// The run loop: events, simulation, picture, panel, film; in a window or without one.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "app/options.hpp"
#include "app/report.hpp"
#include "app/simulation.hpp"
#include "app/term_costs.hpp"
#include "view/context.hpp"
#include "view/parcel_buffers.hpp"

namespace pf {

// Set by main's handler of SIGINT, SIGTERM and SIGHUP: the run ends after the current frame and finishes film
// and report.
inline std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may set it");

struct StageHooks {
  // Makes the draw target for the backend; null: the host target. Called with the context
  // current, at the start and again after a change of backend.
  std::function<std::unique_ptr<GlDrawTarget>(Backend& backend)> make_draw_target;
  // Makes a backend beside the run's, of that name, on the same device: the terms of the model are timed on
  // it. threads: as in the settings. Null: they are not timed.
  MakeBackend make_backend;
  // Receives messages for the person, as what draws and why; may be null.
  std::function<void(const std::string&)> announce;
  // A file with the rectangle of each control (ControlMap), written when they move. Empty: none.
  std::filesystem::path panel_map;
  // End of the slider of N.
  std::int64_t max_parcels = 1'000'000;
};

// The context that the options ask for: a window, or memory if headless or if there is no display
// (announced). Throws DeviceError. Made before the backend, which may have to run on the device that draws.
std::unique_ptr<GlContext> open_stage_context(const Options& options, const StageHooks& hooks);

// Runs until the window closes, settings.seconds or the log of a replay are over, a headless flight has
// ended, the time of a still is reached, or a stop is requested. Feeds `record`, writes the film and the
// picture. Returns the exit code: 0, or 1 if a headless run had to stop because the simulation paused itself,
// if an output broke off, or if a replay diverged. Throws UserError and DeviceError.
int run_stage(const Options& options, GlContext& context, Simulation& simulation, RunRecord& record,
              const StageHooks& hooks);

}  // namespace pf
