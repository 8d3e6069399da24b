// The sort of a slab on a GPU: what leaves and comes, ghosts, cells. Until sort() the parcels that stay are
// counted on stream_, while all else goes by copy_stream_ and the host.
#include <algorithm>

#include "cuda/domains/cuda_domain.cuh"
#include "cuda/domains/transfer.cuh"

namespace pf {

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

// Skips parcels in the middle of a slab: they have moved by at most displacement_, so they are still there.
void CudaDomain::find_borders_of_all(std::int64_t margin, const BorderLists& lists) {
  const auto column = [&](std::int64_t x) {
    const std::int64_t inside = std::clamp<std::int64_t>(x, INT32_MIN, INT32_MAX);
    return static_cast<std::uint32_t>(cell_coordinate(static_cast<std::int32_t>(inside), grid_.x));
  };
  const std::int64_t width = margin + displacement_;
  const std::uint32_t first = column(slabs_.edge(index_) + width) + 1,
                      end = column(slabs_.edge(index_ + 1) - width);
  if (is_sorted_ && first < end) {
    const SortedColumns columns{grid_, cell_sort_.cell_start(), first, end};
    launch_find_borders_in_columns(current_.pointers(), columns, margins(margin), lists, copy_stream_);
  } else {
    launch_find_borders(current_.pointers(), 0, num_, margins(margin), lists, copy_stream_);
  }
}

void CudaDomain::release(const StepConstants& constants, std::int64_t margin,
                         std::vector<std::vector<Parcel>>& out) {
  const DeviceScope scope(device_);
  auto* left = reinterpret_cast<std::uint32_t*>(cell_sort_.scratch().keys);
  std::uint32_t* near = left + capacity_;
  PF_CUDA(cudaMemsetAsync(counts_.data(), 0, kNumCounts * sizeof(std::uint32_t), copy_stream_));
  find_borders_of_all(margin, border_lists(left, near));
  download_counts();
  const std::uint32_t num_left = host_counts_.data()[0];
  num_near_ = host_counts_.data()[1];
  const Parcel* parcels = download(left, num_left);
  launch_drop(current_.pointers(), left, num_left, stream_);
  if (near_.capacity() < num_near_) near_ = DeviceBuffer<std::uint32_t>(num_near_ + num_near_ / 4);
  copy_on_device(near_.data(), near, num_near_, stream_);
  PF_CUDA(cudaEventRecord(copied_, stream_));
  PF_CUDA(cudaStreamWaitEvent(copy_stream_, copied_, 0));
  // Assumes about as many ghosts as before.
  grid_ = choose_grid(slabs_.world, slabs_.area(index_, margin), num_ - num_left, step_cells(constants));
  begin_counting();
  for (std::uint32_t k = 0; k < num_left; ++k) out[slabs_.owner(parcels[k].position.x)].push_back(parcels[k]);
  num_dropped_ = num_ghosts_ + num_left;
  num_ghosts_ = 0;
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
  ghosts_.clear(slabs_.num);
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

void CudaDomain::add_ghosts(unsigned slab, const std::vector<Parcel>& parcels) {
  ghosts_.set_size(slab, parcels.size());
  append(parcels, kGhostBit);
  num_ghosts_ += static_cast<std::uint32_t>(parcels.size());
}

void CudaDomain::begin_counting() {
  keys_ = cell_sort_.begin(grid_, stream_);
  launch_count_kept(grid_, current_.pointers(), 0, num_, keys_, stream_);
  num_counted_ = num_;
}

std::int64_t CudaDomain::sort(const StepConstants& constants, std::int64_t, PhaseTimes& times) {
  const ScopedPhase timing(times, Phase::sort);
  const DeviceScope scope(device_);
  ghosts_.make_room();
  launch_count_up(num_ - num_ghosts_, num_ghosts_, ghosts_.index.data(), stream_);
  if (num_counted_ == 0) begin_counting();
  launch_count_kept(grid_, current_.pointers(), num_counted_, num_ - num_counted_, keys_, stream_);
  num_counted_ = 0;
  cell_sort_.sum_counts(grid_, stream_);
  cell_sort_.scatter(current_.pointers(), next_.pointers(), num_, stream_);
  std::swap(current_, next_);
  num_ -= num_dropped_;
  num_dropped_ = 0;
  displacement_ = 0;
  is_sorted_ = true;
  return static_cast<std::int64_t>(kWidestStepReach * constants.contact_distance) - constants.contact_reach;
}

void CudaDomain::find_borders() {
  const DeviceScope scope(device_);
  cell_sort_.update_indices(sent_.index.data(), sent_.size(), stream_);
  cell_sort_.update_indices(ghosts_.index.data(), ghosts_.size(), stream_);
  cell_sort_.update_indices(near_.data(), num_near_, stream_);
  synchronize();
}

}  // namespace pf
