// The simulation loop: turns settings and commands into steps of a backend, frame by frame, and provides the
// figures for panel, overlay and report.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/flight.hpp"
#include "app/flight_history.hpp"
#include "app/free_flow_watch.hpp"
#include "backend/backend.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"
#include "scene/settings.hpp"

namespace pf {

struct RunState;

// A launch by hand. It replaces the launch in the settings.
struct BallLaunch {
  Vec2d velocity_mps;
  double spin_radps = 0.0;
};

// A repeated launch with one change.
enum class Comparison { none, next_method, half_step, scene_step };

// Requests from panel, keys and mouse. These never change the simulation directly.
struct Commands {
  std::optional<Settings> settings;  // the edited copy, if anything in it changed
  std::string scene;                 // load it (name or file) and start anew; empty: none
  std::optional<Settings> restart;   // start anew with these settings, which need not be those of a file
  bool toggle_pause = false;
  bool single_step = false;       // one frame, while paused
  bool reset = false;             // back to the start of the scene, same seed
  bool launch = false;            // put the ball back to its start; parcels are kept
  std::optional<BallLaunch> fly;  // launch the ball like this, into fresh air of the scene's seed
  Comparison compare = Comparison::none;
  std::optional<Method> next_method;       // of Comparison::next_method, for a replay; none: what comes next
  bool hold = false;                       // no step in this frame
  bool back = false;                       // go back by a second of display, with the present settings
  std::optional<double> seek_s;            // go to this time of the flight, as it was flown; since its launch
  double time_scale_factor = 1.0;          // of the pace: see run.time_scale, run.substeps
  std::string save_scene;                  // write the settings as a scene file of this name; empty: no
  std::optional<std::uint32_t> max_steps;  // of this frame, for a replay; none: as planned
  bool quit = false;
  // The settings in which a second flight beside this one differs (app/split_setting.hpp); empty: there is
  // none from now on. A simulation ignores it.
  std::optional<std::vector<std::string>> split;
  std::optional<std::uint32_t> second_max_steps;  // as max_steps, of the second flight
  bool drop_future = false;                       // of a flight that went back: forget what comes later
};

enum class Flight { flying, landed };  // landed: the ball has left the world and awaits its next launch

// Data for drawing one frame. Owned by the simulation and valid until the next call of begin_frame.
struct FrameView {
  const Settings* settings = nullptr;
  const Physics* physics = nullptr;
  std::string backend;          // "cpu" or "cuda"
  MethodSet refused{};          // methods that it cannot fly
  std::int64_t num_scenes = 1;  // loaded so far
  BallState ball;
  const FlightRecord* flight_record = nullptr;            // the current one
  const std::deque<FlightRecord>* old_flights = nullptr;  // newest first
  const std::vector<Ghost>* ghosts = nullptr;             // of the current launch
  bool half_step = false;                                 // a comparison halved the scene's step
  std::int64_t num_flights = 0;                           // launches and jumps in time so far
  std::int64_t num_recalls = 0;                           // of settings that the flight had
  std::uint32_t num_parcels = 0;
  std::uint64_t memory_bytes = 0;  // of the backend
  double min_bytes_moved = 0.0;    // by the last frame's steps (Backend::min_bytes_moved)
  double simulated_s = 0.0;
  // Values of the current or the last frame; those planned for the next one if a picture has no step.
  double dt_s = 0.0;
  std::uint32_t steps_per_frame = 0;
  double slow_motion = 0.0;  // simulated over wall time
  // The steps of a frame may be worked off in several pictures (Simulation::keep_to_budget).
  std::uint32_t num_pictures = 1;          // of a frame
  bool unfinished = false;                 // the next picture goes on with the steps of this frame
  bool mid_step = false;                   // the last step, too, is unfinished
  std::uint32_t num_done = 0;              // steps of the frame
  const Settings* edited = nullptr;        // after an edit of this picture that took effect; null: none did
  const Settings* asked = nullptr;         // settings that wait for the end of a step; null: none
  bool waits_for_step = false;             // there are such settings, or other commands
  const FlightHistory* history = nullptr;  // of the current flight, to the latest time reached
  std::vector<double> kept_s;              // times of the checkpoints that are kept
  std::optional<double> sought_s;          // the flight is being flown again, to this time
  bool paused = false;
  Flight flight = Flight::flying;
  bool waits = false;                        // a landed ball is not launched again automatically
  double ball_distance_m = 0.0;              // flown since the launch
  PhaseTimes times;                          // of the last frame, physics phases
  StepTotals totals;                         // of the run so far
  StepTotals frame_totals;                   // of the last frame
  std::optional<FreeFlowFigures> free_flow;  // of a held ball; none: theory does not hold
  const Profile* profile = nullptr;          // after the last whole frame; null: off, or no parcels
  std::string message;                       // one line about a failure, or empty
  std::string notice;                        // one line about a success, or empty
};

class Simulation {
 public:
  // Resolves settings.num_parcels for the backend. Throws UserError for settings that cannot run; on the CPU
  // also if memory does not suffice.
  Simulation(Settings settings, std::unique_ptr<Backend> backend);
  // Goes on from a saved state, on any backend, to the same bits. Throws UserError as above.
  Simulation(const RunState& from, std::unique_ptr<Backend> backend);
  ~Simulation();

  // Stores the state into `to`, whose memory is used again. Only after a whole frame (FrameView::unfinished).
  void save(RunState& to) const;

  // Interrupts the steps of a frame once run.frame_budget_ms has passed, after or within the current step.
  // The next call of begin_frame goes on with them. Initially off: for a window, which must answer its user.
  // The states after whole frames are the same. share: of that time.
  void keep_to_budget(double share = 1.0);
  // Commands that begin_frame can apply now. They end an unfinished frame after its last whole step. Those
  // that cannot be applied within a step wait for its end. To be called before begin_frame.
  Commands admit(const Commands& wanted);

  // Applies commands, then starts the steps of one frame unless paused. If draw is given, the last step
  // writes to it: reserve, map, write, unmap. A device works on the steps while the caller queues the
  // drawing. A command that cannot be executed changes nothing and puts its reason into view().message.
  void begin_frame(const Commands& commands, DrawTarget* draw);
  // Waits for the frame's steps, then updates ball, path, times and totals of the view.
  void finish_frame();
  void advance_frame(const Commands& commands, DrawTarget* draw) {
    begin_frame(admit(commands), draw);
    finish_frame();
  }

  // Keeps checkpoints of the flight from now on, for Commands::back and seek_s. Initially off: they cost
  // memory and time.
  void keep_checkpoints();

  // make: creates another backend if the device fails. Without it the caller gets the DeviceError. The scene
  // starts anew, with at most its number of parcels for a CPU, and the view's message gives the reason.
  void set_fallback(std::function<std::unique_ptr<Backend>()> make);
  // Number of fallbacks so far. A draw target of the failed backend must no longer be used.
  int num_fallbacks() const;

  // Throws UserError if a restart with these settings would not have the memory.
  void check_room(const Settings& settings) const;

  // An edit on the way to another moment began with the settings of the one that is passed. Returns those of
  // the moment sought with what it changed.
  Settings at_target(const Settings& edited) const;

  const FrameView& view() const;
  const Settings& settings() const;
  Backend& backend();
  bool finished_flight() const;  // the ball has left at least once

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pf
