// Steps of the time-stepped methods over parcels in memory: those of a whole world, or of a slab of it.
#pragma once

#include "backend/cpu_tally.hpp"
#include "backend/parcel_arrays.hpp"
#include "backend/time_step/paired_loop.hpp"
#include "backend/time_step/step_input.hpp"

namespace pf {

struct TimeStep {
  const StepConstants& constants;
  Method method = Method::impulse;
  Neighbors neighbors = Neighbors::grid;
  BallMotion ball;
  std::uint32_t key = 0;              // of the random roundings
  const DrawBuffers* draw = nullptr;  // null: nothing is drawn
};

class TimeStepper {
 public:
  // Both must outlive it.
  TimeStepper(ThreadTeam& team, SortedParcels& parcels) : team_(team), parcels_(parcels), paired_(team) {}

  // From now on the plain loop makes the steps, for tests. Initially, if the processor can, PairedLoop does.
  void use_plain_loop() {
    is_plain_ = true;
    parcels_.sorted = false;
  }

  // Displacement along an axis since the sort up to which partners are searched nearby, position units.
  // Negative: none are.
  std::int64_t covered_displacement(const StepConstants& constants) const;
  // True if parcels are sorted and have moved no farther.
  bool is_search_near(const StepConstants& constants) const {
    return parcels_.sorted && displacement_ <= covered_displacement(constants);
  }
  // Sorts by cells within an area, which all parcels of a world that is not periodic are in.
  void sort(const StepConstants& constants, const GridArea& area, PhaseTimes& times);
  // One pass over all parcels; the new state becomes the current one, but for ghosts, whose state is
  // undefined then. Parcels are sorted, unless the search is all_pairs or there are no contacts.
  CpuTally advance(const TimeStep& step);
  // The same, but only pushes overlapping parcels apart.
  CpuTally push_out(const StepConstants& constants, Neighbors neighbors);
  // Notes that a parcel may have moved so far along an axis since, position units. advance() and push_out()
  // do not.
  void add_displacement(std::int32_t units) { displacement_ += units; }
  // Notes that others have changed the positions of these parcels, after a sort.
  void add_moved(const std::vector<std::uint32_t>& moved) { paired_.update_positions(moved, parcels_); }
  std::uint64_t memory_bytes() const { return paired_.memory_bytes(); }

 private:
  using RangeFunction = void (TimeStepper::*)(const StepInput&, std::size_t, std::size_t, CpuTally&);

  template <class Contact, bool kBall, Boundary kBoundary>
  void step_range(const StepInput& input, std::size_t begin, std::size_t end, CpuTally& tally);
  // range: null for paired_.
  CpuTally run(const TimeStep& step, RangeFunction range);

  ThreadTeam& team_;
  SortedParcels& parcels_;
  PairedLoop paired_;
  bool is_plain_ = !PairedLoop::is_supported();
  std::int64_t displacement_ = 0;  // bound on displacements along an axis since the sort, position units
};

}  // namespace pf
