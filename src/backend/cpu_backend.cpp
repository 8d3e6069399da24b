#include "backend/cpu_backend.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <tuple>

#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// Width of cells, and half side of the search box above which parcels are sorted again, in contact distances.
// The box grows with the displacement of the parcels. Both were measured at N = 10^5.
constexpr double kCellWidth = 2.0;
constexpr double kMaxSearchReach = 2.0;

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
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
    }
  });
}

void CpuBackend::set_physics(const Physics& physics) {
  const auto trajectories_depend_on = [](const Physics& p) {
    return std::tuple(p.parcels.radius_m, p.parcels.contacts, p.reference_speed_mps);
  };
  if (trajectories_depend_on(physics) != trajectories_depend_on(physics_)) stop_exact();
  exact_.forget_predictions();
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
}

template <class Contact, bool kBall, Boundary kBoundary>
void CpuBackend::step_range(const StepLoop& loop, std::size_t begin, std::size_t end, CpuTally& tally) {
  const StepConstants& c = loop.constants;
  const Vec2i* position = parcels_.current.position.data();
  SearchScratch scratch;
  for (std::size_t i = begin; i < end; ++i) {
    const Parcel self{position[i], parcels_.current.velocity[i], parcels_.current.id[i]};
    if (is_retired(self.position)) {
      parcels_.next.position[i] = self.position;
      parcels_.next.velocity[i] = self.velocity;
      if (loop.draw) draw_parcel(*loop.draw, c.physics.world, i, self.position, self.velocity);
      continue;
    }
    ContactSums sums;
    if constexpr (has_contacts<Contact>) {
      loop.search(loop.space, static_cast<std::uint32_t>(i), scratch);
      for (const std::uint32_t j : scratch.candidates) {
        const Parcel other{position[j], parcels_.current.velocity[j], parcels_.current.id[j]};
        const Vec2i offset = separation<kBoundary>(c.physics.world, self.position, other.position);
        add_contact<Contact>(c, self, other, offset, sums, tally);
      }
    }
    const Parcel after = finish_step<kBall, kBoundary>(c, loop.ball, loop.key, self, sums, tally);
    // Copied field by field. As a pair they would be read back from the stack in one load across two stores,
    // which stalls and costs a third of the step's time.
    parcels_.next.position[i].x = after.position.x;
    parcels_.next.position[i].y = after.position.y;
    parcels_.next.velocity[i].x = after.velocity.x;
    parcels_.next.velocity[i].y = after.velocity.y;
    if (loop.draw) draw_parcel(*loop.draw, c.physics.world, i, after.position, after.velocity);
  }
}

// True if parcels have moved so little since the sort that partners are still searched nearby.
bool CpuBackend::is_search_near(const StepConstants& constants) const {
  const double reach = constants.contact_reach + static_cast<double>(displacement_);
  return is_plain_ ? reach <= kMaxSearchReach * constants.contact_distance
                   : PairedLoop::covers(parcels_, constants, displacement_);
}

void CpuBackend::sort_if_needed(const StepConstants& constants, const StepRequest& request,
                                StepReport& report) {
  const bool searches = physics_.parcels.contacts && request.neighbors == Neighbors::grid && size() > 0;
  if (!searches || (parcels_.sorted && is_search_near(constants))) return;
  const double cell_width = is_plain_ ? kCellWidth : PairedLoop::kCellWidth;
  parcels_.sort(team_, physics_.world, cell_width * constants.contact_distance,
                parcels_.current.position.data(), report.times);
  if (!is_plain_) paired_.prepare(parcels_, physics_.world.boundary);
  displacement_ = 0;
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
  if (exact_.active() && has_contact_ticks != (request.contact_clock_s > 0.0)) stop_exact();
  if (!exact_.active()) start_exact(request);
  exact_.advance(physics_, request, parcels_, ball_, report);
  report.mid_step = exact_.is_mid_step();
  if (request.draw) draw(*request.draw);
}

// Overlaps that a crowd keeps are reported in max_overlap_diameters.
void CpuBackend::push_apart(const StepRequest& request) {
  constexpr int kMaxSweeps = 50;
  const StepConstants constants = make_step_constants(physics_, 0.0, 0.0);
  const RangeFunction push_out = for_boundary(physics_.world.boundary, []<Boundary kBoundary>() {
    return &CpuBackend::step_range<PushOutContact, false, kBoundary>;
  });
  const auto tolerance = static_cast<float>(kRoundingMargin / constants.contact_distance);
  StepRequest sweep = request;
  sweep.draw = nullptr;
  for (int k = 0; k < kMaxSweeps; ++k) {
    StepReport scratch;
    parcels_.sorted = false;
    sort_if_needed(constants, sweep, scratch);
    if (run_loop(constants, sweep, {}, nullptr, push_out).max_overlap <= tolerance) return;
  }
}

