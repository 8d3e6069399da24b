#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nvtx3/nvtx3.hpp>
#include <tuple>

#include "cuda_backend.cuh"
#include "model/step.hpp"
#include "work_stream.hpp"

namespace pf {
namespace {

// Width of the cells, and how far the search box may grow before parcels are sorted again, in contact
// distances. Measured on an H200, area fraction 0.2, ns per parcel-step at 10^7: width 1.4 and reach 2.0
// 0.057, 2.0 and 2.5 0.052, 2.5 and 2.5 0.051, 3.0 and 2.5 0.053.
constexpr double kCellWidth = 2.5;
constexpr double kLargestReach = 2.5;

// State twice, and what is drawn.
constexpr double kBytesPerParcel =
    2 * (sizeof(Vec2i) + sizeof(Vec2f) + sizeof(std::uint32_t)) + sizeof(Vec2f) + sizeof(float);

// Slack for a slider that grows N, without going over 80 bytes a parcel.
std::uint64_t with_slack(std::uint32_t num_parcels) { return num_parcels + num_parcels / 40ULL; }

template <class T>
DeviceBuffer<T> upload(const T* values, std::size_t count, cudaStream_t stream) {
  DeviceBuffer<T> buffer(count);
  PF_CUDA(cudaMemcpyAsync(buffer.data(), values, count * sizeof(T), cudaMemcpyHostToDevice, stream));
  return buffer;
}

float elapsed_ms(cudaEvent_t from, cudaEvent_t to) {
  float ms = 0.0F;
  PF_CUDA(cudaEventElapsedTime(&ms, from, to));
  return ms;
}

}  // namespace

int num_cuda_devices(std::string* why) {
  int count = 0;
  const cudaError_t result = cudaGetDeviceCount(&count);
  if (result == cudaSuccess) return count;
  cudaGetLastError();
  if (why) *why = cudaGetErrorString(result);
  return 0;
}

std::unique_ptr<Backend> make_cuda_backend(int device) {
  PF_CUDA(cudaSetDevice(device));
  return std::make_unique<CudaBackend>(device);
}

RequestTimer::RequestTimer() : sort_marks_(3 * kMaxSorts) {
  PF_CUDA(cudaEventCreate(&begin_));
  PF_CUDA(cudaEventCreate(&end_));
  for (cudaEvent_t& event : sort_marks_) PF_CUDA(cudaEventCreate(&event));
  for (cudaEvent_t& event : ball_marks_) PF_CUDA(cudaEventCreate(&event));
}

RequestTimer::~RequestTimer() {
  cudaEventDestroy(begin_);
  cudaEventDestroy(end_);
  for (cudaEvent_t event : sort_marks_) cudaEventDestroy(event);
  for (cudaEvent_t event : ball_marks_) cudaEventDestroy(event);
}

void RequestTimer::begin(cudaStream_t stream) {
  num_sort_marks_ = 0;
  num_ball_marks_ = 0;
  PF_CUDA(cudaEventRecord(begin_, stream));
}

void RequestTimer::mark_sort(cudaStream_t stream) {
  if (num_sort_marks_ < sort_marks_.size()) PF_CUDA(cudaEventRecord(sort_marks_[num_sort_marks_++], stream));
}

void RequestTimer::mark_ball(cudaStream_t stream) {
  if (num_ball_marks_ < 2) PF_CUDA(cudaEventRecord(ball_marks_[num_ball_marks_++], stream));
}

void RequestTimer::end(cudaStream_t stream) { PF_CUDA(cudaEventRecord(end_, stream)); }

PhaseTimes RequestTimer::times(std::uint32_t num_steps) {
  PF_CUDA(cudaEventSynchronize(end_));
  PhaseTimes times;
  for (std::size_t k = 0; k + 2 < num_sort_marks_; k += 3) {
    times[Phase::sort] += elapsed_ms(sort_marks_[k], sort_marks_[k + 1]);
    times[Phase::grid] += elapsed_ms(sort_marks_[k + 1], sort_marks_[k + 2]);
  }
  if (num_ball_marks_ == 2) times[Phase::ball] = elapsed_ms(ball_marks_[0], ball_marks_[1]) * num_steps;
  times[Phase::collide_integrate] = std::max(0.0, elapsed_ms(begin_, end_) - times.total());
  return times;
}

CudaBackend::CudaBackend(int device) {
  cudaDeviceProp properties{};
  PF_CUDA(cudaGetDeviceProperties(&properties, device));
  device_name_ = properties.name;
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

// Keeps what is there if it is enough and not wasteful; says what is missing before anything is allocated.
void CudaBackend::make_room(std::uint32_t num_parcels) {
  if (num_parcels <= capacity_ && (capacity_ < 65536 || num_parcels > capacity_ / 4)) return;
  std::size_t free_bytes = 0, total = 0;
  PF_CUDA(cudaMemGetInfo(&free_bytes, &total));
  const std::uint64_t wanted = with_slack(num_parcels);
  const double needed = (kBytesPerParcel + DeviceCellSort::kBytesPerParcel) * static_cast<double>(wanted);
  const double available = static_cast<double>(free_bytes) + static_cast<double>(memory_bytes());
  if (needed > 0.95 * available) {
    throw UserError(fmt::format(
        "air.num_parcels: {} parcels need {:.2f} GB of GPU memory, {:.2f} GB are free on {}; at most about "
        "{:.0f} fit",
        num_parcels, needed * 1e-9, available * 1e-9, device_name_, num_parcels * 0.95 * available / needed));
  }
  const auto capacity = static_cast<std::uint32_t>(wanted);
  current_ = {};
  next_ = {};
  cell_sort_ = {};
  draw_position_ = {};
  draw_speed_ = {};
  capacity_ = 0;
  for (Parcels* parcels : {&current_, &next_}) {
    parcels->position = DeviceBuffer<Vec2i>(capacity);
    parcels->velocity = DeviceBuffer<Vec2f>(capacity);
    parcels->id = DeviceBuffer<std::uint32_t>(capacity);
  }
  cell_sort_ = DeviceCellSort(capacity);
  capacity_ = capacity;
}

void CudaBackend::reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) {
  PF_CUDA(cudaStreamSynchronize(stream_));
  make_room(plan.num_parcels);
  physics_ = physics;
  num_parcels_ = plan.num_parcels;
  if (num_parcels_ > 0) {
    const auto row_begin = upload(plan.row_begin, plan.num_rows + 1, stream_);
    const auto first = upload(plan.row_blocked_first, plan.num_rows, stream_);
    const auto count = upload(plan.row_blocked_count, plan.num_rows, stream_);
    SpawnPlan on_device = plan;
    on_device.row_begin = row_begin.data();
    on_device.row_blocked_first = first.data();
    on_device.row_blocked_count = count.data();
    launch_spawn(on_device, plan.row_begin[plan.num_rows], current_.pointers(), stream_);
    PF_CUDA(cudaStreamSynchronize(stream_));
  }
  StepState state;
  state.ball = ball;
  write_state(state);
  sorted_ = false;
  keys_are_written_ = false;
  exact_.reset_time();
  host_exact_->last_travel = 0;
}

void CudaBackend::set_physics(const Physics& physics) {
  const auto lines_are_of = [](const Physics& p) {
    return std::tuple(p.parcels.radius_m, p.parcels.contacts, p.reference_speed_mps);
  };
  if (lines_are_of(physics) != lines_are_of(physics_)) stop_exact();
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
  exact_.forget();
  num_parcels_ = n;
  PF_CUDA(cudaMemcpyAsync(current_.position.data(), snapshot.position.data(), n * sizeof(Vec2i),
                          cudaMemcpyHostToDevice, stream_));
  PF_CUDA(cudaMemcpyAsync(current_.velocity.data(), snapshot.velocity.data(), n * sizeof(Vec2f),
                          cudaMemcpyHostToDevice, stream_));
  launch_number(current_.id.data(), n, stream_);
  StepState state = read_state();
  state.step = snapshot.step;
  write_state(state);
  sorted_ = false;
  keys_are_written_ = false;
}

// Due when the search box would grow too wide. The travel within a request is the last step's, times 1.1; it
// decides about speed only, since the kernel searches as far as parcels have really moved.
bool CudaBackend::sort_is_due(const StepConstants& constants) const {
  return !sorted_ || static_cast<double>(constants.contact_reach + expected_travel_) >
                         kLargestReach * constants.contact_distance;
}

void CudaBackend::sort(const StepConstants& constants) {
  const GridShape grid = choose_grid(physics_.world, num_parcels_, kCellWidth * constants.contact_distance,
                                     kDeviceCellsPerParcel);
  timer_.mark_sort(stream_);
  {
    const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::sort)]);
    if (!keys_are_written_ || !(grid == grid_)) {
      cell_sort_.write_keys(grid, current_.position.data(), num_parcels_, stream_);
    }
    cell_sort_.sort_keys(grid, num_parcels_, stream_);
  }
  timer_.mark_sort(stream_);
  {
    const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::grid)]);
    cell_sort_.gather(grid, current_.pointers(), next_.pointers(), num_parcels_, stream_);
  }
  timer_.mark_sort(stream_);
  grid_ = grid;
  std::swap(current_, next_);
  keys_are_written_ = false;
  PF_CUDA(cudaMemsetAsync(&state_.data()->travel, 0, sizeof(StepState::travel), stream_));
  expected_travel_ = 0;
  sorted_ = true;
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
  PF_CUDA(cudaStreamSynchronize(stream_));  // what draws from host memory knows nothing of the stream
}

