#include "backend/cpu_backend.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "model/step.hpp"

namespace pf {
namespace {

// Cells are this many contact distances wide, and parcels are sorted again once the search box, which grows
// by what parcels have moved, is wider than this many contact distances each way. Measured at N = 10^5.
constexpr double kCellWidth = 2.0;
constexpr double kLargestReach = 2.0;

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

void draw_parcel(const DrawBuffers& buffers, const World& world, std::size_t i, Vec2i position,
                 Vec2f velocity) {
  const bool gone = is_retired(position);
  buffers.position_m[i] = gone ? Vec2f{kOutOfSight_m, kOutOfSight_m} : to_float(to_metres(world, position));
  buffers.speed_mps[i] = std::sqrt(dot(velocity, velocity));
}

}  // namespace

std::unique_ptr<Backend> make_cpu_backend(unsigned num_threads) {
  const unsigned all = std::max(1U, std::thread::hardware_concurrency());
  return std::make_unique<CpuBackend>(num_threads == 0 ? all : num_threads);
}

CpuBackend::CpuBackend(unsigned num_threads) : team_(num_threads) {}

std::string CpuBackend::device() const {
  return processor_name() + ", " + std::to_string(team_.size()) +
         (team_.size() == 1 ? " thread" : " threads");
}

void CpuBackend::reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) {
  physics_ = physics;
  ball_ = ball;
  step_ = 0;
  sorted_ = false;
  current_.resize(plan.num_parcels);
  next_.resize(plan.num_parcels);
  const std::uint64_t num_sites = plan.num_parcels > 0 ? plan.row_begin[plan.num_rows] : 0;
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, plan.num_parcels);
    for (std::size_t i = begin; i < end; ++i) {
      const Parcel parcel = spawn_parcel(plan, num_sites, static_cast<std::uint32_t>(i));
      current_.position[i] = parcel.position;
      current_.velocity[i] = parcel.velocity;
      current_.id[i] = parcel.id;
    }
  });
}

void CpuBackend::restore(const ParcelSnapshot& snapshot) {
  current_.resize(snapshot.position.size());
  next_.resize(snapshot.position.size());
  std::copy(snapshot.position.begin(), snapshot.position.end(), current_.position.begin());
  std::copy(snapshot.velocity.begin(), snapshot.velocity.end(), current_.velocity.begin());
  for (std::size_t i = 0; i < size(); ++i) current_.id[i] = static_cast<std::uint32_t>(i);
  sorted_ = false;
}

template <class Contact, bool kContacts, bool kBall, Boundary kBoundary>
void CpuBackend::step_range(const StepLoop& loop, std::size_t begin, std::size_t end, CpuTally& tally) {
  const StepConstants& c = loop.constants;
  const Vec2i* position = current_.position.data();
  SearchScratch scratch;
  for (std::size_t i = begin; i < end; ++i) {
    const Parcel self{position[i], current_.velocity[i], current_.id[i]};
    if (is_retired(self.position)) {
      next_.position[i] = self.position;
      next_.velocity[i] = self.velocity;
      if (loop.draw) draw_parcel(*loop.draw, c.physics.world, i, self.position, self.velocity);
      continue;
    }
    ContactSums sums;
    if constexpr (kContacts) {
      loop.search(loop.space, static_cast<std::uint32_t>(i), scratch);
      for (const std::uint32_t j : scratch.finds) {
        const Parcel other{position[j], current_.velocity[j], current_.id[j]};
        const Vec2i offset = separation<kBoundary>(c.physics.world, self.position, other.position);
        add_contact<Contact>(c, self, other, offset, sums, tally);
      }
    }
    const Parcel after = finish_step<kBall, kBoundary>(c, loop.ball, loop.key, self, sums, tally);
    // Field by field: as pairs they would be read back from the stack in one load across two stores, which
    // stalls (a third of the step's time).
    next_.position[i].x = after.position.x;
    next_.position[i].y = after.position.y;
    next_.velocity[i].x = after.velocity.x;
    next_.velocity[i].y = after.velocity.y;
    if (loop.draw) draw_parcel(*loop.draw, c.physics.world, i, after.position, after.velocity);
  }
}

