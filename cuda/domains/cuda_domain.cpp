#include "cuda/domains/cuda_domain.cuh"

#include <algorithm>
#include <bit>

#include "cuda/domains/transfer.cuh"

namespace pf {
namespace {

// Room beyond kSlack, for few parcels.
constexpr std::size_t kMinSlack = 4096;
constexpr std::size_t kMaxAppended = 1U << 20;  // at a time

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
    part.max_speed2 = std::bit_cast<float>(slot.max_speed2_bits);
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

CudaDomain::CudaDomain(unsigned index, int device) : index_(index), device_(device) {
  PF_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
  // What NCCL launches goes before the contacts of own parcels.
  int lowest = 0, highest = 0;
  PF_CUDA(cudaDeviceGetStreamPriorityRange(&lowest, &highest));
  PF_CUDA(cudaStreamCreateWithPriority(&copy_stream_, cudaStreamNonBlocking, highest));
  PF_CUDA(cudaEventCreateWithFlags(&copied_, cudaEventDisableTiming));
}

CudaDomain::~CudaDomain() {
  cudaStreamSynchronize(stream_);
  cudaStreamSynchronize(copy_stream_);
  cudaStreamDestroy(stream_);
  cudaStreamDestroy(copy_stream_);
  cudaEventDestroy(copied_);
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
  synchronize();
  current_ = std::move(larger);
  next_ = DeviceParcels(capacity);
  cell_sort_ = DeviceCellSort(static_cast<std::uint32_t>(capacity));
  contact_memory_.reserve(capacity, stream_);
  capacity_ = static_cast<std::uint32_t>(capacity);
}

void CudaDomain::clear(const Slabs& slabs, std::size_t num) {
  const DeviceScope scope(device_);
  synchronize();
  slabs_ = slabs;
  num_ = num_copies_ = num_dropped_ = num_near_ = num_counted_ = 0;
  has_new_motion_ = false;
  if (capacity_ / 4 > num + kMinSlack) {
    current_ = {};
    next_ = {};
    cell_sort_ = {};
    contact_memory_ = {};
    traffic_ = {};
    host_traffic_ = {};
    near_ = {};
    sent_ = {};
    copies_ = {};
    capacity_ = 0;
  }
  sent_.clear(slabs.num);
  copies_.clear(slabs.num);
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

void CudaDomain::download_counts() {
  to_host(host_counts_.data(), counts_.data(), kNumCounts, copy_stream_);
  PF_CUDA(cudaStreamSynchronize(copy_stream_));
}

const Parcel* CudaDomain::download(const std::uint32_t* index, std::size_t num) {
  if (traffic_.capacity() < num) traffic_ = DeviceBuffer<Parcel>(num + num / 4);
  if (host_traffic_.capacity() < num) host_traffic_ = PinnedBuffer<Parcel>(num + num / 4);
  launch_gather(current_.pointers(), index, static_cast<std::uint32_t>(num), traffic_.data(), copy_stream_);
  to_host(host_traffic_.data(), traffic_.data(), num, copy_stream_);
  PF_CUDA(cudaStreamSynchronize(copy_stream_));
  return host_traffic_.data();
}

// counts_: of the parcels that have left, of those near a border, and of those near each slab.
BorderLists CudaDomain::border_lists(std::uint32_t* left, std::uint32_t* near) const {
  const Slabs::Span inside{index_ == 0 ? INT32_MIN : slabs_.edge(index_),
                           index_ + 1 == slabs_.num ? INT64_MAX : slabs_.edge(index_ + 1)};
  return {inside, {left, counts_.data()}, {near, counts_.data() + 1}, counts_.data() + 2};
}

// Until the sort, stream_ counts the parcels that stay, and copy_stream_ does all else.
void CudaDomain::release(const StepConstants& constants, std::int64_t margin,
                         std::vector<std::vector<Parcel>>& out) {
  const DeviceScope scope(device_);
  auto* left = reinterpret_cast<std::uint32_t*>(cell_sort_.scratch().keys);
  std::uint32_t* near = left + capacity_;
  PF_CUDA(cudaMemsetAsync(counts_.data(), 0, kNumCounts * sizeof(std::uint32_t), copy_stream_));
  launch_find_borders(current_.pointers(), 0, num_, margins(margin), border_lists(left, near), copy_stream_);
  download_counts();
  const std::uint32_t num_left = host_counts_.data()[0];
  num_near_ = host_counts_.data()[1];
  const Parcel* parcels = download(left, num_left);
  launch_drop(current_.pointers(), left, num_left, stream_);
  if (near_.capacity() < num_near_) near_ = DeviceBuffer<std::uint32_t>(num_near_ + num_near_ / 4);
  copy_on_device(near_.data(), near, num_near_, stream_);
  PF_CUDA(cudaEventRecord(copied_, stream_));
  PF_CUDA(cudaStreamWaitEvent(copy_stream_, copied_, 0));
  // There will be about as many copies as before.
  grid_ = choose_grid(slabs_.world, slabs_.area(index_, margin), num_ - num_left, step_cells(constants));
  begin_counting();
  for (std::uint32_t k = 0; k < num_left; ++k) out[slabs_.owner(parcels[k].position.x)].push_back(parcels[k]);
  num_dropped_ = num_copies_ + num_left;
  num_copies_ = 0;
  first_adopted_ = num_;
  has_new_motion_ = false;
}

SlabMargins CudaDomain::margins(std::int64_t margin) const {
  SlabMargins margins{};
  for (unsigned k = 0; k < slabs_.num; ++k) margins.slab[k] = slabs_.span(k);
  margins.num = slabs_.num;
  margins.own = index_;
  margins.margin = margin;
  margins.extent = slabs_.world.boundary == Boundary::periodic ? slabs_.extent() : 0;
  return margins;
}

// Adds those that came in to the lists of parcels near a border.
void CudaDomain::find_near_adopted(const SlabMargins& slabs) {
  const std::uint32_t num_adopted = num_ - first_adopted_;
  if (near_.capacity() < num_near_ + num_adopted) {
    DeviceBuffer<std::uint32_t> larger(num_near_ + num_adopted + num_near_ / 4);
    copy_on_device(larger.data(), near_.data(), num_near_, copy_stream_);
    PF_CUDA(cudaStreamSynchronize(copy_stream_));
    near_ = std::move(larger);
  }
  const BorderLists lists = border_lists(nullptr, near_.data());  // none of them has left
  launch_find_borders(current_.pointers(), first_adopted_, num_adopted, slabs, lists, copy_stream_);
  download_counts();
  num_near_ = host_counts_.data()[1];
}

void CudaDomain::copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out) {
  const DeviceScope scope(device_);
  const SlabMargins slabs = margins(margin);
  find_near_adopted(slabs);
  sent_.clear(slabs_.num);
  copies_.clear(slabs_.num);
  std::uint32_t* next = host_counts_.data() + 2;
  for (unsigned k = 0; k < slabs_.num; ++k) {
    sent_.set_size(k, next[k]);
    next[k] = static_cast<std::uint32_t>(sent_.begin(k));
  }
  sent_.make_room();
  std::uint32_t* by_slab = counts_.data() + 2;
  to_device(by_slab, next, slabs_.num, copy_stream_);
  launch_divide_by_slab(current_.pointers(), near_.data(), num_near_, slabs, {by_slab, sent_.index.data()},
                        copy_stream_);
  const Parcel* parcels = download(sent_.index.data(), sent_.size());
  for (unsigned k = 0; k < slabs_.num; ++k) out[k].assign(parcels + sent_.begin(k), parcels + sent_.end(k));
}

void CudaDomain::add_copies(unsigned slab, const std::vector<Parcel>& parcels) {
  copies_.set_size(slab, parcels.size());
  append(parcels, kCopyBit);
  num_copies_ += static_cast<std::uint32_t>(parcels.size());
}

void CudaDomain::begin_counting() {
  keys_ = cell_sort_.begin(grid_, stream_);
  launch_count_kept(grid_, current_.pointers(), 0, num_, keys_, stream_);
  num_counted_ = num_;
}

std::int64_t CudaDomain::sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times) {
  const ScopedPhase timing(times, Phase::sort);
  const DeviceScope scope(device_);
  copies_.make_room();
  launch_count_up(num_ - num_copies_, num_copies_, copies_.index.data(), stream_);
  if (num_counted_ == 0) begin_counting();
  launch_count_kept(grid_, current_.pointers(), num_counted_, num_ - num_counted_, keys_, stream_);
  num_counted_ = 0;
  cell_sort_.sum_counts(grid_, stream_);
  cell_sort_.scatter(current_.pointers(), next_.pointers(), num_, stream_);
  std::swap(current_, next_);
  num_ -= num_dropped_;
  num_dropped_ = 0;
  displacement_ = 0;
  margin_ = margin;
  return static_cast<std::int64_t>(kWidestStepReach * constants.contact_distance) - constants.contact_reach;
}

void CudaDomain::find_borders() {
  const DeviceScope scope(device_);
  cell_sort_.update_indices(sent_.index.data(), sent_.size(), stream_);
  cell_sort_.update_indices(copies_.index.data(), copies_.size(), stream_);
  cell_sort_.update_indices(near_.data(), num_near_, stream_);
  synchronize();
}

void CudaDomain::pack(unsigned slab, std::vector<ParcelMotion>& out) const {
  const ParcelMotion* motion = sent_.host_motion.data();
  out.assign(motion + sent_.begin(slab), motion + sent_.end(slab));
}

void CudaDomain::unpack(unsigned slab, const std::vector<ParcelMotion>& in) {
  if (in.empty()) return;
  std::copy(in.begin(), in.end(), copies_.host_motion.data() + copies_.begin(slab));
  has_new_motion_ = true;
}

void CudaDomain::start(const TimeStep& step) {
  const DeviceScope scope(device_);
  *host_state_ = {};
  host_state_->motion = step.ball;
  host_state_->rounding_key = step.key;
  host_state_->max_displacement = displacement_;
  to_device(state_.data(), host_state_.get(), 1, stream_);
  PF_CUDA(cudaMemsetAsync(slots_.data(), 0, kNumSlots * sizeof(TallySlot), stream_));
  launch_ = {};
  launch_.constants = step.constants;
  launch_.space = {slabs_.world, grid_, cell_sort_.cell_start(), num_,
                   step.neighbors == Neighbors::all_pairs};
  launch_.from = current_.pointers();
  launch_.contacts = contact_memory_.lay_out(next_, cell_sort_);
  launch_.state = state_.data();
  launch_.slots = slots_.data();
  launch_.method = step.method;
  launch_.num = num_;
  if (num_copies_ > 0) {
    launch_.low_without_copies = slabs_.edge(index_) + margin_;
    launch_.high_without_copies = slabs_.edge(index_ + 1) - margin_;
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

// The copies' motion reaches the device while it still works on what start() launched.
void CudaDomain::step_borders() {
  const DeviceScope scope(device_);
  if (has_new_motion_) {
    if (!is_linked_) {
      to_device(copies_.motion.data(), copies_.host_motion.data(), copies_.size(), copy_stream_);
      PF_CUDA(cudaEventRecord(copied_, copy_stream_));
    }
    PF_CUDA(cudaStreamWaitEvent(stream_, copied_, 0));
    launch_unpack(copies_.motion.data(), copies_.index.data(), copies_.size(), current_.pointers(), stream_);
    has_new_motion_ = false;
  }
  launch_border_contacts(launch_, stream_);
  launch_move(launch_, stream_);
  launch_pack(current_.pointers(), sent_.index.data(), sent_.size(), sent_.motion.data(), stream_);
  if (!is_linked_) to_host(sent_.host_motion.data(), sent_.motion.data(), sent_.size(), stream_);
  to_host(host_slots_.data(), slots_.data(), kNumSlots, stream_);
}

CpuTally CudaDomain::finish() {
  const DeviceScope scope(device_);
  synchronize();
  return tally_of(host_slots_.data());
}

}  // namespace pf
