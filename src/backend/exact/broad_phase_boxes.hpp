// What the searches of disc_search.hpp share: discs and the boxes around them.
#pragma once

#include <cstdint>

#include "backend/exact/broad_phase.hpp"

namespace pf {

inline Vec2i centre_of(const Disc& disc) {
  return {static_cast<std::int32_t>(disc.x), static_cast<std::int32_t>(disc.y)};
}

inline std::int32_t reach_of(const Disc& disc, std::int32_t others) {
  return static_cast<std::int32_t>(disc.radius) + others;
}

// The ranges of candidates in the box around a disc that reaches `others` beyond it.
template <Boundary kBoundary>
void list_candidates(const DiscSpace& space, const Disc& disc, std::int32_t others, CandidateRanges& ranges) {
  if (space.all_pairs) return ranges.list_all(space.num_parcels);
  ranges.list<kBoundary>(space.grid, space.cell_start, centre_of(disc), reach_of(disc, others),
                         space.num_parcels);
}

inline float period(std::int32_t half) { return 2.0F * static_cast<float>(half); }

inline Disc disc_at(const DiscSpace& space, std::uint32_t i) {
  return {space.x[i], space.y[i], space.radius[i]};
}

}  // namespace pf
