#include "app/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/command_queue.hpp"
#include "app/domain_checks.hpp"
#include "app/memory.hpp"
#include "app/simulation_state.hpp"

namespace pf {

void Simulation::State::resolve(Settings& with) const {
  // Without parcels, their number is kept for a later change of the air.
  if (with.air == Air::parcels) with.num_parcels = resolve_num_parcels(with, backend->name());
}

// Throws UserError if the host's memory does not suffice. held_bytes: released by the backend before.
void Simulation::State::check_room(const Settings& with, std::uint64_t held_bytes) const {
  const bool is_on_host = backend->name() == "cpu" || backend->num_domains() > 1;
  if (!is_on_host || with.air != Air::parcels) return;
  constexpr std::uint64_t kOtherBytes = 256ULL << 20;  // GL, text, a film: 190 MiB measured with llvmpipe
  // Domains draw many parcels without a copy of all.
  const std::uint64_t drawn = backend->images() == nullptr ? host_draw_bytes(with.num_parcels) : 0;
  const std::uint64_t needed = host_bytes_here(*backend, with) + drawn + kOtherBytes;
  const std::uint64_t available = available_memory_bytes();
  check_memory(with.num_parcels, needed, available > ~held_bytes ? available : available + held_bytes);
}

// Starts anew with these settings. Equal settings and seed give equal runs. Throws UserError, without any
// change, if they cannot run.
void Simulation::State::reset(const Settings& with) {
  respawn(new_air(with, initial_ball(with)));
  settings = with;
  num_launches = 0;
  left_once = false;
  old_flights.clear();
  last_number = 0;
  flight = {};
  view.totals = {};
  view.simulated_s = 0.0;
  collision_rate_per_s = 0.0;
  flight_seed = settings.seed;
  launch(true);
  show_plan();
}

// The settings for the flight under way, which a launch velocity set since does not concern.
Settings Simulation::State::as_launched(Settings with) const {
  with.ball_vx_mps = flight.launch_mps.x;
  with.ball_vy_mps = flight.launch_mps.y;
  return with;
}

// Roundings go on with the seed of the air.
Physics Simulation::State::physics_in_flight(const Settings& with) const {
  Physics derived = derive_physics(as_launched(with));
  derived.seed = physics.seed;
  return derived;
}

// Throws UserError if the backend cannot fly the settings, or the parcels do not fit around the ball.
NewAir Simulation::State::new_air(const Settings& with, const BallState& around) const {
  const Physics derived = derive_physics(with);
  check_backend(with, derived, *backend);
  NewAir air{derived, around, Spawner(with, derived, around)};
  check_room(with, backend->memory_bytes());
  return air;
}

void Simulation::State::respawn(const NewAir& air) {
  backend->reset(air.physics, air.spawner.plan(), air.ball);
  frame.reset();
  view.mid_step = false;
  step_ms = 0.0;
  num_frame_pictures = 1;
  collision_rate_per_s = 0.0;
  physics = air.physics;
  ball = air.ball;
  profile_is_due = true;
  free_flow.spawned();
  begin_history();
}

// Continues with another backend from the start of the scene, because the state was lost with the device.
void Simulation::State::fall_back(const DeviceError& error) {
  if (!make_fallback) throw;
  const std::string failed = backend->name();
  backend = make_fallback();
  make_fallback = nullptr;
  ++num_fallbacks;
  in_flight = false;
  Settings with = settings;
  with.num_parcels = std::min(settings.num_parcels, settings.num_parcels_cpu);
  try {
    reset(with);
  } catch (const UserError& no_room) {
    throw DeviceError(fmt::format("{} failed ({}), and {} cannot go on: {}", failed, error.what(),
                                  backend->name(), no_room.what()));
  }
  view.message = fmt::format("{} failed ({}); continuing with {} and {} parcels from the start of the scene.",
                             failed, error.what(), backend->name(), physics.parcels.num);
}

// Steps that cannot be done, as in a crowd that cannot be resolved, leave the flight where it is.
void Simulation::State::pause_at(const UserError& error) {
  in_flight = false;
  frame.reset();
  sought.reset();
  settings_at_sought.reset();
  view.mid_step = false;
  view.paused = true;
  view.message = error.what();
}

// Does the work and updates the view. If the device fails, the fallback goes on.
void Simulation::State::guard(const std::function<void()>& work) {
  const auto succeeds = [&](const std::function<void()>& part) {
    try {
      part();
      return true;
    } catch (const DeviceError& error) {
      fall_back(error);
    } catch (const UnresolvableError& error) {
      stop_at(error);
    } catch (const UserError& error) {
      pause_at(error);
    }
    return false;
  };
  succeeds(work);
  if (!succeeds([&] { update_view(); })) update_view();
}

// Steps of a frame that are complete count. What has passed of the last one does not.
void Simulation::State::stop_at(const UnresolvableError& error) {
  if (frame) take_over(error.report);
  if (frame) end_frame();
  pause_at(error);
}

// Not while a device works on steps.
void Simulation::State::follow_profile() {
  if (!profile_is_due || in_flight) return;
  profile_is_due = false;
  const bool is_on = settings.profile != ProfileAxis::off && physics.parcels.num > 0;
  const auto num_bins = static_cast<std::uint32_t>(settings.profile_bins);
  profile = is_on ? backend->profile(profile_shape(physics, settings.profile, num_bins)) : Profile{};
  view.profile = is_on ? &profile : nullptr;
}

void Simulation::State::update_view() {
  follow_profile();
  view.settings = &settings;
  view.physics = &physics;
  view.ball = ball;
  view.free_flow = free_flow.figures();
  view.flight_record = &flight;
  view.old_flights = &old_flights;
  view.ghosts = &ghosts;
  view.half_step = scene_dt_s.has_value();
  view.num_parcels = physics.parcels.num;
  view.backend = backend->name();
  for (const MethodRow& row : kMethods)
    view.refused[static_cast<std::size_t>(row.method)] = !backend->refusal_of(row.method).empty();
  view.memory_bytes = backend->memory_bytes();
  view.waits = !launches_by_itself();
  view.unfinished = frame || sought;
  view.history = &history;
  view.kept_s.clear();
  if (checkpoints) {
    for (const Checkpoint& kept : checkpoints->kept()) view.kept_s.push_back(history.time_at(kept.frame));
  }
  view.sought_s = sought ? std::optional(history.time_at(*sought)) : std::nullopt;
  view.asked = waiting.settings ? &*waiting.settings : nullptr;
  view.edited = edited ? &*edited : nullptr;
  view.waits_for_step = changes_anything(waiting);
}

Simulation::Simulation(Settings settings, std::unique_ptr<Backend> backend)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.backend = std::move(backend);
  s.resolve(settings);
  s.reset(settings);
  s.update_view();
}

