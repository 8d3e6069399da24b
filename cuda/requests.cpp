// Requests of the time-stepped methods, and the reports of all methods.
#include <algorithm>
#include <optional>

#include "backend/exact/limits.hpp"
#include "cuda/cuda_backend.cuh"
#include "cuda/cuda_devices.hpp"
#include "model/exact/trajectory.hpp"
#include "model/kinetic_theory.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

// Expected displacement in a step, position units: a tenth more than the largest one in the last step, which
// took last_dt_s; at first that of a parcel at 4.5 standard deviations of the speed.
std::int64_t displacement_in_step(const StepConstants& constants, std::int32_t last, double last_dt_s) {
  if (last > 0 && last_dt_s > 0.0)
    return static_cast<std::int64_t>(std::min(1.1 * last * (constants.dt_s / last_dt_s), 0x1p40));
  const double first = 4.5 * constants.advance_scale * 0x1p-32 * constants.physics.parcels.speed_mps;
  return static_cast<std::int64_t>(std::min(first, 0x1p40));
}

// Returns whether a step in parts is faster, as it is if there are many parcels and few touch at a time: sums
// of parcels with several contacts are atomics in memory. With a ball most touch only in the layer before it.
bool pays_in_parts(const Physics& physics, Method method, std::uint32_t num_parcels) {
  if (const std::uint32_t many = device_limits().many_parcels; many > 0) return num_parcels >= many;
  if (row_of(method).contacts_last) return false;
  return physics.ball.exists ? num_parcels >= kManyWithBall
                             : num_parcels >= kManyParcels && area_fraction_of(physics) <= kMaxAreaFraction;
}

// Returns whether launches of steps of one kernel are batched. With a ball a step waits for it about as long
// as the host takes for two launches. Gps of a gas of 10^5 on an H200, with batches and without, in requests
// of 16, 32, 64 and 400 steps: 9.3 and 9.2, 10.2 and 9.9, 11.2 and 10.5, 12.3 and 11.6; of 10^4 0.98 and
// 1.15, 1.25 and 1.27, 1.49 and 1.35, 1.64 and 1.52.
bool pays_in_batches(const Physics& physics, std::uint32_t num_steps) {
  constexpr std::uint32_t kManySteps = 64;
  const std::uint32_t many = device_limits().many_steps;
  return !physics.ball.exists && num_steps >= (many > 0 ? many : kManySteps);
}

double widest_reach(bool in_parts, OneKernel one_kernel) {
  if (in_parts) return kWidestReachInParts;
  return one_kernel == OneKernel::plain ? kWidestStepReach : kWidestReachOfBlock;
}

constexpr unsigned kSortFirst = 1;  // a kind of batches

}  // namespace

// A sort is due when the search box would grow wider than `widest`, in contact distances. An estimate serves
// for the steps of this request: it decides on speed only, since the kernel searches as far as parcels have
// really moved.
bool CudaBackend::sort_is_due(const StepConstants& constants, double widest) const {
  return !sorted_ || static_cast<double>(constants.contact_reach + expected_displacement_) >
                         widest * constants.contact_distance;
}

bool CudaBackend::can_sort_in_step(const StepConstants& constants) const {
  return sorted_ && static_cast<double>(constants.contact_reach + expected_displacement_) <=
                        kWidestReachToSort * constants.contact_distance;
}

void CudaBackend::sort(const StepConstants& constants) {
  const GridShape grid = choose_grid(physics_.world, num_parcels_, step_cells(constants));
  timer_.mark_sort(stream_);
  {
    const PhaseRange range(Phase::sort);
    cell_sort_.count(grid, current_.position.data(), num_parcels_, stream_);
    cell_sort_.sum_counts(grid, stream_);
  }
  timer_.mark_sort(stream_);
  {
    const PhaseRange range(Phase::grid);
    cell_sort_.scatter(current_.pointers(), next_.pointers(), num_parcels_, stream_);
  }
  timer_.mark_sort(stream_);
  grid_ = grid;
  std::swap(current_, next_);
  sorted_ = true;
}

// The place of the displacements since the sort for a step; launch.sort is still that of the step before.
// is_just_sorted: after that one.
DisplacedSinceSort CudaBackend::displaced_since_sort(const StepLaunch& launch, bool is_just_sorted) const {
  const StepState* const state = state_.data();
  if (is_just_sorted) return {&state->none, &state->none};
  if (launch.num_open == 0) return {&state->displaced, &state->none};
  const std::uint32_t last = launch.num_open - 1;
  const bool has_last_sorted = launch.sort.is_due;
  return {has_last_sorted ? &state->none : &state->displaced_before[last], &state->displacement[last]};
}