void CudaBackend::submit(const StepRequest& request) {
  if (request.method == Method::exact) return submit_exact(request);
  stop_exact();
  const StepConstants constants = make_step_constants(physics_, request.dt_s, request.spring_contact_s);
  const bool search = physics_.parcels.contacts && request.neighbors == Neighbors::grid && num_parcels_ > 0;
  const auto estimate =
      static_cast<std::int64_t>(4.5 * constants.advance_scale * 0x1p-32 * physics_.parcels.speed_mps);
  const std::int64_t travel_per_step =
      host_state_->last_travel > 0 ? host_state_->last_travel + host_state_->last_travel / 10 : estimate;
  const DrawBuffers draw = request.draw ? device_draw_buffers(*request.draw) : DrawBuffers{};
  StepLaunch launch = plan_launch(constants, request);
  submitted_ = {request.num_steps, 0, false, constants.per_impulse_count, constants.impulse_unit_kg_mps};

  timer_.begin(stream_);
  launch_begin_request(constants, state_.data(), slots_.data(), stream_);
  for (std::uint32_t k = 0; k < request.num_steps; ++k) {
    if (search && sort_is_due(constants)) {
      sort(constants);
      ++submitted_.num_sorts;
    }
    expected_travel_ += travel_per_step;
    if (k + 1 == request.num_steps) launch.draw = draw;
    step(launch, search && sort_is_due(constants));
  }
  if (request.draw) copy_to_host(draw, *request.draw);
  PF_CUDA(
      cudaMemcpyAsync(host_state_.get(), state_.data(), sizeof(StepState), cudaMemcpyDeviceToHost, stream_));
  timer_.end(stream_);
}

