#include "cuda/domains/cuda_domain.cuh"

#include <algorithm>
#include <bit>

#include "cuda/domains/transfer.cuh"

namespace pf {
namespace {

// Room beyond kSlack, for few parcels.
constexpr std::size_t kMinSlack = 4096;
constexpr std::size_t kMaxAppended = 1U << 20;  // at a time

int highest_priority() {
  int lowest = 0, highest = 0;
  PF_CUDA(cudaDeviceGetStreamPriorityRange(&lowest, &highest));
  return highest;
}

std::int32_t clamp_to_int32(std::int64_t value) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, INT32_MIN, INT32_MAX));
}

CpuTally tally_of(const TallySlot* slots) {
  CpuTally sum;
  for (unsigned k = 0; k < kNumSlots; ++k) {
    const TallySlot& slot = slots[k];
    CpuTally part;
    part.num_collisions = slot.num_collisions;
    part.num_ball_hits = slot.num_hits;
    part.num_retired = slot.num_retired;
    part.num_invalid = slot.num_invalid;
    part.first_invalid_id = ~slot.first_invalid_id;
    part.impulse_sum = static_cast<std::int64_t>(slot.impulse_sum);
    part.max_overlap = std::bit_cast<float>(slot.max_overlap_bits);
    part.max_displacement = static_cast<std::int32_t>(slot.max_displacement);
    part.ball = {static_cast<std::int64_t>(slot.ball_x), static_cast<std::int64_t>(slot.ball_y),
                 static_cast<std::int64_t>(slot.ball_torque)};
    sum.add(part);
  }
  return sum;
}

}  // namespace

void CudaDomain::Margin::make_room() {
  if (size() <= index.capacity()) return;
  const std::size_t capacity = size() + size() / 4;
  index = DeviceBuffer<std::uint32_t>(capacity);
  motion = DeviceBuffer<ParcelMotion>(capacity);
  host_motion = PinnedBuffer<ParcelMotion>(capacity);
}

CudaDomain::CudaDomain(unsigned index, int device)
    : index_(index), device_(device), copy_stream_(highest_priority()), copied_(cudaEventDisableTiming) {
  clear_slots();
}

CudaDomain::~CudaDomain() {
  cudaStreamSynchronize(stream_);
  cudaStreamSynchronize(copy_stream_);
}

// Keeps the parcels.
void CudaDomain::reserve(std::size_t num) {
  if (num <= capacity_) return;
  synchronize();  // kernels may still read what is freed here
  const std::size_t capacity =
      in_equal_parts(static_cast<std::size_t>(kSlack * static_cast<double>(num)) + kMinSlack);
  next_ = {};
  cell_sort_ = {};
  num_counted_ = 0;
  contact_memory_ = {};
  DeviceParcels larger(capacity);
  copy_on_device(larger.position.data(), current_.position.data(), num_, stream_);
  copy_on_device(larger.velocity.data(), current_.velocity.data(), num_, stream_);
  copy_on_device(larger.id.data(), current_.id.data(), num_, stream_);
  copy_on_device(larger.heated.data(), current_.heated.data(), DeviceParcels::num_words(num_), stream_);
  synchronize();
  current_ = std::move(larger);
  larger = {};  // it has the old arrays
  next_ = DeviceParcels(capacity);
  cell_sort_ = DeviceCellSort(static_cast<std::uint32_t>(capacity));
  contact_memory_.reserve(capacity, stream_);
  capacity_ = static_cast<std::uint32_t>(capacity);
}

void CudaDomain::clear(const Slabs& slabs, std::size_t num) {
  const DeviceScope scope(device_);
  synchronize();
  slabs_ = slabs;
  num_ = num_ghosts_ = num_dropped_ = num_near_ = num_counted_ = 0;
  has_new_motion_ = is_sorted_ = false;
  if (num > capacity_) {  // there is nothing to keep
    current_ = {};
    capacity_ = 0;
  }
  if (capacity_ / 4 > num + kMinSlack) {
    current_ = {};
    next_ = {};
    cell_sort_ = {};
    contact_memory_ = {};
    traffic_ = {};
    host_traffic_ = {};
    near_ = {};
    sent_ = {};
    ghosts_ = {};
    capacity_ = 0;
  }
  sent_.clear(slabs.num);
  ghosts_.clear(slabs.num);
  reserve(std::max<std::size_t>(num, 1));
}

