// Method `exact` on the CPU: epochs and their windows.
//
// At an epoch's start every parcel predicts its next event, and keeps it until it is due or something changes
// it. A window takes the parcels whose events are due. Those whose events depend on each other form a
// cluster. Each cluster is solved by one thread in the order of time, as if nothing else happened. Clusters
// that run into each other, or whose new trajectories would collide, are merged and solved again, until all
// trajectories are consistent. Then they are the only consistent ones (docs/exact.md).
#pragma once

#include <cstdint>
#include <vector>

#include "backend/exact/window.hpp"
#include "core/timing.hpp"

namespace pf {

struct WindowRequest {
  std::uint32_t begin = 0, end = 0;  // ticks of the epoch
  std::uint32_t ball_end = 0;        // the ball's trajectory is not known from this tick on
  std::uint32_t max_events = 0;      // of a cluster; a window in which one has more is cut
  std::vector<EventRecord>* events;  // receives the events; null: they are not recorded
};

struct WindowOutcome {
  bool finished = false;          // false: nothing has changed; repeat with a wider bound or a shorter window
  double needed_bound_mps = 0.0;  // largest speed of anything; above the bound if that was the reason
  std::uint32_t end = 0;          // the first tick after the window, which may have been cut
  std::uint32_t failed_at = kNoTick;  // tick at which a cluster had too many events; kNoTick: none
  std::uint32_t num_rounds = 0;  // times that clusters were solved: the first round and one after each merge
  std::uint64_t num_solved = 0;  // events in all rounds
  std::uint32_t largest_cluster = 0;  // events
  StepResult result;
  std::uint64_t event_hash = 0;  // sum of event_hash over events
  CpuTally tally;
};

class ExactStepper {
 public:
  explicit ExactStepper(ThreadTeam& team) : team_(team) {}

  // Predicts every parcel's next event. Returns the tally of parcels: invalid ones, and the largest speed.
  CpuTally begin_epoch(const EpochInput& input, const ExactConstants& constants, const BallTrajectory& ball,
                       ParcelArrays& trajectories, PhaseTimes& times);
  // Starts a chord of the ball, whose role in it the constants have, and predicts its events.
  void begin_chord(const EpochInput& input, const ExactConstants& constants, const ExactBall& ball,
                   const WindowRequest& request, ParcelArrays& trajectories, PhaseTimes& times);
  WindowOutcome solve_window(const EpochInput& input, const ExactConstants& constants,
                             const WindowRequest& request, ParcelArrays& trajectories, PhaseTimes& times);

  ExactBall& ball() { return memory_.ball; }
  const ExactBall& ball() const { return memory_.ball; }
  std::uint64_t memory_bytes() const { return memory_.memory_bytes(); }

 private:
  WindowContext context(const EpochInput& input, const ExactConstants& constants,
                        const WindowRequest& request, ParcelArrays& trajectories);

  ThreadTeam& team_;
  EpochMemory memory_;
  BallNeighbourhood ball_neighbourhood_;
  DiscSpace space_;
};

}  // namespace pf