void CudaBackend::submit(const StepRequest& request) {
  if (request.method == Method::exact) return submit_exact(request);
  stop_exact();
  const StepConstants constants = make_step_constants(physics_, request.dt_s, request.spring_contact_s);
  const bool searches = physics_.parcels.contacts && request.neighbors == Neighbors::grid && num_parcels_ > 0;
  const std::int64_t displacement =
      displacement_in_step(constants, host_state_->last_displacement, submitted_.dt_s);
  const DrawBuffers draw = request.draw ? device_draw_buffers(*request.draw) : DrawBuffers{};
  const bool in_parts = pays_in_parts(physics_, request.method, num_parcels_) && make_room_for_contacts();
  StepLaunch launch = plan_launch(constants, request);
  const double widest = widest_reach(in_parts, launch.one_kernel);
  submitted_ = {.num_steps = request.num_steps,
                .dt_s = request.num_steps > 0 ? request.dt_s : submitted_.dt_s,
                .per_impulse_count = constants.per_impulse_count,
                .impulse_unit_kg_mps = constants.impulse_unit_kg_mps};

  timer_.begin(stream_);
  launch_begin_request(constants, state_.data(), slots_.data(), stream_);
  std::optional<LaunchBatches::Scope> batched;
  if (!in_parts && pays_in_batches(physics_, request.num_steps)) batched.emplace(batches_, stream_);
  for (std::uint32_t k = 0; k < request.num_steps; ++k) {
    const bool sorts = searches && sort_is_due(constants, widest);
    const bool sorts_in_step = sorts && can_sort_in_step(constants);
    if (sorts && !sorts_in_step) {
      batches_.flush();
      sort(constants);
    }
    launch.displaced = displaced_since_sort(launch, sorts && !sorts_in_step);
    launch.sort.is_due = sorts_in_step;
    submitted_.num_sorts += sorts ? 1 : 0;
    expected_displacement_ = (sorts ? 0 : expected_displacement_) + displacement;
    if (k + 1 == request.num_steps) launch.draw = draw;
    if (in_parts)
      step_in_parts(launch);
    else
      step(launch, launch_step);
  }
  end_steps(launch);
  batches_.flush();
  if (request.draw) copy_to_host(draw, *request.draw);
  PF_CUDA(
      cudaMemcpyAsync(host_state_.get(), state_.data(), sizeof(StepState), cudaMemcpyDeviceToHost, stream_));
  timer_.end(stream_);
}

StepLaunch CudaBackend::plan_launch(const StepConstants& constants, const StepRequest& request) const {
  StepLaunch launch;
  launch.constants = constants;
  launch.space.world = physics_.world;
  launch.space.num_parcels = num_parcels_;
  launch.space.all_pairs = request.neighbors == Neighbors::all_pairs;
  launch.state = state_.data();
  launch.slots = slots_.data();
  launch.method = request.method;
  launch.one_kernel = choose_one_kernel(physics_, request.method, num_parcels_);
  launch.num = num_parcels_;
  return launch;
}

// The memory that `exact` keeps may leave no room; the step of one kernel needs none.
bool CudaBackend::make_room_for_contacts() {
  if (contact_memory_.has_room(capacity_)) return true;
  if (ContactMemory::kBytesPerParcel * capacity_ > kUsableShare * static_cast<double>(usable_memory_bytes()))
    return false;
  contact_memory_.reserve(capacity_, stream_);
  return true;
}

// Tells the launch where the next step finds the parcels.
void CudaBackend::set_source(StepLaunch& launch) const {
  launch.space.grid = grid_;
  launch.space.cell_start = cell_sort_.cell_start();
  launch.from = current_.pointers();
  launch.to = next_.pointers();
}

// One step of parcels, and of the ball, if there is one.
void CudaBackend::step(StepLaunch& launch, LaunchStep launch_parcels) {
  set_source(launch);
  if (launch.sort.is_due) {
    const PhaseRange range(Phase::sort);
    batches_.flush();  // a batch has one sort at most, at its begin
    if (!timer_.marks_sums()) batches_.extend(kSortFirst);
    begin_sort_in_step(launch);
    timer_.mark_sums(stream_);
    launch_count(launch, stream_);
    end_counting(launch);
  }
  {
    const PhaseRange range(Phase::collide_integrate);
    batches_.extend();
    launch_parcels(launch, stream_);
  }
  std::swap(current_.position, next_.position);
  std::swap(current_.velocity, next_.velocity);
  std::swap(current_.heated, next_.heated);
  if (launch.sort.is_due) std::swap(current_.id, next_.id);
  note_step(launch, false);
}

