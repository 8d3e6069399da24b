// Method `exact` on the CPU: one step.
//
// Every parcel predicts its earliest event. Parcels whose events depend on each other form a cluster. Each
// cluster is solved by one thread in the order of time, as if nothing else happened. Clusters that run into
// each other, or whose new trajectories would collide, are merged and solved again, until all trajectories
// are consistent. Then they are the only consistent ones (docs/exact.md).
#pragma once

#include <cstdint>
#include <vector>

#include "backend/exact/step_state.hpp"
#include "core/timing.hpp"

namespace pf {

// State that a step changes. It stays as it is if the step does not finish.
struct StepTarget {
  ParcelArrays& trajectories;  // sorted, positions are anchors
  ExactBall& ball;
  Vec2i* end_position;               // n; receives the positions at the step's end
  std::vector<EventRecord>* events;  // receives the events; null: they are not recorded
};

struct StepOutcome {
  bool finished = false;          // false: nothing has changed; repeat with a wider bound or a shorter step
  double needed_bound_mps = 0.0;  // largest speed of anything; above the assumed bound if that was the reason
  std::uint32_t num_rounds = 0;   // times that clusters were solved: the first round and one after each merge
  StepResult result;
  std::uint64_t event_hash = 0;  // sum of event_hash over events
  CpuTally tally;
};

class ExactStepper {
 public:
  explicit ExactStepper(ThreadTeam& team) : team_(team) {}

  // times: the stages' times are added to predict, solve, reconcile and commit.
  StepOutcome step(const StepInput& input, const StepTarget& target, PhaseTimes& times);
  std::uint64_t memory_bytes() const { return memory_.memory_bytes(); }

 private:
  ThreadTeam& team_;
  StepMemory memory_;
};

}  // namespace pf
