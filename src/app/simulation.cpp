#include "app/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/memory.hpp"
#include "app/moments.hpp"
#include "app/step_request.hpp"
#include "core/error.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

constexpr std::size_t kMaxOldFlights = 5;
constexpr double kSlowest = 0.001;  // that keys reach; the panel and a scene may go on
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

// Whether a change made in flight makes it another one than was launched.
bool disturbs(const Settings& a, Settings b) {
  b.ball_vx_mps = a.ball_vx_mps;
  b.ball_vy_mps = a.ball_vy_mps;
  b.time_scale = a.time_scale;
  b.threads = a.threads;
  b.seconds = a.seconds;
  b.relaunch = a.relaunch;
  b.drawn_area_fraction = a.drawn_area_fraction;
  return !(a == b);
}

// NAME or NAME.toml, as typed.
std::filesystem::path scene_file_of(const std::string& name) {
  return name.ends_with(".toml") ? name : name + ".toml";
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
  FlightRecord flight;
  std::deque<FlightRecord> old_flights;
  std::vector<Ghost> ghosts;
  std::optional<Moments> moments;  // none: not kept
  bool by_hand = false;            // the launch
  double launched_at_s = 0.0;      // simulated
  double shown_s = 0.0;            // frames that moved since the launch, at the frame rate
  std::int64_t flight_seed = 0;    // of the air that the flight began in
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
  void launch(bool fresh_air);
  void end_flight();
  void keep_old_flight();
  void begin_flight(bool fresh_air);
  void launch_again();
  void fly(const BallLaunch& wanted);
  void compare(Comparison comparison);
  bool repeat_flight(const Settings& with);
  bool launches_by_itself() const;
  void scale_time(double factor);
  void save_scene(const std::string& name);
  void keep_moment_when_due();
  void go_back();
  void change(const Commands& commands);
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
  old_flights.clear();
  flight = {};
  view.totals = {};
  view.simulated_s = 0.0;
  collision_rate_per_s = 0.0;
  flight_seed = settings.seed;
  launch(true);
}

// Spawns parcels for the settings around a ball. Leaves everything as it was if they do not fit.
void Simulation::State::respawn(const Settings& with, const BallState& around) {
  const Physics derived = derive_physics(with);
  const Spawner spawner(with, derived, around);
  check_room(with, backend->memory_bytes());
  backend->reset(derived, spawner.plan(), around);
  physics = derived;
  ball = around;
  if (moments) moments->clear();
}

void Simulation::State::launch(bool fresh_air) {
  keep_old_flight();
  ball = initial_ball(settings);
  backend->set_ball(ball);
  ++num_launches;
  begin_flight(fresh_air);
  flight.launch = num_launches;
  by_hand = false;
}

// What its parcels and ball have in the end. To be called before the air is spawned anew.
void Simulation::State::end_flight() {
  if (physics.ball.present && flight.points_m.size() > 1 && !flight.end_energy_j)
    flight.end_energy_j = backend->measure().energy_j();
}

void Simulation::State::keep_old_flight() {
  end_flight();
  if (flight.points_m.size() > 1) old_flights.push_front(std::move(flight));
  if (old_flights.size() > kMaxOldFlights) old_flights.pop_back();
  flight = {};
}

// The ball is at its start, the air as it is to be.
void Simulation::State::begin_flight(bool fresh_air) {
  flight = {};
  flight.fresh_air = fresh_air;
  flight.air = settings.air;
  flight.method = settings.method;
  flight.set_dt_s = settings.dt_s;
  flight.speed_mps = std::hypot(settings.ball_vx_mps, settings.ball_vy_mps);
  flight.spin_radps = settings.ball_spin_radps;
  if (physics.ball.present) flight.start_energy_j = backend->measure().energy_j();
  view.flight = Flight::flying;
  view.ball_distance_m = 0.0;
  landed_for_s = 0.0;
  shown_s = 0.0;
  if (moments) moments->clear();
  ghosts = ghosts_of(settings);
  ++view.num_flights;
  follow_ball();
}

