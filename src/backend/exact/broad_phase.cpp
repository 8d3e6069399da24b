#include "backend/exact/broad_phase.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "backend/avx2.hpp"
#include "backend/exact/broad_phase_boxes.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

// Tests one disc against others, one at a time.
template <bool kImages>
struct PlainTest {
  const DiscSpace& space;
  Disc disc;

  static float nearest(float offset, float period) {
    return offset - period * std::nearbyint(offset * (1.0F / period));
  }
  float distance2(std::uint32_t j) const {
    float x = space.x[j] - disc.x, y = space.y[j] - disc.y;
    if constexpr (kImages) {
      x = nearest(x, period(space.world.half.x));
      y = nearest(y, period(space.world.half.y));
    }
    return x * x + y * y;
  }
  static bool is_within(float distance2, float radius) { return distance2 <= radius * radius; }
  bool overlaps(std::uint32_t j) const { return is_within(distance2(j), disc.radius + space.radius[j]); }
  // Reads atomically: other threads may claim parcels meanwhile.
  bool is_owned(std::uint32_t j) const {
    return std::atomic_ref<std::uint32_t>(const_cast<std::uint32_t&>(space.owner[j])).load() != kInvalidIndex;
  }
  bool may_touch(std::uint32_t j) const {
    return is_owned(j) && is_within(distance2(j), disc.radius + space.owned_radius);
  }
};

template <Boundary kBoundary>
void find_pairs_plainly(const DiscSpace& space, std::uint32_t begin, std::uint32_t end, DiscPairs& pairs) {
  pairs.candidates.clear();
  for (std::uint32_t i = begin; i < end; ++i) {
    const PlainTest<kBoundary == Boundary::periodic> test{space, disc_at(space, i)};
    if (std::isnan(test.disc.radius)) continue;
    list_candidates<kBoundary>(space, test.disc, space.reach, pairs.ranges);
    for (int r = 0; r < pairs.ranges.num; ++r) {
      const auto [first, last] = pairs.ranges.at[r];
      for (std::uint32_t j = std::max(first, i + 1); j < last; ++j) {
        if (test.overlaps(j)) pairs.candidates.push_back({i, j});
      }
    }
  }
}

template <Boundary kBoundary>
void find_candidates_plainly(const DiscSpace& space, const Mover& mover, Candidates& candidates) {
  const PlainTest<kBoundary == Boundary::periodic> test{space, mover.disc};
  candidates.overlapping.clear();
  candidates.owned.clear();
  list_candidates<kBoundary>(space, mover.disc, space.reach_owned, candidates.ranges);
  for (int r = 0; r < candidates.ranges.num; ++r) {
    const auto [first, last] = candidates.ranges.at[r];
    for (std::uint32_t j = first; j < last; ++j) {
      if (j == mover.index) continue;
      if (test.overlaps(j))
        candidates.overlapping.push_back(j);
      else if (test.may_touch(j))
        candidates.owned.push_back(j);
    }
  }
}

template <Boundary kBoundary>
void find_candidates_of_two_plainly(const DiscSpace& space, const Mover (&movers)[2],
                                    Candidates (&candidates)[2]) {
  for (int k = 0; k < 2; ++k) find_candidates_plainly<kBoundary>(space, movers[k], candidates[k]);
}

}  // namespace

std::int32_t reach_of(const ExactConstants& c, double speed_mps) {
  const double path = speed_mps * c.plan.units_per_tick * c.plan.length;
  return saturated_reach(0.5 * c.run.contact_distance * kDiscRelative + 2.0 * kDiscMargin +
                         path * kDiscRelative);
}

void set_reaches(const ExactConstants& c, double fastest_mps, std::int64_t max_displacement,
                 DiscSpace& space) {
  // A disc's centre is half a path away from the parcel's position at the step's start. That position differs
  // from the sorted one by at most max_displacement. An owned parcel may reach any speed up to the bound.
  const double longest_path =
      std::max(c.plan.max_speed_mps, fastest_mps) * c.plan.units_per_tick * c.plan.length;
  const double around = 0.5 * c.run.contact_distance * kDiscRelative + 2.0 * kDiscMargin;
  const auto since_sort = static_cast<double>(max_displacement);
  space.world = c.run.physics.world;
  space.reach = saturated_reach(reach_of(c, fastest_mps) + since_sort);
  space.reach_owned = saturated_reach(around + longest_path * kDiscRelative + since_sort);
  space.owned_radius = static_cast<float>(around + 1.5 * longest_path * kDiscRelative);
}

DiscSearch plain_disc_search(Boundary boundary) {
  return for_boundary(boundary, []<Boundary kBoundary>() {
    return DiscSearch{find_pairs_plainly<kBoundary>, find_candidates_plainly<kBoundary>,
                      find_candidates_of_two_plainly<kBoundary>};
  });
}

DiscSearch choose_disc_search(Boundary boundary) {
#if defined(__x86_64__)
  if (has_avx2()) return avx2_disc_search(boundary);
#endif
  return plain_disc_search(boundary);
}

}  // namespace pf
