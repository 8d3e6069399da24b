// Requests of the time-stepped methods: what the host launches, and what it collects of any method.
#include <cmath>
#include <nvtx3/nvtx3.hpp>

#include "backend/exact/limits.hpp"
#include "cuda/cuda_backend.cuh"
#include "model/exact/trajectory.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// Width of the cells, and how far the search box may grow before parcels are sorted again, in contact
// distances. Measured on an H200, area fraction 0.2, ns per parcel-step at 10^7: width 1.4 and reach 2.0
// 0.057, 2.0 and 2.5 0.052, 2.5 and 2.5 0.051, 3.0 and 2.5 0.053.
constexpr double kCellWidth = 2.5;
constexpr double kLargestReach = 2.5;

}  // namespace

// Due when the search box would grow too wide. The travel within a request is the last step's, times 1.1; it
// decides about speed only, since the kernel searches as far as parcels have really moved.
bool CudaBackend::sort_is_due(const StepConstants& constants) const {
  return !sorted_ || static_cast<double>(constants.contact_reach + expected_displacement_) >
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
  PF_CUDA(cudaMemsetAsync(&state_.data()->max_displacement, 0, sizeof(StepState::max_displacement), stream_));
  expected_displacement_ = 0;
  sorted_ = true;
}

void CudaBackend::submit(const StepRequest& request) {
  if (request.method == Method::exact) return submit_exact(request);
  stop_exact();
  const StepConstants constants = make_step_constants(physics_, request.dt_s, request.spring_contact_s);
  const bool search = physics_.parcels.contacts && request.neighbors == Neighbors::grid && num_parcels_ > 0;
  const auto estimate =
      static_cast<std::int64_t>(4.5 * constants.advance_scale * 0x1p-32 * physics_.parcels.speed_mps);
  const std::int64_t travel_per_step =
      host_state_->last_displacement > 0 ? host_state_->last_displacement + host_state_->last_displacement / 10 : estimate;
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
    expected_displacement_ += travel_per_step;
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
  if (submitted_.exact && host_exact_->unresolvable != 0)
    throw_unresolvable(tick_seconds(physics_.world, physics_.reference_speed_mps));
  const StepState& state = *host_state_;
  expected_displacement_ = submitted_.exact ? host_exact_->progress.max_displacement : state.max_displacement;
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
    report.totals.num_retried_steps = host_exact_->num_retried;
    report.totals.event_hash = host_exact_->event_hash;
  }
  report.totals.ball_impulse_kg_mps =
      Vec2d{static_cast<double>(sum.ball_x), static_cast<double>(sum.ball_y)} *
      submitted_.impulse_unit_kg_mps;
  report.totals.ball_torque_impulse_kg_m2ps =
      static_cast<double>(sum.ball_torque) * submitted_.impulse_unit_kg_mps * physics_.ball.radius_m;
  return report;
}

}  // namespace pf