StepLaunch CudaBackend::plan_launch(const StepConstants& constants, const StepRequest& request) const {
  StepLaunch launch;
  launch.constants = constants;
  launch.space = {physics_.world, grid_, cell_sort_.cell_start(), num_parcels_,
                  request.neighbors == Neighbors::all_pairs};
  launch.state = state_.data();
  launch.slots = slots_.data();
  launch.method = request.method;
  return launch;
}

// One step and the ball's; the step also writes the keys of the sort that is due after it.
void CudaBackend::step(StepLaunch& launch, bool sort_follows) {
  launch.space.grid = grid_;
  launch.from = current_.pointers();
  launch.to = next_.pointers();
  launch.keys = sort_follows ? cell_sort_.keys_to_write() : SortKeys{};
  {
    const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::collide_integrate)]);
    launch_step(launch, stream_);
  }
  {
    const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::ball)]);
    timer_.mark_ball(stream_);
    launch_ball(launch.constants, state_.data(), slots_.data(), stream_);
    timer_.mark_ball(stream_);
  }
  std::swap(current_.position, next_.position);
  std::swap(current_.velocity, next_.velocity);
  keys_are_written_ = sort_follows;
}

StepReport CudaBackend::collect() {
  StepReport report;
  report.times = timer_.times(submitted_.num_steps);  // waits
  const StepState& state = *host_state_;
  expected_travel_ = submitted_.exact ? host_exact_->progress.travel : state.travel;
  const RequestTotals& sum = state.totals;
  report.ball = state.ball;
  report.totals.num_steps = submitted_.num_steps;
  report.totals.num_collisions = sum.num_collisions;
  report.totals.num_ball_hits = sum.num_hits;
  report.totals.num_retired = sum.num_retired;
  report.totals.num_invalid = sum.num_invalid;
  report.totals.first_invalid_step = sum.first_invalid_step;
  report.totals.first_invalid_id = sum.num_invalid > 0 ? sum.first_invalid_id : UINT32_MAX;
  report.totals.impulse_sum_mps = static_cast<double>(sum.impulse_sum) / submitted_.per_impulse_count;
  report.totals.max_overlap_diameters = static_cast<double>(sum.max_overlap);
  report.totals.max_speed_mps = std::sqrt(static_cast<double>(sum.max_speed2));
  report.totals.num_sorts = submitted_.num_sorts;
  if (submitted_.exact) {
    report.totals.num_rounds = host_exact_->num_rounds;
    report.totals.num_redone_steps = host_exact_->num_redone;
    report.totals.event_hash = host_exact_->event_hash;
  }
  report.totals.ball_impulse_kg_mps =
      Vec2d{static_cast<double>(sum.ball_x), static_cast<double>(sum.ball_y)} *
      submitted_.impulse_unit_kg_mps;
  report.totals.ball_torque_impulse_kg_m2ps =
      static_cast<double>(sum.ball_torque) * submitted_.impulse_unit_kg_mps * physics_.ball.radius_m;
  return report;
}

