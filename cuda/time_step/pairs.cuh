// The search for pairs of parcels that touch, and the lists of them.
#pragma once

#include "cuda/time_step/device_contacts.cuh"

namespace pf {

static_assert(kReadTogether - 1 <= kReadBeyond);

__device__ inline bool is_ghost(const StepLaunch& launch, std::uint32_t i) {
  return (launch.from.id[i] & kGhostBit) != 0;
}

__device__ inline bool is_without_ghosts(const StepLaunch& launch, Vec2i position) {
  return position.x >= launch.low_without_ghosts && position.x < launch.high_without_ghosts;
}

// Number of parcels that are searched around.
template <bool kBorders>
__device__ std::uint32_t num_searched(const StepLaunch& launch) {
  return kBorders ? launch.num_near : launch.num;
}

// Number of these parcels that a list is for, which is also its largest number of pairs.
template <bool kBorders>
__device__ std::uint32_t list_size(const StepLaunch& launch, std::uint32_t list) {
  return min(kPairList, num_searched<kBorders>(launch) - list * kPairList);
}

// Calls visit(i, j) for each pair that touches, once: those of the k-th parcel i. Without kBorders pairs of
// own parcels, j after i; with it pairs of an own parcel near others' and a ghost. They are within the
// float's margin of touching.
template <bool kBorders, Boundary kBoundary, class Visit>
__device__ __forceinline__ void visit_pairs(const StepLaunch& launch, std::uint32_t k, Visit visit) {
  const std::uint32_t i = kBorders ? launch.near[k] : k;
  const Vec2i* position = launch.from.position;
  const std::int32_t displacement = displacement_since_sort(launch);  // on its way with the position
  const int2 there = __ldg(reinterpret_cast<const int2*>(position) + i);
  const Vec2i centre{there.x, there.y};
  if (is_retired(centre)) return;
  const bool is_inside = is_without_ghosts(launch, centre);
  if (kBorders && is_inside) return;
  const SearchCircle circle{centre, i, search_reach(launch.constants, displacement),
                            launch.constants.filter_distance2};
  if constexpr (kBorders) {
    search<kBoundary, true>(launch.space, position, circle, [&](std::uint32_t j) {
      if (is_ghost(launch, j)) visit(i, j);
    });
  } else {
    search_later<kBoundary>(launch.space, position, circle, displacement, [&](std::uint32_t j) {
      if (is_inside || !(is_ghost(launch, i) || is_ghost(launch, j))) visit(i, j);
    });
  }
}

// Two circles of one radius, around parcels that follow each other in the order of the sort.
struct TwoCircles {
  static constexpr unsigned kNum = 2;
  const SearchCircle& first;
  float to_second_x, to_second_y;

  __device__ __forceinline__ std::uint32_t second() const { return first.self + 1; }

  // As OneCircle::shift_in(). The second circle costs five instructions.
  __device__ __forceinline__ void shift_in(const DeviceSearch& space, int2 there,
                                           std::uint32_t (&near)[kNum]) const {
    // Also in a periodic world, since the box crosses no edge.
    const Vec2i offset = separation<Boundary::open>(space.world, first.centre, {there.x, there.y});
    const auto x = static_cast<float>(offset.x), y = static_cast<float>(offset.y);
    const float past_first = past_radius(x, y, first.radius2);
    const float past_second = past_radius(x - to_second_x, y - to_second_y, first.radius2);
    near[0] = __funnelshift_l(__float_as_uint(past_first), near[0], 1);
    near[1] = __funnelshift_l(__float_as_uint(past_second), near[1], 1);
  }
};

// Two parcels are searched around at once if they are at most so far apart along either axis: the reach of
// the search, but no more than kMaxReachOfTwo reaches of contacts, and kMaxApart of these more. Pairs farther
// apart, as at the end of a row of cells, are searched one by one and delay a whole warp; but from about 29
// on offsets as floats would be less exact than the margin of the filter.
constexpr std::uint32_t kMaxApart = 8, kMaxReachOfTwo = 12;
constexpr std::uint32_t kMaxContact = 1U << 26;  // so that the sum stays below 2^31
static_assert(std::uint64_t{kMaxApart + kMaxReachOfTwo} * kMaxContact < (1ULL << 31));

// Calls visit(i, j) and visit(i + 1, j) for the pairs of both parcels as visit_pairs() does, by one search.
// Returns false, with none visited, if they have to be searched around one by one. Within the float's margin
// it may find other pairs than visit_pairs(): all kernels of a step must use the same of the two.
template <Boundary kBoundary, class Visit>
__device__ __forceinline__ bool visit_pairs_of_two(const StepLaunch& launch, std::uint32_t i, Visit visit) {
  const std::int32_t displacement = displacement_since_sort(launch);  // on its way with the positions
  const bool are_two = i + 1 < launch.num;
  int4 there{};
  if (are_two) there = __ldg(reinterpret_cast<const int4*>(launch.from.position + i));
  const Vec2i one{there.x, there.y}, two{there.z, there.w};
  const SearchCircle circle{one, i, search_reach(launch.constants, displacement),
                            launch.constants.filter_distance2};
  const std::int32_t reach = circle.reach, low_x = min(one.x, two.x), high_x = max(one.x, two.x),
                     low_y = min(one.y, two.y), high_y = max(one.y, two.y);
  const std::uint32_t apart = max(static_cast<std::uint32_t>(high_x) - static_cast<std::uint32_t>(low_x),
                                  static_cast<std::uint32_t>(high_y) - static_cast<std::uint32_t>(low_y));
  const std::uint32_t contact = min(static_cast<std::uint32_t>(launch.constants.contact_reach), kMaxContact);
  const std::uint32_t max_apart =
      min(static_cast<std::uint32_t>(reach), kMaxReachOfTwo * contact) + kMaxApart * contact;
  if (!are_two || is_retired(one) || is_retired(two) || launch.space.all_pairs || reach >= kHalfSide ||
      apart > max_apart)
    return false;
  if (crosses_edge<kBoundary>(launch.space.world,
                              {low_x - reach, high_x + reach, low_y - reach, high_y + reach}))
    return false;
  const bool are_inside = is_without_ghosts(launch, one) && is_without_ghosts(launch, two);
  // Those that come later were in no row before that of either.
  search_box(launch.space, launch.from.position,
             TwoCircles{circle, static_cast<float>(two.x - one.x), static_cast<float>(two.y - one.y)},
             {low_x - reach, high_x + reach, high_y - displacement, high_y + reach}, i + 1,
             [&](unsigned n, std::uint32_t j) {
               if (are_inside || !(is_ghost(launch, i + n) || is_ghost(launch, j))) visit(i + n, j);
             });
  return true;
}

}  // namespace pf