// Another method, or a larger radius, may leave overlapping parcels.
void CpuBackend::start_exact(const StepRequest& request) {
  if (physics_.parcels.contacts) push_apart(request);
  exact_.enter(physics_, request.contact_clock_s, parcels_);
}

void CpuBackend::stop_exact() {
  if (exact_.active()) exact_.leave(parcels_);
}

CpuTally CpuBackend::run_loop(const StepConstants& constants, const StepRequest& request,
                              const BallMotion& motion, const DrawBuffers* draw, RangeFunction range) {
  const std::int64_t reach = std::min<std::int64_t>(constants.contact_reach + displacement_, INT32_MAX / 2);
  const SearchSpace space{parcels_.current.position.data(),
                          parcels_.cell_start.data(),
                          parcels_.grid,
                          physics_.world,
                          static_cast<std::uint32_t>(size()),
                          static_cast<std::int32_t>(reach),
                          constants.filter_distance2,
                          request.neighbors == Neighbors::all_pairs};
  const StepLoop loop{
      constants, motion, rounding_key(physics_.seed, step_), space, choose_search(physics_.world.boundary),
      draw};
  std::vector<CpuTally> tallies(team_.size());
  if (range == nullptr) {
    paired_.run(loop, request.method, parcels_, tallies);
  } else {
    team_.run([&](unsigned thread) {
      CpuTally tally;
      const auto [begin, end] = team_.share(thread, size());
      (this->*range)(loop, begin, end, tally);
      tallies[thread] = tally;
    });
  }
  std::swap(parcels_.current.position, parcels_.next.position);
  std::swap(parcels_.current.velocity, parcels_.next.velocity);
  CpuTally sum;
  for (const CpuTally& tally : tallies) sum.add(tally);
  displacement_ += sum.max_displacement;
  return sum;
}

void CpuBackend::step(const StepConstants& constants, const StepRequest& request, bool last,
                      StepReport& report) {
  const BallMotion motion =
      ball_motion(physics_.world, physics_.ball, ball_, constants.ball_contact_m, request.dt_s);
  const RangeFunction plain =
      for_terms(physics_, request.method, []<class Contact, bool kBall, Boundary kBoundary>() {
        return &CpuBackend::step_range<Contact, kBall, kBoundary>;
      });
  const bool in_pairs = !is_plain_ && request.neighbors == Neighbors::grid;
  CpuTally sum;
  {
    ScopedPhase timing(report.times, Phase::collide_integrate);
    sum = run_loop(constants, request, motion, last ? request.draw : nullptr, in_pairs ? nullptr : plain);
  }
  ScopedPhase timing(report.times, Phase::ball);
  if (physics_.ball.exists) {
    advance_ball(physics_.world, physics_.ball, sum.ball, constants.impulse_unit_kg_mps, request.dt_s, ball_);
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
        const Vec2d v = to_double(parcels_.current.velocity[i]);
        sum.parcel_energy_j += 0.5 * mass * dot(v, v);
        sum.momentum_kg_mps += v * mass;
        sum.momentum_scale_kg_mps += mass * std::sqrt(dot(v, v));
        sum.num_live += is_retired(parcels_.current.position[i]) ? 0 : 1;
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

Profile CpuBackend::profile(const ProfileShape& shape) {
  const std::vector<Vec2i>& position = positions();
  std::vector<Profile> parts(team_.size(), empty_profile(shape));
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, size());
    add_parcels(parts[thread], &position[begin], &parcels_.current.velocity[begin], end - begin);
  });
  for (std::size_t k = 1; k < parts.size(); ++k) {
    for (std::size_t bin = 0; bin < parts[k].bins.size(); ++bin) parts[0].bins[bin] += parts[k].bins[bin];
  }
  return std::move(parts[0]);
}

std::uint64_t CpuBackend::state_hash() {
  std::uint64_t hash = physics_.ball.exists ? ball_hash(ball_) : 0;
  const std::vector<Vec2i>& position = positions();
  for (std::size_t i = 0; i < size(); ++i) {
    hash += parcel_hash(parcels_.current.id[i], position[i], parcels_.current.velocity[i]);
  }
  return hash;
}

std::uint64_t CpuBackend::memory_bytes() const {
  return parcels_.memory_bytes() + paired_.memory_bytes() + exact_.memory_bytes();
}

double CpuBackend::min_bytes_moved(const StepTotals& totals) const {
  constexpr double kStep = 2.0 * (sizeof(Vec2i) + sizeof(Vec2f)) + sizeof(std::uint32_t);
  constexpr double kSort = kStep + sizeof(std::uint32_t);  // as a step, plus written ids
  const double n = static_cast<double>(size());
  const double per_sort = n * kSort + 8.0 * static_cast<double>(parcels_.cell_start.size());
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