void CudaBackend::draw(const DrawBuffers& buffers) {
  const DrawBuffers on_device = device_draw_buffers(buffers);
  launch_draw(physics_.world, present_parcels(), num_parcels_, on_device, stream_);
  copy_to_host(on_device, buffers);
}

ParcelSnapshot CudaBackend::snapshot() {
  ParcelSnapshot snapshot{std::vector<Vec2i>(num_parcels_), std::vector<Vec2f>(num_parcels_),
                          read_state().step};
  if (num_parcels_ == 0) return snapshot;
  const DeviceBuffer<Vec2i> position(num_parcels_);
  const DeviceBuffer<Vec2f> velocity(num_parcels_);
  launch_scatter_by_id(present_parcels(), num_parcels_, position.data(), velocity.data(), stream_);
  PF_CUDA(cudaMemcpyAsync(snapshot.position.data(), position.data(), num_parcels_ * sizeof(Vec2i),
                          cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaMemcpyAsync(snapshot.velocity.data(), velocity.data(), num_parcels_ * sizeof(Vec2f),
                          cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
  return snapshot;
}

std::vector<MeasurePart> CudaBackend::measure_parts() {
  std::vector<MeasurePart> parts((num_parcels_ + kMeasureBlock - 1) / kMeasureBlock);
  if (parts.empty()) return parts;
  const DeviceBuffer<MeasurePart> on_device(parts.size());
  launch_measure(present_parcels(), num_parcels_, on_device.data(), stream_);
  PF_CUDA(cudaMemcpyAsync(parts.data(), on_device.data(), parts.size() * sizeof(MeasurePart),
                          cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
  return parts;
}

Measures CudaBackend::measure() {
  Measures total;
  const double mass = physics_.parcels.mass_kg;
  for (const MeasurePart& part : measure_parts()) {
    total.parcel_energy_j += 0.5 * mass * part.speed2;
    total.momentum_kg_mps += Vec2d{part.velocity_x, part.velocity_y} * mass;
    total.momentum_scale_kg_mps += mass * part.speed;
    total.num_live += part.num_live;
  }
  add_ball(physics_.ball, read_state().ball, total);
  return total;
}

std::uint64_t CudaBackend::state_hash() {
  std::uint64_t hash = physics_.ball.present ? ball_hash(read_state().ball) : 0;
  for (const MeasurePart& part : measure_parts()) hash += part.hash;
  return hash;
}

std::uint64_t CudaBackend::memory_bytes() const {
  if (capacity_ == 0) return 0;
  return current_.bytes() + next_.bytes() + cell_sort_.bytes() + exact_.bytes() + draw_position_.bytes() +
         draw_speed_.bytes();
}

double CudaBackend::least_bytes_moved(const StepTotals& totals) const {
  constexpr double kStep = 2.0 * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(std::uint32_t);
  constexpr double kGather = kStep + sizeof(std::uint32_t);  // the same, and the ids written
  const double n = num_parcels_;
  const double per_sort = n * (kGather + cell_sort_.least_bytes_per_parcel(grid_)) + 4.0 * grid_.num_cells();
  return static_cast<double>(totals.num_steps) * n * kStep + static_cast<double>(totals.num_sorts) * per_sort;
}

double CudaBackend::measure_copy_bandwidth(std::size_t num_bytes) {
  constexpr int kRepeats = 10;
  const DeviceBuffer<std::byte> from(num_bytes), to(num_bytes);
  const auto copy = [&] {
    PF_CUDA(cudaMemcpyAsync(to.data(), from.data(), num_bytes, cudaMemcpyDeviceToDevice, stream_));
  };
  copy();
  timer_.begin(stream_);
  for (int repeat = 0; repeat < kRepeats; ++repeat) copy();
  timer_.end(stream_);
  return 2e3 * static_cast<double>(num_bytes) * kRepeats / timer_.times(0).total();
}

}  // namespace pf
