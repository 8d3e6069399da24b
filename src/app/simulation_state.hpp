// State of a simulation. Only the sources of class Simulation include this file.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/checkpoints.hpp"
#include "app/energy_watch.hpp"
#include "app/simulation.hpp"
#include "core/error.hpp"

namespace pf {

// The steps of a frame, worked off in one picture or several.
struct FrameSteps {
  FramePlan plan;
  std::uint32_t num_steps = 0;  // at most those of the plan
  std::uint32_t num_done = 0;
  double start_s = 0.0;  // simulated
  bool mid_step = false;
  std::uint32_t num_pictures = 0;
  StepTotals totals;
};

// Parcels to be spawned around a ball.
struct NewAir {
  Physics physics;
  BallState ball;
  Spawner spawner;
};

struct Simulation::State {
  Settings settings;
  Physics physics;
  std::unique_ptr<Backend> backend;
  BallState ball;
  FrameView view;
  FlightRecord flight;
  std::deque<FlightRecord> old_flights;
  std::vector<Ghost> ghosts;
  std::optional<Checkpoints> checkpoints;  // none: off
  FlightHistory history;
  std::optional<std::int64_t> sought;          // frame that the flight is flown again to
  std::optional<Settings> settings_at_sought;  // to be applied there
  std::optional<FlightRecord> latest_flight;   // at the latest time reached, once the flight went back
  std::int64_t last_number = 0;                // of the flights kept so far
  std::optional<double> scene_dt_s;            // run.dt_s before a comparison halved it
  bool by_hand = false;                        // the launch was made by hand
  double launched_at_s = 0.0;                  // simulated
  double shown_s = 0.0;                        // frames with a step since the launch, at the frame rate
  std::int64_t flight_seed = 0;                // of the air at the start of the flight
  std::function<std::unique_ptr<Backend>()> make_fallback;
  int num_fallbacks = 0;
  std::int64_t num_launches = 0;
  double landed_for_s = 0.0;
  bool left_once = false;
  double collision_rate_per_s = 0.0;  // per parcel, in the last whole frame; 0: not known
  std::optional<FrameSteps> frame;    // begun and not ended
  bool in_flight = false;             // steps of it are submitted
  PhaseTimes mapping;                 // of the picture
  EnergyWatch energy_watch;
  FreeFlowWatch free_flow;
  Profile profile;
  bool profile_is_due = false;           // the state has changed since
  double budget_share = 0.0;             // of run.frame_budget_ms; 0: off
  double step_ms = 0.0;                  // of the last steps; 0: not known
  std::uint32_t num_frame_pictures = 1;  // of the last whole frame
  Commands waiting;                      // for the end of a step
  std::optional<Settings> edited;        // by an edit of the picture that took effect

  void resolve(Settings& with) const;
  void check_room(const Settings& with, std::uint64_t held_bytes) const;
  void save(FlightState& to) const;
  void resume(const FlightState& from);
  void save_run(RunState& to) const;
  void resume_run(const RunState& from);
  void reset(const Settings& with);
  Settings as_launched(Settings with) const;
  Physics physics_in_flight(const Settings& with) const;
  NewAir new_air(const Settings& with, const BallState& around) const;
  void respawn(const NewAir& air);
  void launch(bool fresh_air);
  void end_flight();
  std::vector<Ghost> ghosts_of_flight(Settings with) const;
  void keep_old_flight();
  void drop_old_flights();
  void begin_flight(bool fresh_air);
  void launch_again();
  void fly(const BallLaunch& wanted);
  void compare(Comparison comparison, std::optional<Method> logged);
  void compare_methods(std::optional<Method> logged);
  void compare_steps(bool half);
  double half_step_of(const Settings& with) const;  // of the ball's present motion
  bool repeat_flight(const Settings& with);
  bool launches_by_itself() const;
  void scale_time(double factor);
  void save_scene(const std::string& name);
  void keep_checkpoint_when_due();
  void begin_history();
  void go_back();
  void seek(double time_s);
  void start_seek(std::int64_t target);
  void restore(const Checkpoint& then);
  void fly_to_sought(DrawTarget* target);
  void end_seek();
  void repeat_changes();
  void change_settings(const Settings& wanted);
  void edit_settings(const Settings& wanted);
  void note_change(const Settings& before);
  void drop_future();
  Commands admit_while_seeking();
  Settings at_target(const Settings& edited_here) const;
  void apply_commands(const Commands& commands);
  void apply_settings(const Settings& wanted);
  void change_scene(const std::string& name);
  void restart(Settings with);
  void change_threads(const Settings& with);
  void execute(const Commands& commands);
  void begin(const Commands& commands, DrawTarget* target);
  Commands admit(const Commands& wanted);
  bool can_start_anew() const;
  void begin_steps(const Commands& commands);
  void show_plan();
  std::uint32_t num_steps_to_submit() const;
  void submit_steps(DrawTarget* target);
  void draw_again(DrawTarget& target);
  void collect_steps();
  void take_over(const StepReport& report);
  void stop_at(const UnresolvableError& error);
  void end_frame();
  void pause_if_invalid(const StepTotals& totals);
  void pause_if_blown_up();
  void launch_again_when_due();
  void fall_back(const DeviceError& error);
  void pause_at(const UserError& error);
  void guard(const std::function<void()>& work);
  void follow_ball();
  void follow_profile();
  void update_view();
};

}  // namespace pf
