#include <fmt/format.h>

#include <algorithm>

#include "cuda/cuda_backend.cuh"
#include "cuda/cuda_devices.hpp"
#include "cuda/profile.cuh"
#include "cuda/stream.hpp"

namespace pf {
namespace {

// The state twice, and the drawn values.
constexpr double kBytesPerParcel = 2 * (sizeof(Vec2i) + sizeof(Vec2f) + sizeof(std::uint32_t) + 0.125) +
                                   sizeof(Vec2f) + sizeof(float) + DeviceCellSort::kBytesPerParcel +
                                   ContactMemory::kBytesPerParcel;

// Slack for a slider that raises N, within 80 bytes a parcel.
std::uint64_t with_slack(std::uint32_t num_parcels) {
  return in_equal_parts(num_parcels + num_parcels / 60ULL);
}

template <class T>
DeviceBuffer<T> upload(const T* values, std::size_t count, cudaStream_t stream) {
  DeviceBuffer<T> buffer(count);
  PF_CUDA(cudaMemcpyAsync(buffer.data(), values, count * sizeof(T), cudaMemcpyHostToDevice, stream));
  return buffer;
}

}  // namespace

std::unique_ptr<Backend> make_cuda_backend(int device) {
  const std::string obstacle = cuda_device_obstacle(device);
  if (!obstacle.empty()) throw DeviceError(obstacle);
  return std::make_unique<CudaBackend>(device);
}

CudaBackend::CudaBackend(int device) {
  cudaDeviceProp properties{};
  PF_CUDA(cudaSetDevice(device));
  PF_CUDA(cudaGetDeviceProperties(&properties, device));
  device_name_ = properties.name;
  const std::uint32_t num_used = usable_multiprocessors();
  if (num_used < static_cast<std::uint32_t>(properties.multiProcessorCount))
    device_name_ += fmt::format(" (limited to {} multiprocessors)", num_used);
  stream_ = work_stream();
  write_state({});
}

CudaBackend::~CudaBackend() { cudaStreamSynchronize(stream_); }

void CudaBackend::write_state(const StepState& state) {
  *host_state_ = state;
  PF_CUDA(
      cudaMemcpyAsync(state_.data(), host_state_.get(), sizeof(StepState), cudaMemcpyHostToDevice, stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
}

StepState CudaBackend::read_state() {
  PF_CUDA(
      cudaMemcpyAsync(host_state_.get(), state_.data(), sizeof(StepState), cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
  return *host_state_;
}

// Keeps the arrays if they are large enough and not wasteful. Throws UserError before anything is freed.
void CudaBackend::make_room(std::uint32_t num_parcels) {
  if (num_parcels <= capacity_ && (capacity_ < 65536 || num_parcels > capacity_ / 4)) return;
  const std::uint64_t wanted = with_slack(num_parcels);
  const double needed = kBytesPerParcel * static_cast<double>(wanted);
  const double available = static_cast<double>(usable_memory_bytes() + memory_bytes());
  if (needed > kUsableShare * available) {
    throw UserError(fmt::format(
        "air.num_parcels: {} parcels need {:.2f} GB of GPU memory, {:.2f} GB are free on {}; at most about "
        "{:.0f} fit",
        num_parcels, needed * 1e-9, available * 1e-9, device_name_,
        num_parcels * kUsableShare * available / needed));
  }
  const auto capacity = static_cast<std::uint32_t>(wanted);
  current_ = {};
  next_ = {};
  cell_sort_ = {};
  contact_memory_ = {};
  exact_memory_ = {};
  draw_position_ = {};
  draw_speed_ = {};
  capacity_ = 0;
  current_ = DeviceParcels(capacity);
  next_ = DeviceParcels(capacity);
  cell_sort_ = DeviceCellSort(capacity);
  capacity_ = capacity;
}

void CudaBackend::reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) {
  PF_CUDA(cudaStreamSynchronize(stream_));
  make_room(plan.num_parcels);
  physics_ = physics;
  num_parcels_ = plan.num_parcels;
  if (num_parcels_ > 0) {
    const auto row_start = upload(plan.row_start, plan.num_rows + 1, stream_);
    const auto first = upload(plan.row_blocked_first, plan.num_rows, stream_);
    const auto count = upload(plan.row_blocked_count, plan.num_rows, stream_);
    SpawnPlan on_device = plan;
    on_device.row_start = row_start.data();
    on_device.row_blocked_first = first.data();
    on_device.row_blocked_count = count.data();
    launch_spawn(on_device, plan.row_start[plan.num_rows], current_.pointers(), stream_);
    clear_heated();
    PF_CUDA(cudaStreamSynchronize(stream_));
  }
  StepState state;
  state.ball = ball;
  write_state(state);
  sorted_ = false;
  exact_.reset_time();
}

void CudaBackend::set_physics(const Physics& physics) {
  if (!keeps_trajectories(physics_, physics)) stop_exact();
  // Walls are a radius away: a parcel that is now beyond its limit moves farther than any step would.
  if (physics.parcels.radius_m != physics_.parcels.radius_m) sorted_ = false;
  // `exact` keeps bounds on speeds by regions since the sort where there is a ball.
  if (physics.ball.exists != physics_.ball.exists) sorted_ = false;
  physics_ = physics;
}

void CudaBackend::set_ball(const BallState& ball) {
  ball_was_set_ = true;
  StepState state = read_state();
  state.ball = ball;
  write_state(state);
}

void CudaBackend::restore(const ParcelSnapshot& snapshot) {
  const auto n = static_cast<std::uint32_t>(snapshot.position.size());
  make_room(n);
  exact_.leave();
  num_parcels_ = n;
  PF_CUDA(cudaMemcpyAsync(current_.position.data(), snapshot.position.data(), n * sizeof(Vec2i),
                          cudaMemcpyHostToDevice, stream_));
  PF_CUDA(cudaMemcpyAsync(current_.velocity.data(), snapshot.velocity.data(), n * sizeof(Vec2f),
                          cudaMemcpyHostToDevice, stream_));
  launch_number(current_.id.data(), n, stream_);
  clear_heated();
  std::vector<std::uint32_t> words;  // lives until read_state() has waited for its copy
  if (!snapshot.heated.empty()) {
    words.resize(DeviceParcels::num_words(n));
    for (const std::uint32_t id : snapshot.heated) words[id / 32] |= 1U << (id % 32);
    PF_CUDA(cudaMemcpyAsync(current_.heated.data(), words.data(), words.size() * sizeof(std::uint32_t),
                            cudaMemcpyHostToDevice, stream_));
  }
  StepState state = read_state();
  state.step = snapshot.step;
  write_state(state);
  sorted_ = false;
}

void CudaBackend::clear_heated() {
  if (capacity_ > 0) PF_CUDA(cudaMemsetAsync(current_.heated.data(), 0, current_.heated.bytes(), stream_));
}

DrawBuffers CudaBackend::device_draw_buffers(const DrawBuffers& wanted) {
  if (wanted.on_device) return wanted;
  if (draw_position_.capacity() < num_parcels_) {
    draw_position_ = DeviceBuffer<Vec2f>(capacity_);
    draw_speed_ = DeviceBuffer<float>(capacity_);
  }
  return {draw_position_.data(), draw_speed_.data(), num_parcels_, true};
}

void CudaBackend::copy_to_host(const DrawBuffers& from, const DrawBuffers& to) {
  if (to.on_device) return;
  PF_CUDA(cudaMemcpyAsync(to.position_m, from.position_m, num_parcels_ * sizeof(Vec2f),
                          cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaMemcpyAsync(to.speed_mps, from.speed_mps, num_parcels_ * sizeof(float), cudaMemcpyDeviceToHost,
                          stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));  // the reader of host memory does not wait for the stream
}

void CudaBackend::draw(const DrawBuffers& buffers) {
  const DrawBuffers on_device = device_draw_buffers(buffers);
  launch_draw(physics_.world, current_parcels(), num_parcels_, on_device, stream_);
  copy_to_host(on_device, buffers);
}

ParcelSnapshot CudaBackend::snapshot() {
  ParcelSnapshot snapshot;
  take_snapshot(snapshot);
  return snapshot;
}

// Uses the memory of `to` again.
void CudaBackend::take_snapshot(ParcelSnapshot& to) {
  to.position.resize(num_parcels_);
  to.velocity.resize(num_parcels_);
  to.heated.clear();
  to.step = read_state().step;
  if (num_parcels_ == 0) return;
  const DeviceBuffer<Vec2i> position(num_parcels_);
  const DeviceBuffer<Vec2f> velocity(num_parcels_);
  launch_scatter_by_id(current_parcels(), num_parcels_, position.data(), velocity.data(), stream_);
  PF_CUDA(cudaMemcpyAsync(to.position.data(), position.data(), num_parcels_ * sizeof(Vec2i),
                          cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaMemcpyAsync(to.velocity.data(), velocity.data(), num_parcels_ * sizeof(Vec2f),
                          cudaMemcpyDeviceToHost, stream_));
  list_heated(to.heated);
}

// Waits for the stream. Mostly no parcel is heated.
void CudaBackend::list_heated(std::vector<std::uint32_t>& to) {
  const std::vector<std::uint32_t> words =
      download(current_.heated, DeviceParcels::num_words(num_parcels_), stream_);
  if (std::ranges::all_of(words, [](std::uint32_t word) { return word == 0; })) return;
  const std::vector<std::uint32_t> id = download(current_.id, num_parcels_, stream_);
  for (std::uint32_t i = 0; i < num_parcels_; ++i) {
    if ((words[i / 32] >> (i % 32) & 1U) != 0) to.push_back(id[i]);
  }
  std::ranges::sort(to);
}

ParcelSums CudaBackend::sums() const {
  return sum_parcels(current_parcels(), num_parcels_, physics_.parcels.mass_kg, stream_);
}

Measures CudaBackend::measure() {
  Measures total = sums().measures;
  add_ball(physics_.ball, read_state().ball, total);
  return total;
}

Profile CudaBackend::profile(const ProfileShape& shape) {
  Profile profile = empty_profile(shape);
  add_parcels(profile, current_parcels(), num_parcels_, stream_);
  return profile;
}

std::uint64_t CudaBackend::state_hash() {
  const std::uint64_t of_ball = physics_.ball.exists ? ball_hash(read_state().ball) : 0;
  return of_ball + sums().hash;
}

std::uint64_t CudaBackend::memory_bytes() const {
  if (capacity_ == 0) return 0;
  return current_.bytes() + next_.bytes() + cell_sort_.bytes() + contact_memory_.bytes() +
         exact_memory_.bytes() + draw_position_.bytes() + draw_speed_.bytes();
}

double CudaBackend::min_bytes_moved(const StepTotals& totals) const {
  constexpr double kStep = 2.0 * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(std::uint32_t);
  const double n = num_parcels_;
  // A step that sorts writes ids, too; a sort of its own also moves the parcels. As in the last request.
  const double per_parcel = submitted_.num_sorts_in_steps > 0
                                ? sizeof(std::uint32_t)
                                : kStep + sizeof(std::uint32_t) + DeviceCellSort::kMinBytesOfKeys;
  const double per_sort = n * per_parcel + DeviceCellSort::kMinBytesPerCell * grid_.num_cells();
  return static_cast<double>(totals.num_steps) * n * kStep + static_cast<double>(totals.num_sorts) * per_sort;
}

double CudaBackend::measure_copy_bandwidth(std::size_t num_bytes) {
  return measure_device_copy(num_bytes, stream_);
}

}  // namespace pf