// After a flight: the air anew and the ball at its start.
void Simulation::State::launch_again() {
  Settings with = settings;
  with.seed += num_launches;  // fresh air for each flight, the same in every run
  end_flight();
  bool fresh_air = true;
  try {
    respawn(with, initial_ball(with));
    flight_seed = with.seed;
  } catch (const UserError& error) {  // edited in flight, the air does not fit around the start
    view.message = error.what();
    fresh_air = false;
  }
  launch(fresh_air);
}

// Throws UserError, and changes nothing, if it cannot be set.
void Simulation::State::fly(const BallLaunch& wanted) {
  Settings with = settings;
  with.ball_vx_mps = wanted.velocity_mps.x;
  with.ball_vy_mps = wanted.velocity_mps.y;
  with.ball_spin_radps = wanted.spin_radps;
  check_settings(with, "launch");
  end_flight();
  respawn(with, initial_ball(with));
  settings = with;
  flight_seed = settings.seed;
  launch(true);
  by_hand = true;
}

// The present launch again, in the same air. Returns false, with the reason as message, if it cannot run so.
bool Simulation::State::repeat_flight(const Settings& with) {
  Settings spawned = with;
  spawned.seed = flight_seed;
  const std::int64_t same_launch = flight.launch;
  end_flight();
  try {
    respawn(spawned, initial_ball(spawned));
  } catch (const UserError& error) {
    view.message = error.what();
    return false;
  }
  settings = with;
  keep_old_flight();
  begin_flight(true);
  flight.launch = same_launch;
  std::erase_if(old_flights, [this](const FlightRecord& old) {  // of two alike the newer stays
    return old.launch == flight.launch && old.method == flight.method && old.set_dt_s == flight.set_dt_s;
  });
  view.message.clear();
  return true;
}

void Simulation::State::compare(Comparison comparison) {
  if (!physics.ball.present) throw UserError("compare: this scene has no ball to launch again");
  Settings with = settings;
  if (comparison == Comparison::half_step) {
    const double dt_s = settings.dt_s > 0.0 ? settings.dt_s : plan_frame(settings, physics, ball).dt_s;
    with.dt_s = 0.5 * dt_s;
    repeat_flight(with);
    return;
  }
  constexpr int kNumMethods = 3;
  for (int next = 1; next < kNumMethods; ++next) {
    with.method = static_cast<Method>((static_cast<int>(settings.method) + next) % kNumMethods);
    if (repeat_flight(with)) return;
  }
}

// A flight that was launched by hand, or is compared with another, stays to be looked at.
bool Simulation::State::launches_by_itself() const {
  const bool is_compared =
      std::any_of(old_flights.begin(), old_flights.end(),
                  [this](const FlightRecord& old) { return old.launch == flight.launch; });
  return settings.relaunch && !by_hand && !is_compared;
}

void Simulation::State::scale_time(double factor) {
  const double most = find_field("run.time_scale", "keys").max;
  const double least = std::min(kSlowest, settings.time_scale);
  settings.time_scale = std::clamp(settings.time_scale * factor, least, most);
}

void Simulation::State::save_scene(const std::string& name) {
  const std::filesystem::path file = scene_file_of(name);
  save_new_scene_file(file, settings);
  view.notice = fmt::format("Saved: {}", file.string());
}

void Simulation::State::keep_moment_when_due() {
  if (!moments || !moments->is_due(shown_s, physics.parcels.num)) return;
  moments->keep({shown_s, backend->snapshot(), ball, view.totals, view.simulated_s, view.ball_distance_m,
                 collision_rate_per_s, view.flight == Flight::landed, flight});
}

