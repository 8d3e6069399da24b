// A slab on the CPU.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/domains/domain.hpp"
#include "backend/draw_buffers.hpp"
#include "backend/profile.hpp"

namespace pf {

class CpuDomain final : public Domain {
 public:
  // index: of the slab. team must outlive it.
  CpuDomain(unsigned index, ThreadTeam& team);
  CpuDomain(const CpuDomain&) = delete;
  CpuDomain& operator=(const CpuDomain&) = delete;

  void clear(const Slabs& slabs, std::size_t num) override;
  void release(const StepConstants& constants, std::int64_t margin,
               std::vector<std::vector<Parcel>>& out) override;
  void adopt(const std::vector<Parcel>& parcels) override;
  void copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out) override;
  void add_ghosts(unsigned slab, const std::vector<Parcel>& parcels) override;
  std::int64_t sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times) override;
  void find_borders() override;
  void pack(unsigned slab, std::vector<ParcelMotion>& out) const override;
  void unpack(unsigned slab, const std::vector<ParcelMotion>& in) override;
  void start(const TimeStep& step) override { step_ = &step; }
  void step_borders() override { tally_ = stepper_.advance(*step_); }
  CpuTally finish() override { return tally_; }
  void add_displacement(std::int32_t units) override { stepper_.add_displacement(units); }
  void visit(const std::function<void(const Parcel&)>& see) const override;
  std::uint64_t memory_bytes() const override;

 private:
  // With one other slab. Before the sort the lists hold slots, after it places in memory.
  struct Border {
    std::vector<std::uint32_t> sent;    // own parcels
    std::vector<std::uint32_t> ghosts;  // the other slab's
  };

  void start_appending(std::size_t num);
  void append(const Parcel& parcel, std::uint32_t slot);
  void finish_appending();
  void drop();

  unsigned index_;
  ThreadTeam& team_;
  SortedParcels parcels_;
  TimeStepper stepper_{team_, parcels_};
  const TimeStep* step_ = nullptr;  // the present one
  CpuTally tally_;                  // of the last step
  std::vector<Border> borders_;     // one for each slab
  // Between release() and copy_margins(): parcels that may be within the margin of another slab.
  std::vector<std::uint32_t> near_;
  std::uint32_t first_adopted_ = 0;   // since release()
  std::uint32_t num_slots_ = 0;       // counted from 1
  std::vector<std::uint32_t> place_;  // of each slot after the sort; [0] is not used
};

}  // namespace pf
