// Requests of method `exact` on the CUDA backend.
#include <fmt/format.h>

#include <algorithm>

#include "cuda/cuda_backend.cuh"
#include "cuda/cuda_devices.hpp"
#include "model/exact/push_out.hpp"

namespace pf {
namespace {

using cuda::ExactLaunch;
using cuda::ExactMemory;
using cuda::ExactState;

// Size of the cells, and widest reach of the search box before a sort pays off, in contact distances. On an
// H200 a gas is 1 to 3 % slower with square cells of 2.5.
constexpr double kCellWidth = 1.5, kCellHeight = 3.5;
constexpr double kWidestReach = 3.0;
// Within a request parcels may become faster than they were when it was submitted. Their displacement since
// the sort, position units, must stay far below kMaxReach, or steps become as short as a tick.
constexpr double kMaxSortDisplacement = kMaxReach / 64.0;
constexpr double kMaxLaunchDisplacement = kMaxReach / 16.0;  // in steps without a sort on their way
constexpr std::uint32_t kMaxStepsUnsorted = 64;              // where a ball may hit parcels
constexpr double kDisplacementRounding = 3.0;                // position units a step

// With a ball the fastest parcel may move this many contact distances in steps that are taken together, and
// since a sort. Median and worst ms of a frame on an H100, flights of the court: 10^6 (whole) 8.6, 13.9, and
// 9.5, 15.0 with one step at a time; 8.8, 14.6 with three times the distance since a sort. 10^7 (105 frames)
// 29.5, 72.8; 38.6, 80.8; 29.3, 74.5.
constexpr double kFarthestWithBall = 3.0, kUnsortedWithBall = 1.0;

// Steps taken together may move the fastest parcel by so much of what search circles may grow by. Gps of a
// gas on an H200, steps of 0.035 d/c, with 2 (in square cells), 3 and 4 at a time: 10^5 1.58, 1.84, 1.93;
// 10^6 6.3, 6.8, 6.3; 10^7 10.8, 11.1, 11.4; 10^8 11.7, 12.1, 12.4. Of a million the longest clusters set the
// time.
double share_of_reach(std::uint32_t num_parcels) {
  return num_parcels >= 300'000 && num_parcels < 4'000'000 ? 0.3 : 0.4;
}

}  // namespace

ParcelPointers CudaBackend::current_parcels() const {
  ParcelPointers parcels = current_.pointers();
  if (exact_.active()) parcels.position = ExactMemory::positions(next_, host_exact_->current_buffer);
  return parcels;
}

void CudaBackend::check_room_for_exact(bool with_contact_ticks) const {
  const auto free_bytes = static_cast<double>(usable_memory_bytes());
  double needed = (ExactMemory::kBytesPerParcel + (with_contact_ticks ? 8.0 : 0.0)) * capacity_;
  needed -= static_cast<double>(exact_memory_.bytes());  // freed before the new ones are allocated
  for (const DeviceParcels* parcels : {&current_, &next_})
    needed -= static_cast<double>(parcels->tick.bytes() + parcels->last_contact_tick.bytes());
  if (needed <= kUsableShare * free_bytes) return;
  throw UserError(fmt::format(
      "run.method: exact needs {:.2f} GB more GPU memory for {} parcels, {:.2f} GB are free on {}; "
      "take another method or fewer parcels (-p)",
      needed * 1e-9, num_parcels_, free_bytes * 1e-9, device_name_));
}

void CudaBackend::make_room_for_exact(bool with_contact_ticks) {
  contact_memory_ = {};
  const bool has_ticks = current_.tick.capacity() == capacity_;
  const bool has_contact_ticks = !with_contact_ticks || current_.last_contact_tick.capacity() == capacity_;
  if (!has_ticks || !has_contact_ticks || !exact_memory_.is_for(num_parcels_, physics_.ball.exists))
    check_room_for_exact(with_contact_ticks);
  for (DeviceParcels* parcels : {&current_, &next_}) {
    if (parcels->tick.capacity() != capacity_) parcels->tick = DeviceBuffer<std::uint32_t>(capacity_);
    if (with_contact_ticks && parcels->last_contact_tick.capacity() != capacity_)
      parcels->last_contact_tick = DeviceBuffer<std::uint32_t>(capacity_);
    if (!with_contact_ticks) parcels->last_contact_tick = {};
  }
  exact_memory_.reserve(num_parcels_, physics_.ball.exists);
}

cuda::StepMemory CudaBackend::lay_out_exact() const {
  return exact_memory_.lay_out(current_, next_, cell_sort_);
}

ExactLaunch CudaBackend::exact_launch(const StepRequest& request) const {
  ExactLaunch launch;
  launch.run = make_run_constants(physics_, request.contact_clock_s);
  launch.space = {physics_.world, grid_, cell_sort_.cell_start(), num_parcels_,
                  request.neighbors == Neighbors::all_pairs || needs_all_pairs(launch.run)};
  launch.memory = lay_out_exact();
  launch.memory.region_speed2 = sorted_ && physics_.ball.exists ? exact_memory_.region_speed2() : nullptr;
  launch.state = exact_memory_.state();
  launch.step_state = state_.data();
  launch.slots = slots_.data();
  return launch;
}

// Overlaps that another method, or a larger radius, left are pushed apart first, as on the CPU backend.
void CudaBackend::push_out(const StepRequest& request) {
  const StepConstants constants = make_step_constants(physics_, 0.0, 0.0);
  const float max_overlap = push_out_tolerance(constants);
  const StepState before = read_state();
  float overlap = 0.0F;
  int num_sweeps = 0;
  do {
    StepLaunch launch = plan_launch(constants, request);
    timer_.begin(stream_);
    sort(constants);
    launch_begin_request(constants, state_.data(), slots_.data(), stream_);
    launch.displaced = displaced_since_sort(launch, true);
    step(launch, launch_push_out);
    end_steps(launch);
    overlap = read_state().totals.max_overlap;
  } while (overlap > max_overlap && ++num_sweeps < kMaxPushOutSweeps);
  StepState after = read_state();
  after.step = before.step;
  after.ball = before.ball;
  after.last_displacement = 0;
  write_state(after);
}

void CudaBackend::start_exact(const StepRequest& request) {
  if (physics_.parcels.contacts && num_parcels_ > 0) push_out(request);
  make_room_for_exact(request.contact_clock_s > 0.0);
  clear_heated();
  exact_.enter(exact_launch(request), stream_);
  read_exact_state();
  expected_displacement_ = 0;
  sorted_ = false;
}

void CudaBackend::stop_exact() {
  if (!exact_.active()) return;
  StepRequest request;
  request.method = Method::exact;
  cuda::launch_copy_positions(exact_launch(request), current_.position.data(), stream_);
  PF_CUDA(cudaStreamSynchronize(stream_));
  exact_.leave();
  sorted_ = false;
}

const ExactState& CudaBackend::read_exact_state() {
  PF_CUDA(cudaMemcpyAsync(host_exact_.get(), exact_memory_.state(), sizeof(ExactState),
                          cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
  return *host_exact_;
}

void CudaBackend::sort_exact(ExactLaunch& launch) {
  const double contact = launch.run.contact_distance;
  grid_ = choose_grid(physics_.world, num_parcels_,
                      {kCellWidth * contact, kDeviceCellsPerParcel, kCellHeight * contact});
  launch.space.grid = grid_;
  timer_.mark_sort(stream_);
  {
    const PhaseRange range(Phase::sort);
    cuda::launch_count(launch, cell_sort_.begin(grid_, stream_), stream_);
    cell_sort_.sum_counts(grid_, stream_);
  }
  timer_.mark_sort(stream_);
  {
    const PhaseRange range(Phase::grid);
    cell_sort_.scatter(current_.pointers(), next_.pointers(), num_parcels_, stream_);
    std::swap(current_, next_);
    launch.memory = lay_out_exact();
    if (physics_.ball.exists) launch.memory.region_speed2 = exact_memory_.start_regions(grid_, stream_);
    cuda::launch_locate(launch, stream_);
  }
  timer_.mark_sort(stream_);
  expected_displacement_ = 0;
  exact_steps_since_sort_ = 0;
  sorted_ = true;
  ++submitted_.num_sorts;
}

// Number of the request's steps to take as one. displacement: of the fastest parcel in one, position units.
std::uint32_t CudaBackend::steps_together(const RunConstants& run, const StepRequest& request,
                                          double displacement) const {
  const ExactProgress& progress = host_exact_->progress;
  const auto limited = [](double num, double max) {  // `max` if num is not a number: nothing moves
    return static_cast<std::uint32_t>(num < max ? std::max(num, 1.0) : max);
  };
  if (physics_.ball.exists)
    return limited(kFarthestWithBall * run.contact_distance / displacement, cuda::kMaxChords);
  if (progress.preferred_ticks == 0.0) return 1;
  const double max = share_of_reach(num_parcels_) * (kWidestReach - 1.0) * run.contact_distance;
  const double ticks_of_step = request.dt_s / scaled(run.reference_ticks, progress.tick_exponent).tick_s;
  return limited(std::min(progress.preferred_ticks / ticks_of_step, max / displacement), 1e6);
}

CudaBackend::ExactRequest CudaBackend::plan_exact(const RunConstants& run, const StepRequest& request) {
  const TickScale& ticks = run.reference_ticks;
  const bool has_ball = physics_.ball.exists;
  ExactRequest plan;
  plan.searches = physics_.parcels.contacts && !needs_all_pairs(run) && num_parcels_ > 0;
  plan.displacement = host_exact_->progress.fastest_mps * ticks.units_per_tick * request.dt_s / ticks.tick_s;
  plan.ends = exact_.plan_ends(request, ticks.tick_s);
  plan.num_together = steps_together(run, request, plan.displacement);
  plan.displacement *= plan.num_together;
  // Parcels that move too far in a step are sorted again on its way; the host then waits for each part of it.
  const double widest = (kWidestReach - 1.0) * run.contact_distance;
  const double farthest =
      std::min(has_ball ? kFarthestWithBall * run.contact_distance : 0.5 * widest, kMaxLaunchDisplacement);
  plan.sorts_within = plan.searches && plan.displacement > farthest;
  const double unsorted = plan.sorts_within ? 0.5 * widest : widest - 2.0 * plan.displacement;
  plan.sort_displacement =
      std::min(has_ball ? kUnsortedWithBall * run.contact_distance : unsorted, kMaxSortDisplacement);
  return plan;
}

bool CudaBackend::exact_sort_is_due(const ExactRequest& plan) const {
  if (!plan.searches) return false;
  const bool moved_far =
      expected_displacement_ > 0 && static_cast<double>(expected_displacement_) > plan.sort_displacement;
  const bool hit_often = physics_.ball.exists && exact_steps_since_sort_ >= kMaxStepsUnsorted;
  return !sorted_ || moved_far || hit_often;
}

void CudaBackend::launch_exact_stages(const ExactLaunch& launch) {
  using LaunchStage = void (*)(const ExactLaunch&, cudaStream_t);
  const auto run_stage = [&](Phase phase, LaunchStage launch_stage) {
    const PhaseRange range(phase);
    launch_stage(launch, stream_);
    timer_.mark_stage(stream_);
  };
  timer_.mark_stage(stream_);
  run_stage(Phase::predict, cuda::launch_predict);
  run_stage(Phase::solve, cuda::launch_solve);
  run_stage(Phase::commit, cuda::launch_commit);
}

// One step to launch.until, with sorts before it and on its way.
void CudaBackend::step_exact(const ExactRequest& plan, ExactLaunch& launch) {
  do {
    if (exact_sort_is_due(plan)) sort_exact(launch);
    launch_exact_stages(launch);
    ++exact_steps_since_sort_;
    expected_displacement_ += static_cast<std::int64_t>(plan.displacement + kDisplacementRounding);
    if (plan.sorts_within) expected_displacement_ = read_exact_state().progress.max_displacement;
  } while (plan.sorts_within && host_exact_->progress.now < launch.until && host_exact_->unresolvable == 0 &&
           host_exact_->paused == 0);
}

// The launch takes the requested steps from the first on that are taken together.
void CudaBackend::set_ends(const ExactRequest& plan, std::size_t first, ExactLaunch& launch) {
  const auto& ends = plan.ends;
  const std::size_t next = std::min(first + plan.num_together, ends.size());
  const std::size_t after_next = std::min(next + plan.num_together, ends.size());
  launch.until = ends[next - 1].tick;
  launch.next_until = next < ends.size() ? ends[after_next - 1].tick : 0;
  for (std::size_t k = 0; k < cuda::kMaxChords; ++k) {
    launch.chord_ends[k] = ends[std::min(first + k, next - 1)].tick;
    launch.next_chord_ends[k] = next < ends.size() ? ends[std::min(next + k, after_next - 1)].tick : 0;
  }
}

void CudaBackend::submit_exact(const StepRequest& request) {
  const bool has_contact_ticks = current_.last_contact_tick.capacity() > 0;
  const bool wants_contact_ticks = request.contact_clock_s > 0.0;
  if (exact_.active() && num_parcels_ > 0 && wants_contact_ticks != has_contact_ticks) stop_exact();
  if (!exact_.active()) start_exact(request);
  ExactLaunch launch = exact_launch(request);
  const RunConstants& run = launch.run;
  launch.goes_on = exact_.is_mid_step();
  launch.budget_ns = static_cast<std::uint64_t>(request.budget_ms * 1e6);
  const ExactRequest plan = plan_exact(run, request);
  const DrawBuffers draw = request.draw ? device_draw_buffers(*request.draw) : DrawBuffers{};
  submitted_ = {.num_steps = request.num_steps,
                .exact = true,
                .per_impulse_count = run.per_impulse_count,
                .impulse_unit_kg_mps = run.impulse_unit_kg_mps};
  launch.ball_was_set = ball_was_set_;
  ball_was_set_ = false;
  if (plan.sorts_within) launch.sort_displacement = static_cast<std::int64_t>(plan.sort_displacement);

  timer_.begin(stream_);
  if (!plan.ends.empty()) set_ends(plan, 0, launch);
  cuda::launch_begin_exact_request(launch, stream_);
  for (std::size_t first = 0; first < plan.ends.size(); first += plan.num_together) {
    set_ends(plan, first, launch);
    launch.draw = launch.next_until == 0 ? draw : DrawBuffers{};
    step_exact(plan, launch);
  }
  if (request.draw) {
    if (plan.ends.empty()) launch_draw(physics_.world, current_parcels(), num_parcels_, draw, stream_);
    if (launch.budget_ns != 0 && !plan.ends.empty()) cuda::launch_draw_paused(launch, stream_);
    copy_to_host(draw, *request.draw);
  }
  PF_CUDA(
      cudaMemcpyAsync(host_state_.get(), state_.data(), sizeof(StepState), cudaMemcpyDeviceToHost, stream_));
  PF_CUDA(cudaMemcpyAsync(host_exact_.get(), exact_memory_.state(), sizeof(ExactState),
                          cudaMemcpyDeviceToHost, stream_));
  timer_.end(stream_);
}

// Reports the progress of the request, and the present ball if it ended within a step.
void CudaBackend::finish_exact(StepReport& report) {
  const ExactState& state = *host_exact_;
  report.totals.num_steps = exact_.finish(state.progress.now);
  report.mid_step = exact_.is_mid_step();
  if (state.has_chord != 0 && !physics_.ball.held)
    report.ball = ball_in_chord(physics_, state.chord, state.ball.trajectory, 0, report.ball);
}

}  // namespace pf
