#include "app/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/memory.hpp"
#include "app/step_request.hpp"
#include "core/error.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

constexpr std::size_t kMaxOldPaths = 5;
constexpr double kPauseAfterLanding_s = 1.0;

// Whether going from one to the other needs the parcels to be spawned anew.
bool needs_respawn(const Settings& a, const Settings& b) {
  const auto spawned_from = [](const Settings& s) {
    return std::tuple(s.num_parcels, s.area_fraction, s.areal_density_kg_m2, s.parcel_radius_m,
                      s.parcel_mass_kg, s.parcel_speed_mps, s.flow_x_mps, s.flow_y_mps, s.width_m, s.height_m,
                      s.boundary, s.air, s.seed, s.box_follows_parcels, s.ball_present, s.ball_radius_m);
  };
  return spawned_from(a) != spawned_from(b);
}

bool has_left(const Physics& physics, const BallState& ball) {
  if (!physics.ball.present || physics.world.boundary != Boundary::open) return false;
  const World& world = physics.world;
  const double radius = physics.ball.radius_m;
  return std::fabs(ball.position_m.x) > world.half.x * world.unit_m + radius ||
         std::fabs(ball.position_m.y) > world.half.y * world.unit_m + radius;
}

}  // namespace

std::int64_t resolve_num_parcels(const Settings& settings, const std::string& backend_name) {
  if (settings.air != Air::parcels) return 0;
  if (settings.num_parcels > 0) return settings.num_parcels;
  return backend_name == "cuda" ? settings.num_parcels_gpu : settings.num_parcels_cpu;
}

struct Simulation::State {
  Settings settings;
  Physics physics;
  std::unique_ptr<Backend> backend;
  BallState ball;
  FrameView view;
  std::vector<Vec2f> path_m;
  std::deque<std::vector<Vec2f>> old_paths_m;
  std::function<std::unique_ptr<Backend>()> make_fallback;
  int num_fallbacks = 0;
  std::int64_t num_launches = 0;
  double landed_for_s = 0.0;
  bool left_once = false;
  double collision_rate_per_s = 0.0;   // per parcel, in the last frame; 0: not known
  std::optional<FramePlan> in_flight;  // of the frame whose steps are submitted
  PhaseTimes mapping;                  // of that frame

  void resolve(Settings& with) const;
  void check_room(const Settings& with, std::uint64_t held_bytes) const;
  void reset(const Settings& with);
  void respawn(const Settings& with, const BallState& around);
  void launch();
  void launch_again();
  void apply(const Settings& edited);
  void change_scene(const std::string& name);
  void restart(Settings with);
  void change_threads(const Settings& with);
  void obey(const Commands& commands);
  void begin(const Commands& commands, DrawTarget* target);
  void submit_steps(DrawTarget* target);
  void draw_again(DrawTarget& target);
  void collect_steps();
  void launch_again_when_due();
  void fall_back(const DeviceError& error);
  void follow_ball();
  void update_view();
};

void Simulation::State::resolve(Settings& with) const {
  // Without parcels their number is kept for when they come back.
  if (with.air == Air::parcels) with.num_parcels = resolve_num_parcels(with, backend->name());
}

// Throws UserError if the CPU backend would not get its memory. held_bytes: what it gives back.
void Simulation::State::check_room(const Settings& with, std::uint64_t held_bytes) const {
  if (backend->name() != "cpu" || with.air != Air::parcels) return;
  constexpr std::uint64_t kRestOfTheProgram = 256ULL << 20;  // GL, text, a film: 190 MiB seen with llvmpipe
  const std::uint64_t needed = cpu_backend_bytes(with.num_parcels, with.threads, with.method) +
                               host_draw_bytes(with.num_parcels) + kRestOfTheProgram;
  const std::uint64_t available = available_memory_bytes();
  check_memory(with.num_parcels, needed, available > ~held_bytes ? available : available + held_bytes);
}

// Starts with these settings: the same settings and seed give the same run. Throws UserError, and leaves
// everything as it was, if they cannot run.
void Simulation::State::reset(const Settings& with) {
  respawn(with, initial_ball(with));
  settings = with;
  num_launches = 0;
  left_once = false;
  old_paths_m.clear();
  path_m.clear();
  view.totals = {};
  view.simulated_s = 0.0;
  collision_rate_per_s = 0.0;
  launch();
}

