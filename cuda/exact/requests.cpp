// Method `exact` on the CUDA backend: what the host launches.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nvtx3/nvtx3.hpp>

#include "cuda/cuda_backend.cuh"
#include "cuda/cuda_devices.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// As for the time-stepped methods, in contact distances; measured on an H200, see docs/exact.md.
constexpr double kCellWidth = 2.5;
constexpr double kWidestReach = 3.0;
// Within a request parcels may become faster than they were when it was submitted: what they travel, position
// units, must stay far below kLongestReach, or steps become as short as a tick.
constexpr double kFarthest = kMaxReach / 64.0;
constexpr std::uint32_t kMaxStepsUnsorted = 64;  // where a ball may hit them

}  // namespace

// Where the parcels are: anchors of lines in method exact, else their positions.
ParcelPointers CudaBackend::present_parcels() const {
  ParcelPointers parcels = current_.pointers();
  if (exact_.active()) {
    parcels.position =
        host_exact_->current_buffer == 0 ? next_.position.data() : reinterpret_cast<Vec2i*>(next_.velocity.data());
  }
  return parcels;
}

void CudaBackend::make_room_for_exact(bool with_clock) {
  const bool has_ticks = current_.tick.capacity() == capacity_;
  const bool has_clocks = !with_clock || current_.last_contact_tick.capacity() == capacity_;
  if (!has_ticks || !has_clocks || num_parcels_ != exact_.reserved()) {
    const auto free_bytes = static_cast<double>(usable_memory_bytes());
    const double needed = (ExactMemory::kBytesPerParcel + (with_clock ? 8.0 : 0.0)) * capacity_;
    if (needed > 0.95 * free_bytes) {
      throw UserError(fmt::format(
          "run.method: exact needs {:.2f} GB more GPU memory for {} parcels, {:.2f} GB are free on {}",
          needed * 1e-9, num_parcels_, free_bytes * 1e-9, device_name_));
    }
  }
  for (Parcels* parcels : {&current_, &next_}) {
    if (parcels->tick.capacity() != capacity_) parcels->tick = DeviceBuffer<std::uint32_t>(capacity_);
    if (with_clock && parcels->last_contact_tick.capacity() != capacity_)
      parcels->last_contact_tick = DeviceBuffer<std::uint32_t>(capacity_);
    if (!with_clock) parcels->last_contact_tick = {};
  }
  exact_.reserve(num_parcels_);
}

ExactLaunch CudaBackend::plan_exact(const StepRequest& request) const {
  ExactLaunch launch;
  launch.run = make_run_constants(physics_, request.contact_clock_s);
  launch.space = {physics_.world, grid_, cell_sort_.cell_start(), num_parcels_,
                  request.neighbors == Neighbors::all_pairs || needs_all_pairs(launch.run)};
  launch.step_state = state_.data();
  launch.slots = slots_.data();
  exact_.complete({current_.pointers(),
                   next_.pointers(),
                   {cell_sort_.scratch(0), cell_sort_.scratch(1), cell_sort_.scratch(2)}},
                  launch);
  return launch;
}

// What another method, or a larger radius, left overlapping is pushed apart first, as the CPU backend does
// it.
void CudaBackend::push_out(const StepRequest& request) {
  constexpr int kMaxSweeps = 50;
  const StepConstants constants = make_step_constants(physics_, 0.0, 0.0);
  const auto enough = static_cast<float>(kRoundingMargin / constants.contact_distance);
  const StepState before = read_state();
  float overlap = 0.0F;
  int sweeps = 0;
  do {
    StepLaunch launch = plan_launch(constants, request);
    launch.method = Method::exact;
    timer_.begin(stream_);
    sort(constants);
    launch_begin_request(constants, state_.data(), slots_.data(), stream_);
    step(launch, false);
    overlap = read_state().totals.max_overlap;
  } while (overlap > enough && ++sweeps < kMaxSweeps);
  StepState after = read_state();
  after.step = before.step;
  after.ball = before.ball;
  write_state(after);
}

void CudaBackend::start_exact(const StepRequest& request) {
  if (physics_.parcels.contacts && num_parcels_ > 0) push_out(request);
  make_room_for_exact(request.contact_clock_s > 0.0);
  exact_.enter(plan_exact(request), stream_);
  read_exact_state();
  expected_displacement_ = 0;
  sorted_ = false;
  keys_are_written_ = false;
}

void CudaBackend::stop_exact() {
  if (!exact_.active()) return;
  StepRequest request;
  request.method = Method::exact;
  launch_exact_copy_positions(plan_exact(request), current_.position.data(), stream_);
  PF_CUDA(cudaStreamSynchronize(stream_));
  exact_.forget();
  sorted_ = false;
  keys_are_written_ = false;
}

