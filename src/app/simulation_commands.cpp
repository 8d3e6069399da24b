// Commands to a simulation, applied or refused.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "app/command_queue.hpp"
#include "app/domain_checks.hpp"
#include "app/simulation_state.hpp"
#include "core/file_ending.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

constexpr double kMinKeyTimeScale = 0.001;  // lower limit for keys; panel and scenes may go lower

}  // namespace

void Simulation::State::apply_settings(const Settings& wanted) {
  check_settings(wanted, "panel");
  Settings with = wanted;
  resolve(with);
  const bool keeps_half_step = scene_dt_s && with.dt_s == settings.dt_s;
  if (keeps_half_step && differ(settings, with, &Effects::parcels)) {  // half of what the scene has then
    with.dt_s = *scene_dt_s;
    with.dt_s = half_step_of(with);
  }
  const Physics derived = physics_in_flight(with);
  check_backend(with, derived, *backend);
  std::vector<Ghost> ghosts_with = ghosts_of_flight(with);
  const bool is_respawned = differ(settings, with, &Effects::parcels);
  std::optional<NewAir> air;
  if (is_respawned) air.emplace(new_air(as_launched(with), ball));  // throws before anything changes
  if (with.threads != settings.threads) change_threads(with);
  if (air) {
    respawn(*air);
  } else {
    physics = derived;
    backend->set_physics(physics);
  }
  if (with.ball_spin_radps != settings.ball_spin_radps) {
    ball.spin_radps = with.ball_spin_radps;
    backend->set_ball(ball);
  }
  if (!keeps_half_step) scene_dt_s.reset();
  const bool flies = view.flight == Flight::flying && flight.points_m.size() > 1;
  Settings same_pace = with;  // steps of a set length are the same, however many there are in a frame
  if (paces_by_substeps(settings) && paces_by_substeps(with)) same_pace.substeps = settings.substeps;
  flight.disturbed = flight.disturbed || (flies && differ(settings, same_pace, &Effects::flight));
  settings = with;
  profile_is_due = true;
  ghosts = std::move(ghosts_with);
}

// Starts another scene. Settings of the run and its film are kept.
void Simulation::State::change_scene(const std::string& name) {
  Settings with = load_scene(name);
  with.threads = settings.threads;
  with.seconds = settings.seconds;
  with.frame_rate_hz = settings.frame_rate_hz;
  restart(with);
}

void Simulation::State::restart(Settings with) {
  resolve(with);
  scene_dt_s.reset();
  reset(with);
  view.paused = false;
  ++view.num_scenes;
}

// Replaces the thread team and keeps the parcels. The time of `exact` restarts, on a device, too, so that a
// log gives the same flight everywhere.
void Simulation::State::change_threads(const Settings& with) {
  const Spawner spawner(settings, physics, ball);
  const ParcelSnapshot parcels = backend->snapshot();
  check_room(with, 0);
  if (std::unique_ptr<Backend> fresh = backend->with_threads(static_cast<unsigned>(with.threads))) {
    fresh->reset(physics, spawner.plan(), ball);
    backend = std::move(fresh);
  } else {
    backend->reset(physics, spawner.plan(), ball);
  }
  backend->restore(parcels);
}

// Makes the flight faster or slower: by run.substeps where these set the pace, else by run.time_scale.
void Simulation::State::scale_time(double factor) {
  const FramePlan plan = plan_frame(settings, physics, ball, collision_rate_per_s);
  Settings wanted = settings;
  if (paces_by_substeps(settings)) {
    const double num = static_cast<double>(settings.substeps) * factor;
    wanted.substeps = std::llround(std::clamp(num, 1.0, find_field("run.substeps", "keys").max));
  } else {
    // Steps may be too short for the pace that is asked for: then slower is slower than what is seen.
    const bool is_slower = plan.slow_motion < 0.95 * settings.time_scale;
    const double now = is_slower && factor < 1.0 ? plan.slow_motion : settings.time_scale;
    const double min = std::min(kMinKeyTimeScale, settings.time_scale);
    wanted.time_scale = std::clamp(now * factor, min, find_field("run.time_scale", "keys").max);
  }
  const bool is_slowest = settings.dt_s > 0.0 && plan.num_steps == 1 && factor < 1.0;
  if (is_slowest) {
    view.notice =
        fmt::format("One step of {:g} s a frame is the slowest; shorten the time step", settings.dt_s);
    return;
  }
  const Settings before = std::exchange(settings, wanted);
  note_change(before);
}

void Simulation::State::save_scene(const std::string& name) {
  const std::filesystem::path file = with_toml_ending(name);
  save_new_scene_file(file, settings);
  view.notice = fmt::format("Saved: {}", file.string());
}

// A refused edit does not stop the other commands: the log records them without it.
void Simulation::State::edit_settings(const Settings& wanted) {
  try {
    change_settings(wanted);
    edited = settings;
  } catch (const UserError& error) {
    view.message = error.what();
  }
}

// Throws UserError if a command cannot be executed.
void Simulation::State::apply_commands(const Commands& commands) {
  if (commands.drop_future) drop_future();
  if (commands.settings) edit_settings(*commands.settings);
  if (commands.time_scale_factor != 1.0) scale_time(commands.time_scale_factor);
  if (commands.reset) reset(settings);
  if (!commands.scene.empty()) change_scene(commands.scene);
  if (commands.restart) restart(*commands.restart);
  if (commands.fly) fly(*commands.fly);
  if (commands.compare != Comparison::none) compare(commands.compare, commands.next_method);
  if (commands.back) go_back();
  if (commands.seek_s) seek(*commands.seek_s);
  if (!commands.save_scene.empty()) save_scene(commands.save_scene);
}

void Simulation::State::execute(const Commands& commands) {
  const bool changes = commands.settings || commands.reset || commands.restart || commands.fly ||
                       commands.back || commands.seek_s || commands.compare != Comparison::none ||
                       commands.time_scale_factor != 1.0 || !commands.scene.empty() ||
                       !commands.save_scene.empty();
  if (changes) {
    view.message.clear();
    view.notice.clear();
  }
  try {
    apply_commands(commands);
  } catch (const UserError& error) {
    view.message = error.what();
  }
  if (commands.launch && physics.ball.exists) launch(false);
  if (commands.toggle_pause) view.paused = !view.paused;
}

}  // namespace pf
