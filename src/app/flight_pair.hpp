// One flight, or two with one clock: the run's own, and a second one that differs in some settings. Both get
// the same commands, and a half whose flight is ahead waits for the other.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "app/pair_figures.hpp"
#include "app/report.hpp"
#include "app/simulation.hpp"
#include "app/split_setting.hpp"

namespace pf {

// A picture of the stage calls admit(), begin() and finish(), in this order, alone or with a second flight.
//
// The halves fly whole frames. A frame may take several pictures (Simulation::keep_to_budget); a half that
// has done its frame then waits for the other. Commands wait until both have done theirs, or have ended them
// after a whole step. Neither half's states depend on the other: they are those of a flight alone with the
// same settings and commands.
class FlightPair {
 public:
  // first: the run's own flight, which must outlive the pair. make: a backend beside it on the same device;
  // null: there is no second flight.
  FlightPair(Simulation& first, MakeBackend make) : first_(first), make_(std::move(make)) {}

  // As Simulation::keep_to_budget, keep_checkpoints, for both flights; two flights share the budget.
  void keep_to_budget();
  void keep_checkpoints();
  // The commands of a log hold all that this class adds to those of a person.
  void follow_log() { follows_log_ = true; }

  // The commands that the first flight takes in this picture. Commands::split begins, changes or ends the
  // second flight: both start anew then, after a frame without steps unless the first one is at its start.
  Commands admit(const Commands& wanted);
  // The first flight begins a frame or goes on with one; else it waits for the second.
  bool first_goes() const { return first_goes_; }
  // Starts the steps of both. admitted: by admit(). Either target may be null.
  void begin(const Commands& admitted, DrawTarget* first, DrawTarget* second);
  void finish();

  Simulation* second() { return second_.get(); }  // null: there is none
  const Simulation* second() const { return second_.get(); }
  const Difference& difference() const { return difference_; }
  const PairFigures& figures() const { return figures_; }
  // Number of second flights so far.
  std::int64_t num_begun() const { return num_begun_; }
  // Neither flight is within a frame.
  bool is_whole() const;
  // Steps of the second flight's last frame, if commands ended it before its end. Known from admit() to
  // begin().
  std::optional<std::uint32_t> second_cut() const { return second_cut_; }
  // Both balls have left at least once.
  bool finished_flights() const;
  // The first flight's view, with the settings that wait, and the reason if something was refused.
  FrameView view() const;

  // Keys: set (the difference), second (the keys of a run's report), compared: see PairFigures. null without
  // a second flight.
  nlohmann::json report();

 private:
  Commands admit_two(const Commands& wanted);
  void change(const Difference& wanted, Commands& commands);
  void measure_second();
  void begin_records();
  void cut(Simulation& flight);
  bool waits(const Simulation& flight, const Simulation& other) const;
  void refuse_bad_edits(Commands& commands);
  bool in_past() const;
  Commands for_second(const Commands& commands) const;
  void begin_second(const Commands& commands, DrawTarget* target);
  void drop(const std::string& reason);

  Simulation& first_;
  MakeBackend make_;
  std::unique_ptr<Simulation> second_;
  Difference difference_;
  std::optional<RunRecord> record_;  // of the second flight
  PairFigures figures_;
  Commands waiting_;  // for the end of both frames
  std::optional<std::uint32_t> second_cut_;
  std::string message_;
  std::int64_t num_begun_ = 0;
  std::int64_t num_frames_ = 0;  // of both
  std::int64_t scenes_before_ = 1;
  int fallbacks_before_ = 0;
  bool has_budget_ = false;
  bool has_checkpoints_ = false;
  bool follows_log_ = false;
  bool is_new_frame_ = true;
  bool first_goes_ = true;
  bool first_waits_ = false;
  bool first_was_past_ = false;
  bool second_waits_ = false;
};

}  // namespace pf
