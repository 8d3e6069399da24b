// The cost of each term of the model: the time of a step with it less that of a step without it. Both are
// timed beside the run, on copies of its state, a few steps per frame; the run itself is only read.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/simulation.hpp"

namespace pf {

enum class Term { parcels, contacts, friction, magnus };
constexpr std::size_t kNumTerms = 4;
constexpr std::array<const char*, kNumTerms> kTermNames = {"parcels", "contacts", "friction", "Magnus"};

struct TermCost {
  bool applies = false;  // the scene has an object for the term
  bool is_on = false;
  bool is_known = false;
  double ms = 0.0;        // per step
  double error_ms = 0.0;  // standard error
};

// Milliseconds and three standard errors, to as many digits as these leave; an upper bound where they hide
// the cost.
std::string cost_text(const TermCost& cost);

// The term's switch and whether the scene has an object for it; no cost yet.
TermCost unknown_cost(const Settings& settings, Term term);
// The same settings with the term switched. Friction that is off becomes the default friction.
Settings switched(Settings settings, Term term);

// The state that both copies of a comparison start from.
struct TermOrigin {
  Settings settings;
  BallState ball;
  ParcelSnapshot parcels;
  double dt_s = 0.0;
};

// A backend of its own that repeats a few steps of the run, with its settings or with others.
class SteppingCopy {
 public:
  explicit SteppingCopy(std::unique_ptr<Backend> backend) : backend_(std::move(backend)) {}

  // Throws UserError if the settings cannot run.
  void start(const Settings& settings, const TermOrigin& origin);
  // Milliseconds per step, as the backend times its own steps.
  double step(std::uint32_t num_steps);

 private:
  std::unique_ptr<Backend> backend_;
  Settings settings_;
  Physics physics_;  // of these settings
  double dt_s_ = 0.0;
  std::optional<std::uint32_t> num_parcels_;  // that it was reset for
};

class TermCosts {
 public:
  enum class State {
    settling,  // waits until nothing has changed for a while
    measuring,
    known,
    on_request,  // a copy would stop the picture: request() measures
    failed
  };

  // make: null if nothing can be measured.
  explicit TermCosts(MakeBackend make) : make_(std::move(make)) {}

  // Returns whether the costs were measured with that frame's work and backend.
  bool are_of(const FrameView& frame) const;
  // After each frame, while the costs are shown. A change of settings that changes the work starts over. A
  // frame without steps does nothing; others take a tenth of a frame's time, unless request() was called.
  void follow(const FrameView& frame, Backend& backend);
  // Measures now, and again if the costs are known. The picture may stop for a moment.
  void request();
  // Not shown: frees the copies.
  void pause();

  State state() const { return state_; }
  const TermCost& cost(Term term) const { return costs_[static_cast<std::size_t>(term)]; }
  // One line for the overlay; empty before the first step.
  std::string text() const;

  static constexpr double kShare = 0.1;          // of a frame's time, for a pair of steps
  static constexpr double kMinFrame_ms = 16.0;   // faster frames have as much time
  static constexpr double kMaxFrame_ms = 100.0;  // slower ones, as after a pause, have no more than this
  static constexpr std::int64_t kMaxParcels = 20'000;  // a copy of more takes longer than the budget
  static constexpr std::uint32_t kSettlingFrames = 20;
  static constexpr std::uint32_t kNumRounds = 4;      // of all terms, so that a load which comes and goes
  static constexpr std::uint32_t kPairsPerRound = 8;  // meets all of them alike; even

 private:
  struct Comparison {
    std::unique_ptr<SteppingCopy> as_set, switched;
    TermOrigin origin;
    std::uint32_t round = 0;
    std::size_t next = 0;         // place in the order of terms
    std::uint32_t num_pairs = 0;  // of the term in hand in this round, with those that warm up
    std::uint32_t num_steps = 1;  // of each half of a pair
    std::array<std::vector<double>, kNumTerms> differences_ms;
  };

  void start_over(const FrameView& frame);
  void add_times(const FrameView& frame);
  double median_step_ms() const;  // of the run in about the last second; 0 before the first step
  double budget_ms() const;
  bool is_cheap(const FrameView& frame) const;
  void begin(const FrameView& frame, Backend& backend);
  void measure(const FrameView& frame, Backend& backend);
  void advance();
  void compare(Term term);
  void finish(Term term);
  std::string step_text() const;
  void go_to_next_term();

  MakeBackend make_;
  State state_ = State::settling;
  std::array<TermCost, kNumTerms> costs_;
  std::unique_ptr<Comparison> comparison_;  // null: nothing is measured
  std::string failure_;
  bool is_requested_ = false;
  std::uint32_t num_settled_ = 0;
  std::vector<double> step_ms_;  // of the last frames
  double frame_ms_ = 0.0;        // from frame to frame, on average over them
  std::uint64_t num_frames_ = 0;
  Clock::time_point last_frame_ = Clock::now();
  Settings settings_;  // as far as they change the work of a step
  std::string backend_;
};

// Keys: the names of the terms that apply, each with is_on, ms and error_ms per step; null where it is not
// known.
nlohmann::json to_json(const TermCosts& costs);

}  // namespace pf
