// The simulation loop: turns settings and commands into steps of a backend, frame by frame, and keeps what
// the panel, the overlay and the report show.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/flight.hpp"
#include "backend/backend.hpp"
#include "scene/derive.hpp"
#include "scene/settings.hpp"

namespace pf {

// A launch by hand: it becomes the settings' own.
struct BallLaunch {
  Vec2d velocity_mps;
  double spin_radps = 0.0;
};

// The same launch once more, with one thing changed.
enum class Comparison { none, next_method, half_step };

// What the panel (or a key, or the mouse) asks for. It never touches the simulation itself.
struct Commands {
  std::optional<Settings> settings;  // the edited copy, when anything in it changed
  std::string scene;                 // load it (name or file) and start anew; empty: none
  std::optional<Settings> restart;   // start anew with these: a scene that is not a file, as a log has it
  bool toggle_pause = false;
  bool single_step = false;       // one frame, while paused
  bool reset = false;             // back to the start of the scene, same seed
  bool launch = false;            // the ball back to its start, parcels as they are
  std::optional<BallLaunch> fly;  // set this and start, into fresh air of the scene's seed
  Comparison compare = Comparison::none;
  bool hold = false;               // no step in this frame
  bool back = false;               // to an earlier moment of the flight
  double time_scale_factor = 1.0;  // multiplies run.time_scale
  std::string save_scene;          // write the settings as a scene file of this name; empty: no
  bool quit = false;
};

enum class Flight { flying, landed };  // landed: the ball is out of the world, waiting to be launched again

// What the view needs to draw one frame. Owned by the simulation, valid until the next call of advance_frame.
struct FrameView {
  const Settings* settings = nullptr;
  const Physics* physics = nullptr;
  std::string backend;          // "cpu" or "cuda"
  std::int64_t num_scenes = 1;  // shown so far; goes up when another one is loaded
  BallState ball;
  const FlightRecord* flight_record = nullptr;            // the present one
  const std::deque<FlightRecord>* old_flights = nullptr;  // newest first
  const std::vector<Ghost>* ghosts = nullptr;             // of the present launch
  std::int64_t num_flights = 0;  // shown so far; goes up with each that begins, or is returned to
  std::uint32_t num_parcels = 0;
  std::uint64_t memory_bytes = 0;  // of the backend
  double min_bytes_moved = 0.0;  // by the last frame's steps (Backend::least_bytes_moved)
  double simulated_s = 0.0;
  double dt_s = 0.0;
  std::uint32_t steps_per_frame = 0;
  double slow_motion = 0.0;  // simulated over wall time
  bool paused = false;
  Flight flight = Flight::flying;
  bool waits = false;            // once landed: it is not launched again by itself
  double ball_distance_m = 0.0;  // flown since the launch
  PhaseTimes times;              // of the last frame, physics phases
  StepTotals totals;             // of the run so far
  StepTotals frame_totals;       // of the last frame
  std::string message;           // one line that says what could not be done, or empty
  std::string notice;            // one line that says what was done, or empty
};

class Simulation {
 public:
  // settings.num_parcels is resolved for the backend. Throws UserError for settings that cannot run, on the
  // CPU also for want of memory.
  Simulation(Settings settings, std::unique_ptr<Backend> backend);
  ~Simulation();

  // Applies commands, then starts the steps of one frame (unless paused) with the last one writing `draw`, if
  // given: reserve, map, write, unmap. A device works on them while the caller queues what draws the parcels.
  // A command that cannot be obeyed changes nothing and leaves its reason in view().message.
  void begin_frame(const Commands& commands, DrawTarget* draw);
  // Waits for the frame's steps; ball, path, times and totals of the view are the frame's from here on.
  void finish_frame();
  void advance_frame(const Commands& commands, DrawTarget* draw) {
    begin_frame(commands, draw);
    finish_frame();
  }

  // Keeps moments of the flight from now on, for Commands::back. Off at first: they cost memory and time.
  void keep_moments();

  // Called if the backend's device fails: makes the one to go on with. Without it the DeviceError goes to the
  // caller. The scene starts again, with at most the number of parcels that is the scene's own for a CPU; the
  // view's message says why.
  void set_fallback(std::function<std::unique_ptr<Backend>()> make);
  // How often that has happened. A draw target made for the failed backend must not be used any more.
  int num_fallbacks() const;

  const FrameView& view() const;
  const Settings& settings() const;
  Backend& backend();
  bool finished_flight() const;  // the ball has left at least once

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// num_parcels as set, or the backend's default; 0 when air is not parcels.
std::int64_t resolve_num_parcels(const Settings& settings, const std::string& backend_name);

}  // namespace pf
