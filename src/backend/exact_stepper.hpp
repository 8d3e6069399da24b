// Method `exact` on the CPU: one step as conservative rounds.
//
// Every parcel predicts its earliest event. In each round the events that nothing can precede any more (the
// safety rule, model/exact.hpp) are resolved, all at once, since they touch disjoint parcels; those whose
// line changed, and those that these may now meet first, predict again. Rounds go on until no event is left.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/candidate_search.hpp"
#include "backend/cell_sort.hpp"
#include "backend/cpu_tally.hpp"
#include "backend/event_record.hpp"
#include "backend/thread_team.hpp"
#include "model/exact_plan.hpp"

namespace pf {

struct ExactOutcome {
  bool finished = false;          // else nothing has changed and the step must be repeated with other bounds
  double fastest_mps = 0.0;       // largest speed of a parcel that an event led to
  double needed_bound_mps = 0.0;  // largest speed of anything; above the assumed bound if that was the reason
  double fastest_at_begin_mps = 0.0;  // largest speed of a parcel at the begin
  std::uint32_t num_rounds = 0;
  std::uint64_t event_hash = 0;  // sum of event_hash
  CpuTally tally;
};

class ExactStepper {
 public:
  explicit ExactStepper(ThreadTeam& team) : team_(team) {}

  // lines: sorted, positions are anchors. present: positions at the step's begin, n + kSearchPadding entries;
  // at_end: receives those at its end. travel: bound on displacement along an axis from the sort to the
  // begin.
  struct Problem {
    ExactConstants constants;
    SearchSpace space;             // position = present; reach and filter are set here
    std::int64_t travel = 0;       // position units
    double fastest_mps = 0.0;      // largest parcel speed at the begin
    std::uint64_t begin_tick = 0;  // since the reset
    std::uint32_t most_rounds = 10000;
  };
  ExactOutcome step(const Problem& problem, ParcelArrays& lines, ExactBall& ball, Vec2i* at_end,
                    std::vector<EventRecord>* events);
  std::uint64_t memory_bytes() const;

 private:
  enum Mark : std::uint8_t { kUntouched = 0, kChanged = 1, kFlagged = 2 };
  struct Saved {  // a parcel as it was at the step's begin
    std::uint32_t index;
    Line line;
    std::uint32_t clock;
  };
  struct Worker {  // what one thread collects in a phase, and its working memory
    SearchScratch scratch;
    SearchSpace space;
    CpuTally tally;
    std::vector<std::uint32_t> found;
    std::vector<Saved> saved;
    std::vector<EventRecord> events;
    std::uint64_t event_hash = 0;
    double fastest2 = 0.0;
  };

  template <Boundary kBoundary>
  struct Rounds;
  template <Boundary kBoundary>
  ExactOutcome run(const Problem& problem, ParcelArrays& lines, ExactBall& ball, Vec2i* at_end,
                   std::vector<EventRecord>* events);

  void prepare(const Problem& problem, std::size_t num_parcels);
  void forget_saved(bool put_back, ParcelArrays& lines);
  void collect_found(std::vector<std::uint32_t>& all);

  ThreadTeam& team_;
  std::vector<std::uint32_t> lists_[6];  // of Rounds, kept for their memory
  std::vector<Worker> workers_;
  std::vector<std::uint32_t> event_tick_;  // n each
  std::vector<std::uint32_t> event_partner_;
  std::vector<std::uint32_t> bound_;      // no true event of the parcel can come before this tick
  std::vector<float> step_speed_;         // largest of the parcel in the step so far, m/s
  std::vector<std::uint8_t> mark_;        // this round's Mark
  std::vector<std::uint8_t> saved_mark_;  // whether its line at the begin is in saved_
};

}  // namespace pf
