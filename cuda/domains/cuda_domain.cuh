// A slab on a GPU. Its parcels and the ghosts of others lie in the same arrays; ids of ghosts have kGhostBit.
#pragma once

#include <span>
#include <vector>

#include "cuda/cell_sort.cuh"
#include "cuda/device_buffer.cuh"
#include "cuda/device_scope.cuh"
#include "cuda/domains/kernels.cuh"
#include "cuda/handles.cuh"
#include "cuda/time_step/contact_memory.cuh"
#include "cuda/time_step/kernel.cuh"

namespace pf {

class CudaDomain final : public Domain {
 public:
  // Held for each parcel, with room for those that come in and for ghosts. Slabs that are narrow against
  // their margins need more.
  static constexpr double kSlack = 1.05;
  static constexpr double kBytesPerParcel =
      kSlack * (2.0 * (sizeof(Vec2i) + sizeof(Vec2f) + sizeof(std::uint32_t) + 0.125) +
                DeviceCellSort::kBytesPerParcel + ContactMemory::kBytesPerParcel);

  // index: of the slab. device: the current one.
  CudaDomain(unsigned index, int device);
  ~CudaDomain() override;
  CudaDomain(const CudaDomain&) = delete;
  CudaDomain& operator=(const CudaDomain&) = delete;

  void clear(const Slabs& slabs, std::size_t num) override;
  void release(const StepConstants& constants, std::int64_t margin,
               std::vector<std::vector<Parcel>>& out) override;
  void adopt(const std::vector<Parcel>& parcels) override { append(parcels, 0); }
  void copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out) override;
  void add_ghosts(unsigned slab, const std::vector<Parcel>& parcels) override;
  std::int64_t sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times) override;
  void find_borders() override;
  void pack(unsigned slab, std::vector<ParcelMotion>& out) const override;
  void unpack(unsigned slab, const std::vector<ParcelMotion>& in) override;
  void start(const TimeStep& step) override;
  void step_borders() override;
  CpuTally finish() override;
  void add_displacement(std::int32_t units) override { displacement_ += units; }
  void visit(const std::function<void(const Parcel&)>& see) const override;
  void add_to(Profile& profile) const override;
  ParcelSums sums(double mass_kg) const override;
  void count(const PixelGrid& grid, const CountStyle& style, std::vector<std::uint32_t>& pixels) override;
  void gather(const PixelGrid& grid, std::vector<DrawnParcel>& to) const override;
  std::uint64_t memory_bytes() const override;

  // For a MotionLink. The lists are from the last sort; their contents are from the end of the last step.
  using Motion = std::span<ParcelMotion>;  // on the device
  // From now on motion goes by a link, not by pack() and unpack().
  void link() { is_linked_ = true; }
  int device() const { return device_; }
  Motion sent_to(unsigned slab) const { return sent_.motion_of(slab); }
  Motion ghosts_of(unsigned slab) const { return ghosts_.motion_of(slab); }
  // Transfers on it do not wait for the step's own stream.
  cudaStream_t link_stream() const { return copy_stream_; }
  // After the last transfer to the ghosts: step_borders() lets the GPU wait for what link_stream() has so
  // far.
  void note_transfers();
  bool have_transfers_ended() const;
  // The rest of this step waits for the transfers to another domain, which read what this one sends.
  void wait_for_transfers_to(const CudaDomain& other);

 private:
  // Parcels near other slabs, one list after the other: indices before the sort, then those after it, and
  // their motion on its way.
  class Margin {
   public:
    void clear(unsigned num_slabs) { end_.assign(num_slabs + 1, 0); }
    // Slabs in order.
    void set_size(unsigned slab, std::size_t num) { end_[slab + 1] = end_[slab] + num; }
    std::size_t begin(unsigned slab) const { return end_[slab]; }
    std::size_t end(unsigned slab) const { return end_[slab + 1]; }
    Motion motion_of(unsigned slab) const {
      return {motion.data() + end_[slab], end_[slab + 1] - end_[slab]};
    }
    std::uint32_t size() const { return static_cast<std::uint32_t>(end_.back()); }
    void make_room();
    std::uint64_t bytes() const { return index.bytes() + motion.bytes(); }

    DeviceBuffer<std::uint32_t> index;
    DeviceBuffer<ParcelMotion> motion;
    PinnedBuffer<ParcelMotion> host_motion;

   private:
    std::vector<std::size_t> end_{0};  // after a first 0: of each slab's list
  };

  void reserve(std::size_t num);
  void append(const std::vector<Parcel>& parcels, std::uint32_t id_bits);
  BorderLists border_lists(std::uint32_t* left, std::uint32_t* near) const;
  void find_borders_of_all(std::int64_t margin, const BorderLists& lists);
  void find_near_adopted(const SlabMargins& slabs);
  // Counts all parcels that are here.
  void begin_counting();
  void download_counts();
  // Parcels index[k], in page-locked memory until the next call.
  const Parcel* download(const std::uint32_t* index, std::size_t num);
  SlabMargins margins(std::int64_t margin) const;
  void clear_slots();
  void synchronize() const { PF_CUDA(cudaStreamSynchronize(stream_)); }

  unsigned index_;
  int device_;  // current while a function works, and while this is made
  OwnedStream stream_;
  OwnedStream copy_stream_;  // launches of NCCL have priority over the contacts of own parcels
  OwnedEvent copied_;
  std::uint32_t num_ = 0;            // in the arrays: own parcels, ghosts, and dropped ones until the sort
  std::uint32_t num_ghosts_ = 0;     // of these
  std::uint32_t num_dropped_ = 0;    // of these
  std::uint32_t first_adopted_ = 0;  // since release()
  std::uint32_t num_counted_ = 0;    // for the next sort, the first ones
  std::uint32_t num_near_ = 0;       // own parcels near other slabs
  std::uint32_t capacity_ = 0;
  DeviceParcels current_;  // in the order of the last sort
  DeviceParcels next_;     // where a sort scatters to; between sorts scratch of the contacts
  DeviceCellSort cell_sort_;
  SortKeys keys_;  // while counting
  ContactMemory contact_memory_;
  DeviceBuffer<Parcel> traffic_;  // parcels that come or go
  PinnedBuffer<Parcel> host_traffic_;
  GridShape grid_;
  bool is_sorted_ = false;
  std::int64_t displacement_ = 0;     // bound on displacements along an axis since the sort, position units
  Margin sent_, ghosts_;              // own parcels that others have as ghosts; ghosts here
  DeviceBuffer<std::uint32_t> near_;  // indices of own parcels near other slabs, as in sent_, but each once
  bool has_new_motion_ = false;       // in ghosts_.host_motion, or on its way on copy_stream_
  bool is_linked_ = false;
  static constexpr unsigned kNumCounts = 2 + kMaxDomains;
  DeviceBuffer<std::uint32_t> counts_{kNumCounts};  // see border_lists()
  PinnedBuffer<std::uint32_t> host_counts_{kNumCounts};
  StepLaunch launch_;                   // of the present step
  DeviceBuffer<std::uint32_t> pixels_;  // of count()
  PinnedBuffer<std::uint32_t> host_pixels_;
  DeviceBuffer<StepState> state_{1};
  PinnedValue<StepState> host_state_;
  DeviceBuffer<TallySlot> slots_{kNumSlots};
  PinnedBuffer<TallySlot> host_slots_{kNumSlots};
};

}  // namespace pf
