// One slab of the world and its parcels, on a processor or a GPU.
//
// Parcels of other slabs that lie within a margin of this one are copied into it when all slabs are sorted,
// and their motion is brought up to date before every step. A parcel's step then reads all its partners here.
// Until the next sort parcels may move out of their slab: the margin is as wide as the contact distance and
// twice the largest displacement since.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu_tally.hpp"
#include "backend/domains/carrier.hpp"
#include "backend/domains/motion_link.hpp"
#include "backend/domains/slabs.hpp"
#include "backend/parcel_images.hpp"
#include "backend/profile.hpp"
#include "backend/time_step/time_stepper.hpp"
#include "core/timing.hpp"
#include "model/measures.hpp"
#include "model/parcel.hpp"

namespace pf {

// Ghosts are copies of parcels near a border, in the domain across it. (The ghosts of src/view are paths.)
// The motion that a ghost copies.
struct ParcelMotion {
  Vec2i position;
  Vec2f velocity;
  std::uint32_t is_heated = 0;
};

class Domain {
 public:
  virtual ~Domain() = default;

  // Removes all parcels, and makes room for `num`; adopt() takes others.
  virtual void clear(const Slabs& slabs, std::size_t num) = 0;

  // The sort of all slabs, in this order.
  // 1. Moves the parcels that have left the slab to out[slab], and lets go of the ghosts. margin: that of 3.
  // constants: those of 5. A GPU works on while the caller continues.
  virtual void release(const StepConstants& constants, std::int64_t margin,
                       std::vector<std::vector<Parcel>>& out) = 0;
  // 2. Takes over those of other slabs.
  virtual void adopt(const std::vector<Parcel>& parcels) = 0;
  // 3. Copies parcels within `margin` of another slab, position units, to out[slab].
  virtual void copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out) = 0;
  // 4. Takes the ghosts, another slab's parcels; slabs in order.
  virtual void add_ghosts(unsigned slab, const std::vector<Parcel>& parcels) = 0;
  // 5. Sorts parcels and ghosts by cell. Of all functions only this one and step_borders() may use all
  // threads of the process. Returns the displacement along an axis, position units, from which on a sort pays
  // off.
  virtual std::int64_t sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times) = 0;
  // 6. Removes dropped parcels, and records the new indices of ghosts and of parcels that others hold as
  // ghosts.
  virtual void find_borders() = 0;

  // A step of all own parcels, in this order. step: valid until its end.
  // 1. Begins with what needs no ghosts. A GPU works on while the caller continues.
  virtual void start(const TimeStep& step) = 0;
  // 2. Unless the ghosts are as of the sort, or a MotionLink does it: motion, before this step, of the
  // parcels that another slab has as ghosts, in the order of copy_margins.
  virtual void pack(unsigned slab, std::vector<ParcelMotion>& out) const = 0;
  virtual void unpack(unsigned slab, const std::vector<ParcelMotion>& in) = 0;
  // 3. Goes on with the rest.
  virtual void step_borders() = 0;
  // 4. Waits for the end.
  virtual CpuTally finish() = 0;
  // Notes that a parcel of any slab may have moved so far along an axis in the last step, position units.
  virtual void add_displacement(std::int32_t units) = 0;

  // Own parcels only, in any order.
  virtual void visit(const std::function<void(const Parcel&)>& see) const = 0;
  virtual ParcelSums sums(double mass_kg) const;  // over own parcels; mass_kg: of each
  virtual void add_to(Profile& profile) const;    // own parcels
  // Own parcels: adds the shares of every one_in-th id to pixels; appends those in the picture.
  virtual void count(const PixelGrid& grid, const CountStyle& style, std::vector<std::uint32_t>& pixels);
  virtual void gather(const PixelGrid& grid, std::vector<DrawnParcel>& to) const;
  virtual std::uint64_t memory_bytes() const = 0;

 protected:
  Slabs slabs_;  // of the last clear()
};

// The GPUs of this machine, for domains.
class DomainGpus {
 public:
  virtual ~DomainGpus() = default;

  virtual std::string name() const = 0;  // for the report
  // Domain of slab `index`. place: its number among the domains of this machine, which take the GPUs in turn.
  virtual std::unique_ptr<Domain> make(unsigned index, unsigned place) = 0;
  // Learns which domains of all ranks are on the GPUs of this one. All ranks call it, after make(). Throws
  // nothing.
  virtual void find_sharing(Carrier& carrier) = 0;
  // Throws UserError if the parcels of the world do not fit the GPUs of this rank when shared equally among
  // num_domains. held_bytes: what a domain holds now.
  virtual void check_room(std::size_t num_parcels, unsigned num_domains, std::uint64_t held_bytes) const = 0;
  // A link between `domains`, which make() has made for this rank, and those of the other ranks; or null, and
  // the reason. All ranks call it, and get the same. The domains must outlive the link.
  virtual std::unique_ptr<MotionLink> link(const std::vector<std::unique_ptr<Domain>>& domains,
                                           Carrier& carrier, std::string& why) = 0;
  // See Backend; of all GPUs that have domains of this process.
  virtual double measure_copy_bandwidth(std::size_t num_bytes) = 0;
};

}  // namespace pf
