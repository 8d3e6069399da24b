#include "backend/cpu_backend.hpp"

#include <algorithm>
#include <numeric>

#include "backend/exact/limits.hpp"
#include "backend/processor.hpp"
#include "model/exact/push_out.hpp"
#include "model/time_step.hpp"

namespace pf {

std::unique_ptr<Backend> make_cpu_backend(unsigned num_threads) {
  const unsigned all = std::max(1U, std::thread::hardware_concurrency());
  return std::make_unique<CpuBackend>(num_threads == 0 ? all : num_threads);
}

CpuBackend::CpuBackend(unsigned num_threads) : team_(num_threads) {}

std::string CpuBackend::device() const { return processor_with_threads(team_.size()); }

void CpuBackend::reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) {
  physics_ = physics;
  ball_ = ball;
  step_ = 0;
  exact_.reset_time();
  parcels_.resize(plan.num_parcels);
  const std::uint64_t num_sites = plan.num_parcels > 0 ? plan.row_start[plan.num_rows] : 0;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, plan.num_parcels);
    for (std::size_t i = begin; i < end; ++i) {
      const Parcel parcel = spawn_parcel(plan, num_sites, static_cast<std::uint32_t>(i));
      parcels_.current.position[i] = parcel.position;
      parcels_.current.velocity[i] = parcel.velocity;
      parcels_.current.id[i] = parcel.id;
      parcels_.current.is_heated[i] = 0;
    }
  });
}

void CpuBackend::set_physics(const Physics& physics) {
  if (!keeps_trajectories(physics_, physics)) stop_exact();
  exact_.forget_predictions();
  // Walls are a radius away: a parcel that is now beyond its limit moves farther than any step would.
  if (physics.parcels.radius_m != physics_.parcels.radius_m) parcels_.sorted = false;
  physics_ = physics;
}

void CpuBackend::set_ball(const BallState& ball) {
  ball_ = ball;
  exact_.forget_ball();
}

void CpuBackend::restore(const ParcelSnapshot& snapshot) {
  stop_exact();
  step_ = snapshot.step;
  parcels_.resize(snapshot.position.size());
  std::copy(snapshot.position.begin(), snapshot.position.end(), parcels_.current.position.begin());
  std::copy(snapshot.velocity.begin(), snapshot.velocity.end(), parcels_.current.velocity.begin());
  for (std::size_t i = 0; i < size(); ++i) parcels_.current.id[i] = static_cast<std::uint32_t>(i);
  std::ranges::fill(parcels_.current.is_heated, 0);
  for (const std::uint32_t id : snapshot.heated) parcels_.current.is_heated[id] = 1;
}

void CpuBackend::sort_if_needed(const StepConstants& constants, const StepRequest& request,
                                StepReport& report) {
  const bool searches = physics_.parcels.contacts && request.neighbors == Neighbors::grid && size() > 0;
  if (!searches || stepper_.is_search_near(constants)) return;
  stepper_.sort(constants, area_of(physics_.world), report.times);
  ++report.totals.num_sorts;
}

void CpuBackend::submit(const StepRequest& request) {
  StepReport report;
  if (request.method == Method::exact) {
    advance_exact(request, report);
  } else {
    stop_exact();
    const StepConstants constants = make_step_constants(physics_, request.dt_s, request.spring_contact_s);
    const Deadline deadline(request.budget_ms);
    for (std::uint32_t k = 0; k < request.num_steps && (k == 0 || !deadline.has_passed()); ++k) {
      sort_if_needed(constants, request, report);
      step(constants, request, k + 1 == request.num_steps, report);
    }
    const bool is_cut = report.totals.num_steps < request.num_steps;
    if (is_cut && request.draw) draw(*request.draw);
  }
  report.ball = ball_;
  report_ = report;
}

void CpuBackend::advance_exact(const StepRequest& request, StepReport& report) {
  const bool has_contact_ticks = !parcels_.current.last_contact_tick.empty();
  const bool wants_contact_ticks = request.contact_clock_s > 0.0 && parcels_.size() > 0;
  if (exact_.active() && has_contact_ticks != wants_contact_ticks) stop_exact();
  if (!exact_.active()) start_exact(request);
  exact_.advance(physics_, request, parcels_, ball_, report);
  if (exact_.is_unresolvable()) {
    stop_exact();
    report.ball = ball_;
    throw unresolvable(exact_.tick_s(), report);
  }
  report.mid_step = exact_.is_mid_step();
  if (request.draw) draw(*request.draw);
}

