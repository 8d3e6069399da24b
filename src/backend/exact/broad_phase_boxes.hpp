// Discs and the search boxes around them, shared by the searches of broad_phase.hpp.
#pragma once

#include <cstdint>

#include "backend/exact/broad_phase.hpp"

namespace pf {

inline Disc disc_at(const DiscSpace& space, std::uint32_t i) {
  return {space.x[i], space.y[i], space.radius[i]};
}

inline Vec2i centre_of(const Disc& disc) {
  return {static_cast<std::int32_t>(disc.x), static_cast<std::int32_t>(disc.y)};
}

// Half side of a search box that extends `beyond` a disc's radius.
inline std::int32_t half_side_of_box(const Disc& disc, std::int32_t beyond) {
  return static_cast<std::int32_t>(disc.radius) + beyond;
}

// Lists the ranges of parcels in a disc's search box.
template <Boundary kBoundary>
void list_candidates(const DiscSpace& space, const Disc& disc, std::int32_t beyond, CandidateRanges& ranges) {
  if (space.all_pairs) return ranges.list_all(space.num_parcels);
  ranges.list<kBoundary>(space.grid, space.cell_start, centre_of(disc), half_side_of_box(disc, beyond),
                         space.num_parcels);
}

inline float period(std::int32_t half) { return 2.0F * static_cast<float>(half); }

}  // namespace pf
