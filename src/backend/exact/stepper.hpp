// Method `exact` on the CPU: one step.
//
// Every parcel predicts its earliest event. Parcels whose events hang together form a cluster; clusters are
// solved side by side, each by one thread in the order of time, as if nothing else happened
// (exact_cluster_solver.hpp). Clusters that run into each other, or whose new lines would have met, are
// solved again as one, until the lines of all fit together: then they are the only ones that can be
// (docs/exact.md).
#pragma once

#include <cstdint>
#include <vector>

#include "backend/exact/step_state.hpp"
#include "core/thread_team.hpp"

namespace pf {

struct StepOutcome {
  bool finished = false;          // else nothing has changed and the step must be repeated with other bounds
  double fastest_mps = 0.0;       // largest speed of a parcel that an event led to
  double needed_bound_mps = 0.0;  // largest speed of anything; above the assumed bound if that was the reason
  double fastest_at_start_mps = 0.0;  // largest speed of a parcel at the begin
  std::uint32_t num_rounds = 0;       // solving, and again what had to be merged
  std::uint64_t num_events = 0;
  std::uint64_t event_hash = 0;  // sum of event_hash
  CpuTally tally;
};

class ExactStepper {
 public:
  explicit ExactStepper(ThreadTeam& team) : team_(team) {}

  // lines: sorted, positions are anchors. at_end: receives the positions at the step's end, n entries.
  StepOutcome step(const StepInput& problem, ParcelArrays& trajectories, ExactBall& ball, Vec2i* end_position,
                    std::vector<EventRecord>* events);
  std::uint64_t memory_bytes() const;

 private:
  template <Boundary kBoundary>
  struct Prediction;  // exact_prediction.hpp
  template <Boundary kBoundary>
  struct Phases;
  template <Boundary kBoundary>
  StepOutcome run(const StepInput& problem, ParcelArrays& trajectories, ExactBall& ball, Vec2i* end_position,
                   std::vector<EventRecord>* events);

  void prepare(std::size_t num_parcels);

  ThreadTeam& team_;
  std::vector<WorkerState> workers_;
  BoundingDiscs discs_;                   // n
  std::vector<std::uint64_t> event_key_;  // n each; kNoEvent between steps
  std::vector<std::uint32_t> event_partner_;
  std::vector<std::uint32_t> owner_;   // n + kSearchPadding; kNone between steps
  std::vector<std::uint32_t> member_slot_;   // while clusters are formed: towards a parcel of the same cluster
  std::vector<std::uint32_t> active_;  // parcels with an event before the end
  std::vector<std::uint32_t> near_ball_;
  std::vector<std::uint32_t> seeds_;
  std::vector<Cluster> clusters_;
  std::vector<std::uint32_t> todo_;  // clusters to solve
  BallMember ball_member_;
  std::uint32_t ball_owner_ = kInvalidIndex;
};

}  // namespace pf