// Spawns parcels for the settings around a ball. Leaves everything as it was if they do not fit.
void Simulation::State::respawn(const Settings& with, const BallState& around) {
  const Physics derived = derive_physics(with);
  const Spawner spawner(with, derived, around);
  check_room(with, backend->memory_bytes());
  backend->reset(derived, spawner.plan(), around);
  physics = derived;
  ball = around;
}

void Simulation::State::launch() {
  if (path_m.size() > 1) {
    old_paths_m.push_front(std::move(path_m));
    if (old_paths_m.size() > kMaxOldPaths) old_paths_m.pop_back();
  }
  path_m.clear();
  ball = initial_ball(settings);
  backend->set_ball(ball);
  view.flight = Flight::flying;
  view.ball_distance_m = 0.0;
  landed_for_s = 0.0;
  ++num_launches;
  follow_ball();
}

// After a flight: the air anew and the ball at its start.
void Simulation::State::launch_again() {
  Settings with = settings;
  with.seed += num_launches;  // fresh air for each flight, the same in every run
  try {
    respawn(with, initial_ball(with));
  } catch (const UserError& error) {  // edited in flight, the air does not fit around the start
    view.message = error.what();
  }
  launch();
}

// Takes over edited settings.
void Simulation::State::apply(const Settings& edited) {
  check_settings(edited, "panel");
  Settings with = edited;
  resolve(with);
  if (with.threads != settings.threads) change_threads(with);
  if (needs_respawn(settings, with)) {
    respawn(with, ball);
  } else {
    physics = derive_physics(with);
    backend->set_physics(physics);
  }
  if (with.ball_spin_radps != settings.ball_spin_radps) {
    ball.spin_radps = with.ball_spin_radps;
    backend->set_ball(ball);
  }
  settings = with;
}

// Another scene, from its start. What belongs to the run and its film and not to the scene stays.
void Simulation::State::change_scene(const std::string& name) {
  Settings with = load_scene(name);
  with.threads = settings.threads;
  with.seconds = settings.seconds;
  with.frame_rate_hz = settings.frame_rate_hz;
  restart(with);
}

void Simulation::State::restart(Settings with) {
  resolve(with);
  reset(with);
  view.paused = false;
  ++view.num_scenes;
}

// Another team with the same parcels. Only the count of steps, which keys the random rounding of positions,
// begins anew; on a device, too, which has no team, so that one log gives one flight everywhere.
void Simulation::State::change_threads(const Settings& with) {
  const Spawner spawner(settings, physics, ball);
  const ParcelSnapshot parcels = backend->snapshot();
  if (backend->name() == "cpu") {
    check_room(with, 0);
    std::unique_ptr<Backend> fresh = make_cpu_backend(static_cast<unsigned>(with.threads));
    fresh->reset(physics, spawner.plan(), ball);
    backend = std::move(fresh);
  } else {
    backend->reset(physics, spawner.plan(), ball);
  }
  backend->restore(parcels);
}

void Simulation::State::obey(const Commands& commands) {
  try {
    const bool changes = commands.settings || commands.reset || commands.restart || !commands.scene.empty();
    if (commands.settings) apply(*commands.settings);
    if (commands.reset) reset(settings);
    if (!commands.scene.empty()) change_scene(commands.scene);
    if (commands.restart) restart(*commands.restart);
    if (changes) view.message.clear();
  } catch (const UserError& error) {
    view.message = error.what();
  }
  if (commands.launch) launch();
  if (commands.toggle_pause) view.paused = !view.paused;
}

void Simulation::State::submit_steps(DrawTarget* target) {
  const FramePlan plan = plan_frame(settings, physics, ball, collision_rate_per_s);
  StepRequest request = step_request(settings, plan.num_steps, plan.dt_s);
  DrawBuffers buffers;
  if (target) {
    target->reserve(physics.parcels.num);
    ScopedPhase timing(mapping, Phase::map);
    buffers = target->map();
    request.draw = &buffers;
  }
  backend->submit(request);
  in_flight = plan;
  if (target) {
    ScopedPhase timing(mapping, Phase::unmap);
    target->unmap();
  }
}