Simulation::~Simulation() = default;

void Simulation::State::begin(const Commands& commands, DrawTarget* target) {
  const std::int64_t scenes_before = view.num_scenes;
  edited.reset();
  execute(commands);
  view.times = {};
  view.frame_totals = {};
  view.min_bytes_moved = 0.0;
  mapping = {};
  if (sought) return fly_to_sought(target);
  const bool is_landed = view.flight == Flight::landed;
  const bool is_new = view.num_scenes != scenes_before;  // its initial state is shown and measured
  const bool steps = !is_new && !commands.hold && ((!view.paused && !is_landed) || commands.single_step);
  if (steps && !frame) begin_steps(commands);
  if (!frame) show_plan();
  if (frame) {
    submit_steps(target);
  } else if (target) {
    draw_again(*target);
  }
  if (is_landed && !view.paused && !commands.hold && !in_flight) launch_again_when_due();
}

Commands Simulation::admit(const Commands& wanted) {
  Commands admitted;
  state_->guard([&] { admitted = state_->admit(wanted); });
  return admitted;
}

void Simulation::begin_frame(const Commands& commands, DrawTarget* draw) {
  state_->guard([&] { state_->begin(commands, draw); });
}

void Simulation::finish_frame() {
  State& s = *state_;
  s.guard([&] {
    if (s.in_flight) return s.collect_steps();
    if (s.frame && s.frame->num_done == s.frame->num_steps) s.end_frame();  // a replayed frame without a step
  });
}

void Simulation::set_fallback(std::function<std::unique_ptr<Backend>()> make) {
  state_->make_fallback = std::move(make);
}

void Simulation::keep_checkpoints() {
  constexpr std::uint64_t kMaxBytes = 1'000'000'000;
  state_->checkpoints.emplace(std::min(kMaxBytes, available_memory_bytes() / 4));
}

void Simulation::keep_to_budget(double share) { state_->budget_share = share; }
int Simulation::num_fallbacks() const { return state_->num_fallbacks; }

void Simulation::check_room(const Settings& settings) const {
  Settings resolved = settings;
  state_->resolve(resolved);
  check_backend(resolved, derive_physics(resolved), *state_->backend);
  state_->check_room(resolved, state_->backend->memory_bytes());
}
Settings Simulation::at_target(const Settings& edited) const { return state_->at_target(edited); }
const FrameView& Simulation::view() const { return state_->view; }
const Settings& Simulation::settings() const { return state_->settings; }
Backend& Simulation::backend() { return *state_->backend; }
bool Simulation::finished_flight() const { return state_->left_once; }

}  // namespace pf