// The same for many parcels.
void CudaBackend::step_in_parts(StepLaunch& launch) {
  set_source(launch);
  launch.contacts = launch.sort.is_due ? contact_memory_.lay_out_to_sort(next_)
                                       : contact_memory_.lay_out(next_, cell_sort_);
  if (launch.sort.is_due) begin_sort_in_step(launch);
  {
    const PhaseRange range(Phase::collide_integrate);
    launch_contacts(launch, stream_);
  }
  if (launch.sort.is_due) {
    const PhaseRange range(Phase::sort);
    timer_.mark_sums(stream_);
    end_counting(launch);
  }
  {
    const PhaseRange range(Phase::collide_integrate);
    launch_move(launch, stream_);
  }
  if (launch.sort.is_due) std::swap(current_, next_);
  note_step(launch, physics_.parcels.contacts);
}

void CudaBackend::begin_sort_in_step(StepLaunch& launch) {
  launch.sort.grid = choose_grid(physics_.world, num_parcels_, step_cells(launch.constants));
  launch.sort.places = cell_sort_.begin_places(launch.sort.grid, stream_);
}

// When the parcels are counted. From here on their places and the grid are the new ones.
void CudaBackend::end_counting(StepLaunch& launch) {
  cell_sort_.sum_to_places(launch.sort.grid, stream_);
  timer_.mark_sums(stream_);
  ++submitted_.num_sorts_in_steps;
  grid_ = launch.sort.grid;
}

// next_moves_ball: if there is one, the next step moves it past this one, which may stay open.
void CudaBackend::note_step(StepLaunch& launch, bool next_moves_ball) {
  ++launch.num_open;
  if ((physics_.ball.exists && !next_moves_ball) || launch.num_open == kMaxOpenSteps) end_steps(launch);
}

void CudaBackend::end_steps(StepLaunch& launch) {
  if (launch.num_open == 0) return;
  const PhaseRange range(Phase::ball);
  if (timer_.marks_ball())
    batches_.flush();
  else
    batches_.extend();
  timer_.mark_ball(stream_);
  launch_end_steps(launch, stream_);
  timer_.mark_ball(stream_);
  launch.num_open = 0;
  ++submitted_.num_ends;
}

StepTotals CudaBackend::collected_totals() const {
  const RequestTotals& sum = host_state_->totals;
  StepTotals totals;
  totals.num_steps = submitted_.num_steps;
  totals.num_collisions = sum.num_collisions;
  totals.num_ball_hits = sum.num_hits;
  totals.num_retired = sum.num_retired;
  totals.num_invalid = sum.num_invalid;
  totals.first_invalid_step = submitted_.exact ? 0 : sum.first_invalid_step;
  totals.first_invalid_id = sum.num_invalid > 0 ? sum.first_invalid_id : UINT32_MAX;
  totals.impulse_sum_mps = static_cast<double>(sum.impulse_sum) / submitted_.per_impulse_count;
  totals.max_overlap_diameters = static_cast<double>(sum.max_overlap);
  totals.num_sorts = submitted_.num_sorts;
  if (submitted_.exact) {
    totals.num_rounds = host_exact_->num_rounds;
    totals.num_retried_steps = host_exact_->num_retried;
    totals.event_hash = host_exact_->event_hash;
    totals.num_events = host_exact_->num_events_committed;
    totals.num_solved_events = host_exact_->num_events_solved;
    totals.largest_cluster = host_exact_->largest_cluster;
  }
  totals.ball_impulse_kg_mps = Vec2d{static_cast<double>(sum.ball_x), static_cast<double>(sum.ball_y)} *
                               submitted_.impulse_unit_kg_mps;
  totals.ball_torque_impulse_kg_m2ps =
      static_cast<double>(sum.ball_torque) * submitted_.impulse_unit_kg_mps * physics_.ball.radius_m;
  return totals;
}

StepReport CudaBackend::collect() {
  StepReport report;
  report.times = submitted_.exact
                     ? timer_.exact_times(&host_exact_->reconcile_ns)
                     : timer_.times({submitted_.num_ends, submitted_.num_sorts_in_steps});  // either waits
  expected_displacement_ = submitted_.exact ? host_exact_->progress.max_displacement : host_state_->displaced;
  report.ball = host_state_->ball;
  report.totals = collected_totals();
  if (submitted_.exact) finish_exact(report);
  if (submitted_.exact && host_exact_->unresolvable != 0) {
    stop_exact();
    StepState state = read_state();
    state.ball = report.ball;
    write_state(state);
    throw unresolvable(tick_seconds(physics_.world, physics_.reference_speed_mps), report);
  }
  return report;
}

}  // namespace pf
