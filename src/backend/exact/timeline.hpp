// Method `exact` on the CPU through time: epochs, chords and windows, the parcels' positions, anchoring.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "backend/backend.hpp"
#include "backend/exact/epoch_length.hpp"
#include "backend/exact/stepper.hpp"
#include "backend/exact/window_length.hpp"
#include "backend/parcel_arrays.hpp"

namespace pf {

class ExactTimeline {
 public:
  explicit ExactTimeline(ThreadTeam& team) : team_(team), stepper_(team) {}

  // While active, the parcels' stored positions are anchors of trajectories.
  bool active() const { return active_; }
  // The current positions, in the order of the parcels.
  const std::vector<Vec2i>& positions(const SortedParcels& parcels);

  void reset_time();
  // The ball was set from outside; its trajectory starts anew.
  void forget_ball() {
    progress_.ball_trajectory_holds = false;
    ball_is_new_ = true;
    forget_predictions();
  }
  // Constants have changed. Called between requests.
  void forget_predictions() {
    epoch_length_.drop();
    epoch_.reset();
    chord_.reset();
    invalid_ = {};
  }
  // Becomes active: anchors every parcel at its position. contact_clock_s: see StepRequest.
  void enter(const Physics& physics, double contact_clock_s, SortedParcels& parcels);
  // Stops being active: the stored positions become the current ones.
  void leave(SortedParcels& parcels);
  // Stores time and trajectories, between steps.
  void save(const SortedParcels& parcels, BackendState& state) const;
  // Goes on from a saved state, after reset_time(). parcels: those of the state, in the order of ids.
  void resume(const Physics& physics, const BackendState& state, SortedParcels& parcels);
  // Advances by the request, or as far as its budget lasts. ball: state at its start, then at its end;
  // ignored within a step, then that of the moment.
  void advance(const Physics& physics, const StepRequest& request, SortedParcels& parcels, BallState& ball,
               StepReport& report);

  // The last request ended within a step, which the next one completes.
  bool is_mid_step() const { return is_mid_step_; }
  // The last request ended at a window that cannot be solved.
  bool is_unresolvable() const { return is_unresolvable_; }
  double tick_s() const { return run_.reference_ticks.tick_s; }

  WindowLength& window_length() { return window_length_; }
  EpochLength& epoch_length() { return epoch_length_; }
  std::uint64_t memory_bytes() const;

 private:
  struct Epoch {
    ExactConstants constants;
    EpochInput input;
    std::uint32_t done = 0;  // ticks
  };
  struct Chord {
    StepPlan plan;           // start and length of the chord
    std::uint32_t done = 0;  // ticks
    BallSums frozen_hits;
  };

  void evaluate(const ExactConstants& c, const SortedParcels& parcels, std::int32_t tick,
                std::vector<Vec2i>& position) const;
  double fastest_parcel_mps(const SortedParcels& parcels);
  double fastest_mps(const Physics& physics, const SortedParcels& parcels);
  bool ball_needs_finer_ticks() const;
  void anchor_all(SortedParcels& parcels);

  BallState ball_now() const;
  void adopt(const Physics& physics, const StepRequest& request);
  double end_of_step_s(const StepRequest& request, std::uint32_t k) const {
    return series_start_s_ + (request.num_done + k) * request.dt_s;
  }
  std::uint64_t tick_at(double time_s) const {
    return static_cast<std::uint64_t>(std::llround(time_s / run_.reference_ticks.tick_s));
  }
  void count_ended_steps(const StepRequest& request, double start_s, StepReport& report);
  void advance_steps(const StepRequest& request, SortedParcels& parcels, StepReport& report);
  bool advance_until(std::uint64_t until, const StepRequest& request, const Deadline& deadline,
                     SortedParcels& parcels, StepReport& report);
  void begin_epoch(const StepRequest& request, SortedParcels& parcels, StepReport& report);
  void begin_chord(std::uint64_t until, SortedParcels& parcels, StepReport& report);
  void predict_chord(SortedParcels& parcels, StepReport& report);
  void end_chord();
  WindowRequest window_request(std::uint32_t end, const StepRequest& request) const;
  std::uint32_t choose_window(std::uint64_t until, double left_ms) const;
  void advance_window(std::uint32_t length, const StepRequest& request, SortedParcels& parcels,
                      StepReport& report);
  void adopt_outcome(const WindowOutcome& outcome, std::uint32_t asked, StepReport& report);
  void retry(const WindowOutcome& outcome, std::uint32_t length);
  void end_epoch(SortedParcels& parcels);

  ThreadTeam& team_;
  ExactStepper stepper_;
  WindowLength window_length_;
  EpochLength epoch_length_;
  bool active_ = false;
  bool ball_is_new_ = false;
  bool is_mid_step_ = false;
  bool is_unresolvable_ = false;
  double time_s_ = 0.0;          // of completed steps since the reset
  double series_start_s_ = 0.0;  // time at the start of the series of requests
  double ms_per_tick_ = 0.0;     // of the last window
  RunConstants run_;
  Neighbors neighbors_ = Neighbors::grid;
  ExactProgress progress_;
  std::optional<Epoch> epoch_;
  StepTotals invalid_;  // parcels that the last prediction of an epoch found invalid
  std::optional<Chord> chord_;
  std::vector<Vec2i> position_;           // n + kSearchPadding; at the epoch's start
  std::vector<Vec2i> current_positions_;  // n + kSearchPadding
  bool current_is_valid_ = false;
};

}  // namespace pf