template <class Contact, bool kContacts, bool kBall>
CpuBackend::RangeFunction CpuBackend::range_function_for(Boundary boundary) {
  switch (boundary) {
    case Boundary::walls:
      return &CpuBackend::step_range<Contact, kContacts, kBall, Boundary::walls>;
    case Boundary::periodic:
      return &CpuBackend::step_range<Contact, kContacts, kBall, Boundary::periodic>;
    default:
      return &CpuBackend::step_range<Contact, kContacts, kBall, Boundary::open>;
  }
}

// Terms that are off are compiled out: one loop for each combination of what is on.
CpuBackend::RangeFunction CpuBackend::range_function(const Physics& physics, Method method) {
  const Boundary boundary = physics.world.boundary;
  const bool ball = physics.ball.present;
  if (!physics.parcels.contacts) {
    return ball ? range_function_for<ImpulseContact, false, true>(boundary)
                : range_function_for<ImpulseContact, false, false>(boundary);
  }
  if (method == Method::spring) {
    return ball ? range_function_for<SpringContact, true, true>(boundary)
                : range_function_for<SpringContact, true, false>(boundary);
  }
  return ball ? range_function_for<ImpulseContact, true, true>(boundary)
              : range_function_for<ImpulseContact, true, false>(boundary);
}

void CpuBackend::sort_if_needed(const StepConstants& constants, const StepRequest& request,
                                StepReport& report) {
  const bool search = physics_.parcels.contacts && request.neighbors == Neighbors::grid && size() > 0;
  if (!search) return;
  const double reach = constants.contact_reach + static_cast<double>(travel_);
  if (sorted_ && reach <= kLargestReach * constants.contact_distance) return;
  grid_ = choose_grid(physics_.world, static_cast<std::uint32_t>(size()),
                      kCellWidth * constants.contact_distance);
  cell_sort_.sort(team_, grid_, current_, next_, cell_start_, report.times);
  std::swap(current_, next_);
  travel_ = 0;
  sorted_ = true;
  ++report.totals.num_sorts;
}

void CpuBackend::submit(const StepRequest& request) {
  const StepConstants constants = make_step_constants(physics_, request.dt_s, request.spring_contact_s);
  StepReport report;
  for (std::uint32_t k = 0; k < request.num_steps; ++k) {
    sort_if_needed(constants, request, report);
    step(constants, request, k + 1 == request.num_steps, report);
  }
  report.ball = ball_;
  report_ = report;
}

void CpuBackend::step(const StepConstants& constants, const StepRequest& request, bool last,
                      StepReport& report) {
  const BallMotion motion =
      ball_motion(physics_.world, physics_.ball, ball_, constants.ball_contact_m, request.dt_s);
  const std::int64_t reach = std::min<std::int64_t>(constants.contact_reach + travel_, INT32_MAX / 2);
  const SearchSpace space{current_.position.data(),
                          cell_start_.data(),
                          grid_,
                          physics_.world,
                          static_cast<std::uint32_t>(size()),
                          static_cast<std::int32_t>(reach),
                          constants.filter_distance2,
                          request.neighbors == Neighbors::all_pairs};
  const StepLoop loop{constants,
                      motion,
                      rounding_key(physics_.seed, step_),
                      space,
                      choose_search(physics_.world.boundary),
                      last ? request.draw : nullptr};
  std::vector<CpuTally> tallies(team_.size());
  {
    ScopedPhase timing(report.times, Phase::collide_integrate);
    const RangeFunction range = range_function(physics_, request.method);
    team_.run([&](unsigned thread) {
      CpuTally tally;
      const auto [begin, end] = team_.share(thread, size());
      (this->*range)(loop, begin, end, tally);
      tallies[thread] = tally;
    });
    std::swap(current_.position, next_.position);
    std::swap(current_.velocity, next_.velocity);
  }
  ScopedPhase timing(report.times, Phase::ball);
  CpuTally sum;
  for (const CpuTally& tally : tallies) sum.add(tally);
  travel_ += sum.max_travel;
  if (physics_.ball.present) {
    advance_ball(physics_.world, physics_.ball, sum.ball, constants.impulse_unit_kg_mps, request.dt_s, ball_);
  }
  add_to_totals(constants, sum, report.totals);
  ++step_;
}