void CudaBackend::sort_exact(ExactLaunch& launch) {
  const double contact = launch.run.contact_distance;
  grid_ = choose_grid(physics_.world, num_parcels_, kCellWidth * contact, kDeviceCellsPerParcel);
  launch.space.grid = grid_;
  timer_.mark_sort(stream_);
  {
    const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::sort)]);
    launch_exact_write_keys(launch, cell_sort_.keys_to_write(), stream_);
    cell_sort_.sort_keys(grid_, num_parcels_, stream_);
  }
  timer_.mark_sort(stream_);
  {
    const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::grid)]);
    cell_sort_.gather(grid_, current_.pointers(), next_.pointers(), num_parcels_, stream_);
    std::swap(current_, next_);
    exact_.complete({current_.pointers(),
                     next_.pointers(),
                     {cell_sort_.scratch(0), cell_sort_.scratch(1), cell_sort_.scratch(2)}},
                    launch);
    launch_exact_locate(launch, stream_);
  }
  timer_.mark_sort(stream_);
  expected_displacement_ = 0;
  sorted_ = true;
}

const ExactState& CudaBackend::read_exact_state() {
  PF_CUDA(cudaMemcpyAsync(host_exact_.get(), exact_.state(), sizeof(ExactState), cudaMemcpyDeviceToHost,
                          stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
  return *host_exact_;
}

void CudaBackend::submit_exact(const StepRequest& request) {
  if (exact_.active() && (request.contact_clock_s > 0.0) != (current_.last_contact_tick.capacity() > 0)) stop_exact();
  if (!exact_.active()) start_exact(request);
  ExactLaunch launch = plan_exact(request);
  const RunConstants& run = launch.run;
  const TickScale& ticks = run.reference_ticks;
  const bool search = physics_.parcels.contacts && !needs_all_pairs(run) && num_parcels_ > 0;
  const std::vector<std::uint64_t> ends = exact_.plan(request, ticks.tick_s);
  const DrawBuffers draw = request.draw ? device_draw_buffers(*request.draw) : DrawBuffers{};
  submitted_ = {request.num_steps, 0, true, run.per_impulse_count, run.impulse_unit_kg_mps};
  const double moved = host_exact_->progress.fastest_mps * ticks.units_per_tick * request.dt_s / ticks.tick_s;
  launch.ball_was_set = ball_was_set_;
  ball_was_set_ = false;

  timer_.begin(stream_);
  launch.until = ends.empty() ? 0 : ends.front();
  launch_exact_begin_request(launch, stream_);
  // Parcels that move too far in a step are sorted again on the way; the host waits for that then.
  const double widest = (kWidestReach - 1.0) * run.contact_distance;
  const bool sorts_within = search && 2.0 * moved > widest;
  const double farthest = std::min(sorts_within ? 0.5 * widest : widest - 2.0 * moved, kFarthest);
  if (sorts_within) launch.farthest = static_cast<std::int64_t>(farthest);
  for (std::size_t k = 0; k < ends.size(); ++k) {
    launch.until = ends[k];
    launch.next_until = k + 1 < ends.size() ? ends[k + 1] : 0;
    launch.draw = k + 1 < ends.size() ? DrawBuffers{} : draw;
    do {
      const bool moved_far = expected_displacement_ > 0 && static_cast<double>(expected_displacement_) > farthest;
      const bool hit_often = physics_.ball.exists && steps_since_sort_ >= kMaxStepsUnsorted;
      if (search && (!sorted_ || moved_far || hit_often)) {
        sort_exact(launch);
        steps_since_sort_ = 0;
        ++submitted_.num_sorts;
      }
      const nvtx3::scoped_range range(kPhaseNames[static_cast<int>(Phase::collide_integrate)]);
      launch_exact_step(launch, stream_);
      ++steps_since_sort_;
      expected_displacement_ += static_cast<std::int64_t>(moved) + 3;
      if (sorts_within) expected_displacement_ = read_exact_state().progress.max_displacement;
    } while (sorts_within && host_exact_->progress.now < ends[k] && host_exact_->unresolvable == 0);
  }
  if (request.draw) {
    if (ends.empty()) launch_draw(physics_.world, present_parcels(), num_parcels_, draw, stream_);
    copy_to_host(draw, *request.draw);
  }
  PF_CUDA(
      cudaMemcpyAsync(host_state_.get(), state_.data(), sizeof(StepState), cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaMemcpyAsync(host_exact_.get(), exact_.state(), sizeof(ExactState), cudaMemcpyDeviceToHost,
                          stream_));
  timer_.end(stream_);
}

}  // namespace pf
