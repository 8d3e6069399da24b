// The fast loop over the parcels of a step: each touching pair is found once, and undisturbed parcels are
// moved four at a time. It gives the bits of the plain loop (TimeStepper::step_range).
#pragma once

#include <cstdint>
#include <vector>

#include "backend/cpu_tally.hpp"
#include "backend/parcel_arrays.hpp"
#include "backend/time_step/free_flight.hpp"
#include "backend/time_step/pair_search.hpp"
#include "backend/time_step/step_input.hpp"

namespace pf {

class PairedLoop {
 public:
  explicit PairedLoop(ThreadTeam& team) : team_(team), scratch_(team.size()) {}

  // Width of the cells for so many parcels in an area, position units.
  static double cell_width(const GridArea& area, std::size_t num_parcels, double contact_distance);

  // False: this processor lacks the instructions.
  static bool is_supported() { return choose_free_flight(false, Boundary::open) != nullptr; }
  // Displacement along an axis since the sort up to which parcels can be searched, position units. Negative:
  // they cannot.
  static std::int64_t covered_displacement(const SortedParcels& parcels, const StepConstants& constants) {
    const std::int64_t room = PairSearch::max_reach(parcels.grid) - constants.contact_reach;
    return room < 0 ? -1 : room / 2;
  }

  // To be called after every sort.
  void prepare(const SortedParcels& parcels, Boundary boundary) {
    search_.prepare(team_, parcels.grid, boundary, parcels.size(), parcels.cell_start);
    rough_.forget();
  }
  // One of these is to be called after any other change of positions than by run(): of all, or of `moved`.
  void forget_positions() { rough_.forget(); }
  void update_positions(const std::vector<std::uint32_t>& moved, const SortedParcels& parcels) {
    rough_.update(moved, parcels.current.position.data());
  }
  // Makes a step in place. Adds to the tallies, one for each thread; displacements may be too large.
  void run(const StepInput& input, Method method, SortedParcels& parcels, std::vector<CpuTally>& tallies);

  std::uint64_t memory_bytes() const {
    return search_.memory_bytes() + rough_.memory_bytes() + sizeof(std::uint32_t) * contacts_.capacity();
  }

 private:
  struct TouchedParcel {
    std::uint32_t parcel;
    ContactSums sums;
  };

  // Consecutive parcels, begin .. end - 1. Those of other shares may be compared with those of the head,
  // begin .. head_end - 1, which move after all searches.
  struct alignas(64) Share {
    std::size_t begin = 0, head_end = 0, end = 0;
    std::vector<TouchedParcel> touched;            // parcels of the share that have not moved
    std::vector<TouchedParcel> beyond;             // parcels of other shares
    std::size_t beyond_begin = 0, beyond_end = 0;  // these are among beyond_begin .. beyond_end - 1
    bool holds(std::uint32_t i) const { return i >= begin && i < end; }
    void start(std::size_t first, std::size_t last, std::size_t end_of_head);
    void add(std::uint32_t i, const ContactSums& sums, std::vector<std::uint32_t>& contacts);
  };
  // Working memory of a thread.
  struct alignas(64) Scratch {
    std::vector<TouchingPair> pairs;  // of a block of parcels
    std::vector<TouchedParcel> due;   // those that move now
    std::vector<Parcel> before;       // of each of `due`, before the step
    FreeFlights flights;
  };
  struct Work {
    const StepInput& input;
    SortedParcels& parcels;
    Share& share;
    Scratch& scratch;
    CpuTally& tally;
  };

  void divide(const SortedParcels& parcels, bool has_contacts);
  template <class Contact, bool kBall, Boundary kBoundary>
  void search_and_move(const Work& work);
  void prefetch(const ParcelArrays& parcels, std::uint32_t i) const;
  template <class Contact, Boundary kBoundary>
  void touch(const Work& work, TouchingPair pair);
  template <bool kBall, Boundary kBoundary>
  void move_head(const Work& work);
  template <bool kBall, Boundary kBoundary>
  void move(const Work& work, std::size_t begin, std::size_t end);
  void list_due(const Work& work, std::size_t begin, std::size_t end);
  static std::int32_t apply_contacts(const Work& work);

  ThreadTeam& team_;
  PairSearch search_;
  RoughPositions rough_;  // current ones
  std::size_t num_shares_ = 0;
  std::vector<Share> shares_;     // num_shares_ or more
  std::vector<Scratch> scratch_;  // of each thread
  // 1 + place in `touched` of the parcel's share, or in `due` once it is there; 0: the parcel touches none.
  std::vector<std::uint32_t> contacts_;
};

}  // namespace pf