void CudaDomain::append(const std::vector<Parcel>& parcels, std::uint32_t id_bits) {
  if (parcels.empty()) return;
  const DeviceScope scope(device_);
  reserve(num_ + parcels.size());
  const std::size_t num_at_once = std::min(parcels.size(), kMaxAppended);
  if (traffic_.capacity() < num_at_once) traffic_ = DeviceBuffer<Parcel>(num_at_once);
  for (std::size_t begin = 0; begin < parcels.size(); begin += num_at_once) {
    const auto num = static_cast<std::uint32_t>(std::min(num_at_once, parcels.size() - begin));
    to_device(traffic_.data(), parcels.data() + begin, num, copy_stream_);
    launch_append(traffic_.data(), num, id_bits, num_, current_.pointers(), copy_stream_);
    num_ += num;
  }
  PF_CUDA(cudaStreamSynchronize(copy_stream_));  // the caller's memory
}

void CudaDomain::pack(unsigned slab, std::vector<ParcelMotion>& out) const {
  const ParcelMotion* motion = sent_.host_motion.data();
  out.assign(motion + sent_.begin(slab), motion + sent_.end(slab));
}

void CudaDomain::unpack(unsigned slab, const std::vector<ParcelMotion>& in) {
  if (in.empty()) return;
  std::copy(in.begin(), in.end(), ghosts_.host_motion.data() + ghosts_.begin(slab));
  has_new_motion_ = true;
}

void CudaDomain::start(const TimeStep& step) {
  const DeviceScope scope(device_);
  *host_state_ = {};
  host_state_->motion = step.ball;
  host_state_->rounding_key[0] = step.key;
  host_state_->displaced = static_cast<std::uint32_t>(std::min<std::int64_t>(displacement_, kHalfSide));
  to_device(state_.data(), host_state_.get(), 1, stream_);
  launch_ = {};
  launch_.constants = step.constants;
  launch_.space = {slabs_.world, grid_, cell_sort_.cell_start(), num_,
                   step.neighbors == Neighbors::all_pairs};
  launch_.from = current_.pointers();
  launch_.contacts = contact_memory_.lay_out(next_, cell_sort_);
  launch_.state = state_.data();
  launch_.displaced = {&state_.data()->displaced, &state_.data()->none};
  launch_.slots = slots_.data();
  launch_.method = step.method;
  launch_.num = num_;
  if (num_ghosts_ > 0) {
    const std::int64_t width = step.constants.contact_reach + displacement_;
    launch_.low_without_ghosts = clamp_to_int32(slabs_.edge(index_) + width);
    launch_.high_without_ghosts = clamp_to_int32(slabs_.edge(index_ + 1) - width - 1);
  }
  launch_.near = near_.data();
  launch_.num_near = num_near_;
  launch_contacts(launch_, stream_);
}

void CudaDomain::note_transfers() {
  const DeviceScope scope(device_);
  PF_CUDA(cudaEventRecord(copied_, copy_stream_));
  has_new_motion_ = true;
}

bool CudaDomain::have_transfers_ended() const {
  const cudaError_t result = cudaEventQuery(copied_);
  if (result != cudaErrorNotReady) PF_CUDA(result);
  return result == cudaSuccess;
}

void CudaDomain::wait_for_transfers_to(const CudaDomain& other) {
  const DeviceScope scope(device_);
  PF_CUDA(cudaStreamWaitEvent(stream_, other.copied_, 0));
}

// The ghosts' motion reaches the device while it still works on what start() launched.
void CudaDomain::step_borders() {
  const DeviceScope scope(device_);
  if (has_new_motion_) {
    if (!is_linked_) {
      to_device(ghosts_.motion.data(), ghosts_.host_motion.data(), ghosts_.size(), copy_stream_);
      PF_CUDA(cudaEventRecord(copied_, copy_stream_));
    }
    PF_CUDA(cudaStreamWaitEvent(stream_, copied_, 0));
    launch_unpack(ghosts_.motion.data(), ghosts_.index.data(), ghosts_.size(), current_.pointers(), stream_);
    has_new_motion_ = false;
  }
  launch_border_contacts(launch_, stream_);
  launch_move(launch_, stream_);
  launch_pack(current_.pointers(), sent_.index.data(), sent_.size(), sent_.motion.data(), stream_);
  if (!is_linked_) to_host(sent_.host_motion.data(), sent_.motion.data(), sent_.size(), stream_);
  to_host(host_slots_.data(), slots_.data(), kNumSlots, stream_);
  clear_slots();
}

void CudaDomain::clear_slots() {
  PF_CUDA(cudaMemsetAsync(slots_.data(), 0, kNumSlots * sizeof(TallySlot), stream_));
}

CpuTally CudaDomain::finish() {
  const DeviceScope scope(device_);
  synchronize();
  return tally_of(host_slots_.data());
}

}  // namespace pf