// Parcels, ball, totals and path as they were then; settings stay as the person has them now.
void Simulation::State::go_back() {
  const Moment* moment = moments ? moments->back_from(shown_s) : nullptr;
  if (moment == nullptr) {
    throw UserError(
        fmt::format("back: no moment is kept{}", moments && moments->most(physics.parcels.num) == 0
                                                     ? " of so many parcels; give fewer"
                                                     : " yet; let it run"));
  }
  backend->restore(moment->parcels);
  ball = moment->ball;
  backend->set_ball(ball);
  view.totals = moment->totals;
  view.simulated_s = moment->simulated_s;
  view.ball_distance_m = moment->ball_distance_m;
  view.flight = moment->landed ? Flight::landed : Flight::flying;
  collision_rate_per_s = moment->collision_rate_per_s;
  landed_for_s = 0.0;
  shown_s = moment->shown_s;
  flight = moment->flight;
  ++view.num_flights;
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
  flight.disturbed = flight.disturbed || (flight.points_m.size() > 1 && disturbs(settings, with));
  settings = with;
  ghosts = ghosts_of(settings);
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

// Throws UserError for what cannot be done.
void Simulation::State::change(const Commands& commands) {
  if (commands.settings) apply(*commands.settings);
  if (commands.time_scale_factor != 1.0) scale_time(commands.time_scale_factor);
  if (commands.reset) reset(settings);
  if (!commands.scene.empty()) change_scene(commands.scene);
  if (commands.restart) restart(*commands.restart);
  if (commands.fly) fly(*commands.fly);
  if (commands.compare != Comparison::none) compare(commands.compare);
  if (commands.back) go_back();
  if (!commands.save_scene.empty()) save_scene(commands.save_scene);
}

void Simulation::State::obey(const Commands& commands) {
  const bool changes = commands.settings || commands.reset || commands.restart || commands.fly ||
                       commands.back || commands.compare != Comparison::none || !commands.scene.empty() ||
                       !commands.save_scene.empty();
  if (changes) {
    view.message.clear();
    view.notice.clear();
  }
  try {
    change(commands);
  } catch (const UserError& error) {
    view.message = error.what();
  }
  if (commands.launch) launch(false);
  if (commands.toggle_pause) view.paused = !view.paused;
}

void Simulation::State::submit_steps(DrawTarget* target) {
  keep_moment_when_due();
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
  view.least_bytes_moved = backend->least_bytes_moved(report.totals);
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
  shown_s += 1.0 / settings.frame_rate_hz;
  flight.dt_s = plan.dt_s;
  flight.num_steps += plan.num_steps;
  flight.compute_ms += report.times.total();
  follow_ball();
  if (view.flight == Flight::flying && has_left(physics, ball)) {
    view.flight = Flight::landed;
    left_once = true;
    end_flight();
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
  if (launches_by_itself() && landed_for_s >= kPauseAfterLanding_s) launch_again();
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
  const bool is_first = flight.points_m.empty();
  if (!is_first) {
    const Vec2d moved = ball.position_m - to_double(flight.points_m.back());
    const double length = std::sqrt(dot(moved, moved));
    const World& world = physics.world;
    const bool wrapped = world.boundary == Boundary::periodic && length > 0.5 * world.half.y * world.unit_m;
    if (!wrapped) view.ball_distance_m += length;
    if (wrapped) {
      flight.points_m.clear();
      flight.times_s.clear();
    }
  }
  if (is_first) launched_at_s = view.simulated_s;
  flight.points_m.push_back(to_float(ball.position_m));
  flight.times_s.push_back(view.simulated_s - launched_at_s);
}

void Simulation::State::update_view() {
  view.settings = &settings;
  view.physics = &physics;
  view.ball = ball;
  view.flight_record = &flight;
  view.old_flights = &old_flights;
  view.ghosts = &ghosts;
  view.num_parcels = physics.parcels.num;
  view.backend = backend->name();
  view.memory_bytes = backend->memory_bytes();
  view.waits = !launches_by_itself();
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
  view.least_bytes_moved = 0.0;
  mapping = {};
  const bool waiting = view.flight == Flight::landed;
  const bool is_new = view.num_scenes != scenes_before;  // shown as it starts, to be measured
  if (!is_new && !commands.hold && ((!view.paused && !waiting) || commands.single_step)) {
    submit_steps(target);
  } else if (target) {
    draw_again(*target);
  }
  if (waiting && !view.paused && !commands.hold && !in_flight) launch_again_when_due();
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

void Simulation::keep_moments() {
  constexpr std::uint64_t kMost_bytes = 1'000'000'000;
  state_->moments.emplace(std::min(kMost_bytes, available_memory_bytes() / 4));
}

int Simulation::num_fallbacks() const { return state_->num_fallbacks; }
const FrameView& Simulation::view() const { return state_->view; }
const Settings& Simulation::settings() const { return state_->settings; }
Backend& Simulation::backend() { return *state_->backend; }
bool Simulation::finished_flight() const { return state_->left_once; }

}  // namespace pf
