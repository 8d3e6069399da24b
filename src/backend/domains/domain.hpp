// One slab of the world and its parcels, on the CPU.
//
// Parcels of other slabs that lie within a margin of this one are copied into it when all slabs are sorted,
// and their motion is brought up to date before every step. A parcel's step then reads all its partners here.
// Until the next sort parcels may move out of their slab: the margin is as wide as the contact distance and
// twice the largest displacement since.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/domains/slabs.hpp"
#include "backend/draw_buffers.hpp"
#include "backend/profile.hpp"
#include "backend/time_step/time_stepper.hpp"
#include "model/parcel.hpp"

namespace pf {

// What a copy of a parcel follows.
struct ParcelMotion {
  Vec2i position;
  Vec2f velocity;
};

class Domain {
 public:
  // index: of the slab. team must outlive it.
  Domain(unsigned index, ThreadTeam& team);
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

  // Removes all parcels, and makes room for `num`; adopt() takes others.
  void clear(const Slabs& slabs, std::size_t num);

  // The sort of all slabs, in this order.
  // 1. Moves the parcels that have left the slab to out[slab], and lets go the copies.
  void release(std::vector<std::vector<Parcel>>& out);
  // 2. Takes over those of other slabs.
  void adopt(const std::vector<Parcel>& parcels);
  // 3. Copies parcels within `margin` of another slab, position units, to out[slab].
  void copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out);
  // 4. Takes the copies of another slab's parcels; slabs in order.
  void add_copies(unsigned slab, const std::vector<Parcel>& parcels);
  // 5. Uses all threads of the team, which the other functions leave alone.
  void sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times);
  // 6. Drops what was let go, and notes where the copies, and the parcels that others copied, are now.
  void find_borders();

  // Motion of the parcels that another slab has copies of, in the order of copy_margins.
  void pack(unsigned slab, std::vector<ParcelMotion>& out) const;
  void unpack(unsigned slab, const std::vector<ParcelMotion>& in);

  TimeStepper& stepper() { return stepper_; }

  // Own parcels only. Order: that of memory.
  template <class Visit>
  void visit(const Visit& see) const {
    for (std::size_t i = 0; i < parcels_.size(); ++i) {
      if (!parcels_.is_copy(i))
        see(Parcel{parcels_.current.position[i], parcels_.current.velocity[i], parcels_.current.id[i]});
    }
  }
  std::uint64_t memory_bytes() const;

 private:
  // With one other slab. Before the sort the lists hold slots, after it places in memory.
  struct Border {
    std::vector<std::uint32_t> sent;    // own parcels
    std::vector<std::uint32_t> copies;  // the other slab's
  };

  void start_appending(std::size_t num);
  void append(const Parcel& parcel, std::uint32_t slot);
  void finish_appending();
  void drop();

  unsigned index_;
  Slabs slabs_;
  ThreadTeam& team_;
  SortedParcels parcels_;
  TimeStepper stepper_{team_, parcels_};
  std::vector<Border> borders_;       // one for each slab
  std::uint32_t num_slots_ = 0;       // counted from 1
  std::vector<std::uint32_t> place_;  // of each slot after the sort; [0] is not used
};

}  // namespace pf
