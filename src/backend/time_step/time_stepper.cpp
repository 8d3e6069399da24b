#include "backend/time_step/time_stepper.hpp"

#include <algorithm>
#include <cmath>

#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// Width of cells, and half side of the search box above which parcels are sorted again, in contact distances.
// The box grows with the displacement of the parcels. Both were measured at N = 10^5.
constexpr double kStepCellWidth = 2.0;
constexpr double kMaxSearchReach = 2.0;

}  // namespace

template <class Contact, bool kBall, Boundary kBoundary>
void TimeStepper::step_range(const StepInput& input, std::size_t begin, std::size_t end, CpuTally& tally) {
  const StepConstants& c = input.constants;
  SearchScratch scratch;
  for (std::size_t i = begin; i < end; ++i) {
    if (parcels_.is_ghost(i)) continue;
    const Parcel self = parcels_.current[i];
    if (is_retired(self.position)) {
      parcels_.next.position[i] = self.position;
      parcels_.next.velocity[i] = self.velocity;
      parcels_.next.is_heated[i] = 0;
      if (input.draw) draw_parcel(*input.draw, c.physics.world, i, self.position, self.velocity);
      continue;
    }
    ContactSums sums;
    if constexpr (has_contacts<Contact>) {
      input.search(input.space, static_cast<std::uint32_t>(i), scratch);
      for (const std::uint32_t j : scratch.candidates) {
        const Parcel other = parcels_.current[j];
        const Vec2i offset = separation<kBoundary>(c.physics.world, self.position, other.position);
        add_contact<Contact>(c, self, other, offset, sums, tally);
      }
    }
    const Parcel after = finish_step<kBall, kBoundary>(c, input.ball, input.key, self, sums, tally);
    // Copied field by field. As a pair they would be read back from the stack in one load across two stores,
    // which stalls and costs a third of the step's time.
    parcels_.next.position[i].x = after.position.x;
    parcels_.next.position[i].y = after.position.y;
    parcels_.next.velocity[i].x = after.velocity.x;
    parcels_.next.velocity[i].y = after.velocity.y;
    parcels_.next.is_heated[i] = static_cast<std::uint8_t>(after.is_heated);
    if (input.draw) draw_parcel(*input.draw, c.physics.world, i, after.position, after.velocity);
  }
}

std::int64_t TimeStepper::covered_displacement(const StepConstants& constants) const {
  if (!is_plain_) return PairedLoop::covered_displacement(parcels_, constants);
  const double max_reach = std::floor(kMaxSearchReach * constants.contact_distance);
  return static_cast<std::int64_t>(max_reach) - constants.contact_reach;
}

void TimeStepper::sort(const StepConstants& constants, const GridArea& area, PhaseTimes& times) {
  const World& world = constants.physics.world;
  const double distance = constants.contact_distance;
  const double width =
      is_plain_ ? kStepCellWidth * distance : PairedLoop::cell_width(area, parcels_.size(), distance);
  const GridShape grid = choose_grid(world, area, static_cast<std::uint32_t>(parcels_.size()), {width});
  parcels_.sort(team_, grid, parcels_.current.position.data(), times);
  displacement_ = 0;
  if (is_plain_) return;
  ScopedPhase timing(times, Phase::grid);
  paired_.prepare(parcels_, world.boundary);
}

CpuTally TimeStepper::advance(const TimeStep& step) {
  const bool in_pairs = !is_plain_ && step.neighbors == Neighbors::grid;
  if (in_pairs) return run(step, nullptr);
  return run(step, for_terms(step.constants.physics, step.method,
                             []<class Contact, bool kBall, Boundary kBoundary>() {
                               return &TimeStepper::step_range<Contact, kBall, kBoundary>;
                             }));
}

CpuTally TimeStepper::push_out(const StepConstants& constants, Neighbors neighbors) {
  TimeStep step{.constants = constants, .neighbors = neighbors, .ball = {}};
  return run(step, for_boundary(constants.physics.world.boundary, []<Boundary kBoundary>() {
               return &TimeStepper::step_range<PushOutContact, false, kBoundary>;
             }));
}

CpuTally TimeStepper::run(const TimeStep& step, RangeFunction range) {
  const StepConstants& constants = step.constants;
  const World& world = constants.physics.world;
  const std::int64_t reach = std::min<std::int64_t>(constants.contact_reach + displacement_, INT32_MAX / 2);
  const SearchSpace space{parcels_.current.position.data(),
                          parcels_.cell_start.data(),
                          parcels_.grid,
                          world,
                          static_cast<std::uint32_t>(parcels_.size()),
                          static_cast<std::int32_t>(reach),
                          constants.filter_distance2,
                          step.neighbors == Neighbors::all_pairs};
  const StepInput input{constants, step.ball, step.key, space, choose_search(world.boundary), step.draw};
  std::vector<CpuTally> tallies(team_.size());
  if (range == nullptr) {
    paired_.run(input, step.method, parcels_, tallies);
  } else {
    paired_.forget_positions();
    team_.run([&](unsigned thread) {
      CpuTally tally;
      const auto [begin, end] = team_.share(thread, parcels_.size());
      (this->*range)(input, begin, end, tally);
      tallies[thread] = tally;
    });
    std::swap(parcels_.current.position, parcels_.next.position);
    std::swap(parcels_.current.velocity, parcels_.next.velocity);
    std::swap(parcels_.current.is_heated, parcels_.next.is_heated);
  }
  CpuTally sum;
  for (const CpuTally& tally : tallies) sum.add(tally);
  return sum;
}

}  // namespace pf