// Overlaps that a crowd keeps are reported in max_overlap_diameters.
void CpuBackend::push_apart(const StepRequest& request) {
  const StepConstants constants = make_step_constants(physics_, 0.0, 0.0);
  const float tolerance = push_out_tolerance(constants);
  for (int k = 0; k < kMaxPushOutSweeps; ++k) {
    StepReport scratch;
    parcels_.sorted = false;
    sort_if_needed(constants, request, scratch);
    const CpuTally sum = stepper_.push_out(constants, request.neighbors);
    stepper_.add_displacement(sum.max_displacement);
    if (sum.max_overlap <= tolerance) return;
  }
}

// Another method, or a larger radius, may leave overlapping parcels.
void CpuBackend::start_exact(const StepRequest& request) {
  if (physics_.parcels.contacts) push_apart(request);
  std::ranges::fill(parcels_.current.is_heated, 0);
  exact_.enter(physics_, request.contact_clock_s, parcels_);
}

void CpuBackend::stop_exact() {
  if (exact_.active()) exact_.leave(parcels_);
}

void CpuBackend::step(const StepConstants& constants, const StepRequest& request, bool last,
                      StepReport& report) {
  const BallFlight flight = fly(physics_.ball, ball_, request.dt_s);
  const BallMotion motion =
      ball_motion(physics_.world, physics_.ball, ball_, flight, constants.ball_contact_m);
  CpuTally sum;
  {
    ScopedPhase timing(report.times, Phase::collide_integrate);
    sum = stepper_.advance({constants, request.method, request.neighbors, motion,
                            rounding_key(physics_.seed, step_), last ? request.draw : nullptr});
    stepper_.add_displacement(sum.max_displacement);
  }
  ScopedPhase timing(report.times, Phase::ball);
  if (physics_.ball.exists) {
    advance_ball(physics_.world, physics_.ball, flight, sum.ball, constants.impulse_unit_kg_mps, ball_);
  }
  StepTotals totals = totals_of(constants, sum);
  totals.num_steps = 1;
  totals.first_invalid_step = step_;
  report.totals += totals;
  ++step_;
}

void CpuBackend::draw(const DrawBuffers& buffers) {
  const std::vector<Vec2i>& position = positions();
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, size());
    for (std::size_t i = begin; i < end; ++i) {
      draw_parcel(buffers, physics_.world, i, position[i], parcels_.current.velocity[i]);
    }
  });
}

// Summed over chunks of fixed size, so that the result does not depend on the number of threads.
Measures CpuBackend::measure() {
  constexpr std::size_t kChunk = 8192;
  const std::size_t num_chunks = (size() + kChunk - 1) / kChunk;
  std::vector<Measures> chunks(num_chunks);
  const double mass = physics_.parcels.mass_kg;
  team_.run([&](unsigned thread) {
    const auto [first, last] = team_.share(thread, num_chunks);
    for (std::size_t chunk = first; chunk < last; ++chunk) {
      Measures sum;
      for (std::size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, size()); ++i) {
        sum += measures_of(parcels_.current.position[i], parcels_.current.velocity[i], mass);
      }
      chunks[chunk] = sum;
    }
  });
  Measures total;
  for (const Measures& sum : chunks) total += sum;
  add_ball(physics_.ball, ball_, total);
  return total;
}

Profile CpuBackend::profile(const ProfileShape& shape) {
  const std::vector<Vec2i>& position = positions();
  std::vector<Profile> parts(team_.size(), empty_profile(shape));
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, size());
    add_parcels(parts[thread], position.data() + begin, parcels_.current.velocity.data() + begin,
                end - begin);
  });
  for (std::size_t k = 1; k < parts.size(); ++k) {
    for (std::size_t bin = 0; bin < parts[k].bins.size(); ++bin) parts[0].bins[bin] += parts[k].bins[bin];
  }
  return std::move(parts[0]);
}

std::uint64_t CpuBackend::state_hash() {
  const std::vector<Vec2i>& position = positions();
  std::vector<std::uint64_t> parts(team_.size());
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, size());
    std::uint64_t hash = 0;
    for (std::size_t i = begin; i < end; ++i)
      hash += parcel_hash(parcels_.current.id[i], position[i], parcels_.current.velocity[i]);
    parts[thread] = hash;
  });
  return std::accumulate(parts.begin(), parts.end(), physics_.ball.exists ? ball_hash(ball_) : 0ULL);
}

std::uint64_t CpuBackend::memory_bytes() const {
  return parcels_.memory_bytes() + stepper_.memory_bytes() + exact_.memory_bytes();
}

double CpuBackend::min_bytes_moved(const StepTotals& totals) const {
  return min_step_bytes(size(), parcels_.cell_start.size(), totals);
}

double CpuBackend::measure_copy_bandwidth(std::size_t num_bytes) {
  return pf::measure_copy_bandwidth(team_, num_bytes);
}

}  // namespace pf
