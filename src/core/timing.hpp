// The time of a frame, in milliseconds: one slot per named phase.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <limits>

namespace pf {

// The phases before `map` make up a step: both kinds of methods sort; then a time-stepped method works in
// collide_integrate and ball, method `exact` in predict, solve, reconcile and commit.
enum class Phase {
  sort,
  grid,
  collide_integrate,
  ball,
  predict,
  solve,
  reconcile,
  commit,
  map,
  unmap,
  draw,
  panel,
  present,
  encode,
  count
};

constexpr std::size_t kNumPhases = static_cast<std::size_t>(Phase::count);
constexpr std::size_t kNumStepPhases = static_cast<std::size_t>(Phase::map);

// Keys of the report and labels of the overlay, in the order of Phase.
constexpr std::array<const char*, kNumPhases> kPhaseNames = {
    "sort", "grid",  "collide_integrate", "ball",  "predict", "solve", "reconcile", "commit", "map", "unmap",
    "draw", "panel", "present",           "encode"};

struct PhaseTimes {
  std::array<double, kNumPhases> ms{};

  double& operator[](Phase p) { return ms[static_cast<std::size_t>(p)]; }
  double operator[](Phase p) const { return ms[static_cast<std::size_t>(p)]; }
  PhaseTimes& operator+=(const PhaseTimes& other) {
    for (std::size_t i = 0; i < kNumPhases; ++i) ms[i] += other.ms[i];
    return *this;
  }
  // Time of the steps, by whichever method; the other phases show them.
  double step_ms() const { return sum_of_first(kNumStepPhases); }
  double total() const { return sum_of_first(kNumPhases); }

 private:
  double sum_of_first(std::size_t num_phases) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < num_phases; ++i) sum += ms[i];
    return sum;
  }
};

// The two phases that GL works on, by both clocks. The host's runs until the calls return; the GL device's
// covers the work itself and is read some frames late, so that nothing waits for it. NaN: not known.
struct DrawTimes {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double host_draw_ms = kUnknown;  // floor, parcels, paths, ball
  double gpu_draw_ms = kUnknown;
  double host_panel_ms = kUnknown;  // panel, overlay, marks
  double gpu_panel_ms = kUnknown;
};

using Clock = std::chrono::steady_clock;

inline double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// The end of a time budget that starts now. budget_ms 0: it never ends.
class Deadline {
 public:
  explicit Deadline(double budget_ms) : budget_ms_(budget_ms > 0.0 ? budget_ms : kNever) {}
  double left_ms() const { return budget_ms_ == kNever ? kNever : budget_ms_ - milliseconds_since(start_); }
  bool has_passed() const { return left_ms() <= 0.0; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double budget_ms_;
  Clock::time_point start_ = Clock::now();
};

// Adds its own lifetime to one phase.
class ScopedPhase {
 public:
  ScopedPhase(PhaseTimes& times, Phase phase) : times_(times), phase_(phase), start_(Clock::now()) {}
  ~ScopedPhase() { times_[phase_] += milliseconds_since(start_); }
  ScopedPhase(const ScopedPhase&) = delete;
  ScopedPhase& operator=(const ScopedPhase&) = delete;

 private:
  PhaseTimes& times_;
  Phase phase_;
  Clock::time_point start_;
};

}  // namespace pf