void Simulation::State::collect_steps() {
  const StepReport report = backend->collect();
  const FramePlan& plan = *in_flight;
  view.dt_s = plan.dt_s;
  view.steps_per_frame = plan.num_steps;
  view.slow_motion = plan.slow_motion;
  ball = report.ball;
  view.times = report.times;
  view.times += mapping;
  view.frame_totals = report.totals;
  view.totals += report.totals;
  view.simulated_s += plan.num_steps * plan.dt_s;
  collision_rate_per_s = physics.parcels.num == 0 ? 0.0
                                                  : 2.0 * static_cast<double>(report.totals.num_collisions) /
                                                        (physics.parcels.num * plan.num_steps * plan.dt_s);
  in_flight.reset();
  if (report.totals.num_invalid > 0) {
    view.paused = true;
    view.message = fmt::format(
        "Paused: {} parcels left the range of numbers in step {}, the first with id {}. Shorten the step "
        "(run.dt_s, run.displacement_per_step) or slow the ball, then reset.",
        report.totals.num_invalid, report.totals.first_invalid_step, report.totals.first_invalid_id);
  }
  follow_ball();
  if (view.flight == Flight::flying && has_left(physics, ball)) {
    view.flight = Flight::landed;
    left_once = true;
  }
}

// The present state once more, without a step.
void Simulation::State::draw_again(DrawTarget& target) {
  target.reserve(physics.parcels.num);
  backend->draw(target.map());
  target.unmap();
}

void Simulation::State::launch_again_when_due() {
  landed_for_s += 1.0 / settings.frame_rate_hz;
  if (settings.relaunch && landed_for_s >= kPauseAfterLanding_s) launch_again();
}

// Goes on with another backend from the start of the scene, the state having gone with the device.
void Simulation::State::fall_back(const DeviceError& error) {
  if (!make_fallback) throw error;
  const std::string failed = backend->name();
  backend = make_fallback();
  make_fallback = nullptr;
  ++num_fallbacks;
  in_flight.reset();
  Settings with = settings;
  with.num_parcels = std::min(settings.num_parcels, settings.num_parcels_cpu);
  reset(with);
  view.message = fmt::format("{} failed ({}); going on with {} and {} parcels from the start of the scene.",
                             failed, error.what(), backend->name(), physics.parcels.num);
}

void Simulation::State::follow_ball() {
  if (!physics.ball.present) return;
  const Vec2f here = to_float(ball.position_m);
  if (!path_m.empty()) {
    const Vec2d moved = ball.position_m - to_double(path_m.back());
    const double length = std::sqrt(dot(moved, moved));
    const World& world = physics.world;
    const bool wrapped = world.boundary == Boundary::periodic && length > 0.5 * world.half.y * world.unit_m;
    if (wrapped) path_m.clear();
    if (!wrapped) view.ball_distance_m += length;
  }
  path_m.push_back(here);
}

void Simulation::State::update_view() {
  view.settings = &settings;
  view.physics = &physics;
  view.ball = ball;
  view.path_m = &path_m;
  view.old_paths_m = &old_paths_m;
  view.num_parcels = physics.parcels.num;
  view.backend = backend->name();
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
  obey(commands);
  view.times = {};
  view.frame_totals = {};
  mapping = {};
  const bool waiting = view.flight == Flight::landed;
  const bool is_new = view.num_scenes != scenes_before;  // shown as it starts, to be measured
  if (!is_new && ((!view.paused && !waiting) || commands.single_step)) {
    submit_steps(target);
  } else if (target) {
    draw_again(*target);
  }
  if (waiting && !view.paused && !in_flight) launch_again_when_due();
}

void Simulation::begin_frame(const Commands& commands, DrawTarget* draw) {
  try {
    state_->begin(commands, draw);
  } catch (const DeviceError& error) {
    state_->fall_back(error);
  }
  state_->update_view();
}

void Simulation::finish_frame() {
  State& s = *state_;
  if (!s.in_flight) return;
  try {
    s.collect_steps();
  } catch (const DeviceError& error) {
    s.fall_back(error);
  }
  s.update_view();
}

void Simulation::set_fallback(std::function<std::unique_ptr<Backend>()> make) {
  state_->make_fallback = std::move(make);
}

int Simulation::num_fallbacks() const { return state_->num_fallbacks; }
const FrameView& Simulation::view() const { return state_->view; }
const Settings& Simulation::settings() const { return state_->settings; }
Backend& Simulation::backend() { return *state_->backend; }
bool Simulation::finished_flight() const { return state_->left_once; }

}  // namespace pf