void CpuBackend::add_to_totals(const StepConstants& constants, const CpuTally& sum,
                               StepTotals& totals) const {
  StepTotals step;
  step.num_steps = 1;
  step.num_collisions = sum.num_collisions;
  step.num_ball_hits = sum.num_ball_hits;
  step.num_retired = sum.num_retired;
  step.num_invalid = sum.num_invalid;
  step.first_invalid_step = step_;
  step.first_invalid_id = sum.first_invalid_id;
  step.impulse_sum_mps = static_cast<double>(sum.impulse_sum) / constants.per_impulse_count;
  step.max_overlap_diameters = static_cast<double>(sum.max_overlap);
  step.max_speed_mps = std::sqrt(static_cast<double>(sum.max_speed2));
  step.ball_impulse_kg_mps =
      Vec2d{static_cast<double>(sum.ball.impulse_x), static_cast<double>(sum.ball.impulse_y)} *
      constants.impulse_unit_kg_mps;
  step.ball_torque_impulse_kg_m2ps =
      static_cast<double>(sum.ball.torque) * constants.impulse_unit_kg_mps * physics_.ball.radius_m;
  totals += step;
}

void CpuBackend::draw(const DrawBuffers& buffers) {
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, size());
    for (std::size_t i = begin; i < end; ++i) {
      draw_parcel(buffers, physics_.world, i, current_.position[i], current_.velocity[i]);
    }
  });
}

ParcelSnapshot CpuBackend::snapshot() {
  ParcelSnapshot snapshot{std::vector<Vec2i>(size()), std::vector<Vec2f>(size())};
  for (std::size_t i = 0; i < size(); ++i) {
    snapshot.position[current_.id[i]] = current_.position[i];
    snapshot.velocity[current_.id[i]] = current_.velocity[i];
  }
  return snapshot;
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
        const Vec2d v = to_double(current_.velocity[i]);
        sum.parcel_energy_j += 0.5 * mass * dot(v, v);
        sum.momentum_kg_mps += v * mass;
        sum.momentum_scale_kg_mps += mass * std::sqrt(dot(v, v));
        sum.num_live += is_retired(current_.position[i]) ? 0 : 1;
      }
      chunks[chunk] = sum;
    }
  });
  Measures total;
  for (const Measures& sum : chunks) {
    total.parcel_energy_j += sum.parcel_energy_j;
    total.momentum_kg_mps += sum.momentum_kg_mps;
    total.momentum_scale_kg_mps += sum.momentum_scale_kg_mps;
    total.num_live += sum.num_live;
  }
  add_ball(physics_.ball, ball_, total);
  return total;
}

std::uint64_t CpuBackend::state_hash() {
  std::uint64_t hash = physics_.ball.present ? ball_hash(ball_) : 0;
  for (std::size_t i = 0; i < size(); ++i) {
    hash += parcel_hash(current_.id[i], current_.position[i], current_.velocity[i]);
  }
  return hash;
}

std::uint64_t CpuBackend::memory_bytes() const {
  constexpr std::uint64_t kParcelBytes = sizeof(Vec2i) + sizeof(Vec2f) + sizeof(std::uint32_t);
  return kParcelBytes * (current_.id.capacity() + next_.id.capacity()) + 4 * cell_start_.capacity() +
         cell_sort_.memory_bytes();
}

double CpuBackend::least_bytes_moved(const StepTotals& totals) const {
  constexpr double kStep = 2.0 * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(std::uint32_t);
  constexpr double kSort = kStep + sizeof(std::uint32_t);  // the same, and the ids written
  const double n = static_cast<double>(size());
  const double per_sort = n * kSort + 8.0 * static_cast<double>(cell_start_.size());
  return static_cast<double>(totals.num_steps) * n * kStep + static_cast<double>(totals.num_sorts) * per_sort;
}

double CpuBackend::measure_copy_bandwidth(std::size_t num_bytes) {
  constexpr int kRepeats = 5;
  std::vector<std::byte> from(num_bytes), to(num_bytes);
  double best_ms = 1e30;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const Clock::time_point start = Clock::now();
    team_.run([&](unsigned thread) {
      const auto [begin, end] = team_.share(thread, num_bytes);
      std::copy(from.begin() + static_cast<std::ptrdiff_t>(begin),
                from.begin() + static_cast<std::ptrdiff_t>(end),
                to.begin() + static_cast<std::ptrdiff_t>(begin));
    });
    best_ms = std::min(best_ms, milliseconds_since(start));
  }
  return 2e3 * static_cast<double>(num_bytes) / best_ms;
}

}  // namespace pf
