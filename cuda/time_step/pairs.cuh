// The search for pairs of parcels that touch, and the lists of them.
#pragma once

#include "cuda/time_step/device_contacts.cuh"

namespace pf {

static_assert(kReadTogether - 1 <= kReadBeyond);

__device__ inline bool is_ghost(const StepLaunch& launch, std::uint32_t i) {
  return (launch.from.id[i] & kGhostBit) != 0;
}

// Returns whether parcels with an x from low_x to high_x neither are ghosts nor touch one.
__device__ inline bool is_without_ghosts(const StepLaunch& launch, std::int32_t low_x, std::int32_t high_x) {
  return low_x >= launch.low_without_ghosts && high_x <= launch.high_without_ghosts;
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
  const bool is_inside = is_without_ghosts(launch, centre.x, centre.x);
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
  static constexpr bool kReadOnly = true;

  const SearchCircle& first;
  float to_second_x, to_second_y;

  __device__ __forceinline__ std::uint32_t own(unsigned n) const { return first.self + n; }

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

// For parcels that come later in that order.
struct TwoCirclesLater : TwoCircles {
  static constexpr unsigned kFirstLeftOut = 1;
  static constexpr int kRows = 2;
  static constexpr bool kWholeWarps = false;

  __device__ __forceinline__ std::uint32_t begin() const { return own(1); }
  __device__ __forceinline__ std::uint32_t skip(std::uint32_t from) const { return max(from, own(1)); }
};

// Threads of a block whose parcels' contacts are worked off together.
constexpr unsigned kSharingBlock = 128;

// The first parcel to look at, of a range from `first` on, around parcel i, and maybe those that follow in
// the same thread. If it is of the block these are what comes after i: earlier ones find it.
template <unsigned kPerThread>
__device__ __forceinline__ std::uint32_t skip_earlier_of_block(std::uint32_t first, std::uint32_t i) {
  const std::uint32_t before = threadIdx.x * kPerThread;  // the block's parcels before i
  return first - (i - before) <= before ? i + 1 : first;
}

// For all parcels but those of the block that are skipped so. Three rows are one loop: `spring` makes 32.2
// Gps of a gas of 10^7, with two 30.1.
struct TwoCirclesOfBlock : TwoCircles {
  static constexpr unsigned kFirstLeftOut = 0;
  static constexpr int kRows = 3;
  static constexpr bool kWholeWarps = true;

  __device__ __forceinline__ std::uint32_t skip(std::uint32_t from) const {
    return skip_earlier_of_block<2>(from, first.self);
  }
};

// The same with one parcel to a thread. It may be visited itself: few are in a range.
struct OneCircleOfBlock {
  static constexpr unsigned kNum = 1, kFirstLeftOut = 1;
  static constexpr int kRows = 3;
  static constexpr bool kReadOnly = true;
  static constexpr bool kWholeWarps = true;

  const SearchCircle& circle;

  __device__ __forceinline__ std::uint32_t own(unsigned) const { return circle.self; }
  __device__ __forceinline__ std::uint32_t skip(std::uint32_t from) const {
    return skip_earlier_of_block<1>(from, circle.self);
  }
  __device__ __forceinline__ void shift_in(const DeviceSearch& space, int2 there,
                                           std::uint32_t (&near)[kNum]) const {
    OneCircle<Boundary::open, kRows, true>{circle}.shift_in(space, there, near);  // the box crosses no edge
  }
};

// Two parcels are searched around at once if they are at most so far apart along either axis: the reach of
// the search, but no more than kMaxReachOfTwo reaches of contacts, and kMaxApart of these more. Pairs farther
// apart, as at the end of a row of cells, are searched one by one and delay a whole warp; but from about 29
// on offsets as floats would be less exact than the margin of the filter.
constexpr std::uint32_t kMaxApart = 8, kMaxReachOfTwo = 12;
constexpr std::uint32_t kMaxContact = 1U << 26;  // so that the sum stays below 2^31
static_assert(std::uint64_t{kMaxApart + kMaxReachOfTwo} * kMaxContact < (1ULL << 31));

// Two parcels that follow each other in the order of the sort, and the search around each.
struct TwoParcels {
  SearchCircle first;
  Vec2i second;         // its position
  SearchBounds bounds;  // of both positions
  bool are_together;    // can be searched around at once

  // Of the search around both; some box or other if they are not together.
  __device__ __forceinline__ SearchBounds box() const {
    const std::int32_t reach = first.reach;
    return {wrapping_sum(bounds.low_x, -reach), wrapping_sum(bounds.high_x, reach),
            wrapping_sum(bounds.low_y, -reach), wrapping_sum(bounds.high_y, reach)};
  }
  __device__ __forceinline__ TwoCircles circles() const {
    return {first, static_cast<float>(second.x - first.centre.x),
            static_cast<float>(second.y - first.centre.y)};
  }
};

// Parcels i and i + 1, if there are both. i: even.
__device__ __forceinline__ int4 positions_of_two(const StepLaunch& launch, std::uint32_t i) {
  return i + 1 < launch.num ? __ldg(reinterpret_cast<const int4*>(launch.from.position + i)) : int4{};
}

// reach: half side of the search box of each.
template <Boundary kBoundary>
__device__ __forceinline__ TwoParcels two_parcels(const StepLaunch& launch, std::uint32_t i, int4 positions,
                                                  std::int32_t reach) {
  const Vec2i one{positions.x, positions.y}, two{positions.z, positions.w};
  TwoParcels parcels{{one, i, reach, launch.constants.filter_distance2}, two, {}, false};
  parcels.bounds = {min(one.x, two.x), max(one.x, two.x), min(one.y, two.y), max(one.y, two.y)};
  const SearchBounds& at = parcels.bounds;
  const std::uint32_t apart =
      max(static_cast<std::uint32_t>(at.high_x) - static_cast<std::uint32_t>(at.low_x),
          static_cast<std::uint32_t>(at.high_y) - static_cast<std::uint32_t>(at.low_y));
  const std::uint32_t contact = min(static_cast<std::uint32_t>(launch.constants.contact_reach), kMaxContact);
  const std::uint32_t max_apart =
      min(static_cast<std::uint32_t>(reach), kMaxReachOfTwo * contact) + kMaxApart * contact;
  const bool are_near = i + 1 < launch.num && !is_retired(one) && !is_retired(two) &&
                        !launch.space.all_pairs && reach < kHalfSide && apart <= max_apart;
  parcels.are_together = are_near && !crosses_edge<kBoundary>(launch.space.world, parcels.box());
  return parcels;
}

// Calls visit(i, j) and visit(i + 1, j) for the pairs of both parcels as visit_pairs() does, by one search.
// Returns false, with none visited, if they have to be searched around one by one. Within the float's margin
// it may find other pairs than visit_pairs(): all kernels of a step must use the same of the two.
template <Boundary kBoundary, class Visit>
__device__ __forceinline__ bool visit_pairs_of_two(const StepLaunch& launch, std::uint32_t i, Visit visit) {
  const std::int32_t displacement = displacement_since_sort(launch);  // on its way with the positions
  const int4 positions = positions_of_two(launch, i);
  const TwoParcels two =
      two_parcels<kBoundary>(launch, i, positions, search_reach(launch.constants, displacement));
  if (!two.are_together) return false;
  const bool are_inside = is_without_ghosts(launch, two.bounds.low_x, two.bounds.high_x);
  SearchBounds box = two.box();
  box.low_y = two.bounds.high_y - displacement;  // those that come later were in no row before that of either
  search_box(launch.space, launch.from.position, TwoCirclesLater{two.circles()}, box, true,
             [&](unsigned n, std::uint32_t j) {
               if (are_inside || !(is_ghost(launch, i + n) || is_ghost(launch, j))) visit(i + n, j);
             });
  return true;
}

// Calls visit(n, j) for each parcel j that touches parcel i + n, 0 <= n < kPerThread, within the float's
// margin. It leaves out j < i of the same block, most of them, and may visit j = i + n. Whole warps call it.
// Returns false, with none visited, if the thread's parcels have to be searched around one by one.
template <unsigned kPerThread, Boundary kBoundary, class Visit>
__device__ __forceinline__ bool visit_partners(const StepLaunch& launch, std::uint32_t i, std::int32_t reach,
                                               Visit visit) {
  if constexpr (kPerThread == 2) {
    const TwoParcels two = two_parcels<kBoundary>(launch, i, positions_of_two(launch, i), reach);
    search_box(launch.space, launch.from.position, TwoCirclesOfBlock{two.circles()}, two.box(),
               two.are_together, visit);
    return two.are_together;
  } else {
    int2 position{};
    if (i < launch.num) position = __ldg(reinterpret_cast<const int2*>(launch.from.position) + i);
    const Vec2i centre{position.x, position.y};
    const SearchCircle circle{centre, i, reach, launch.constants.filter_distance2};
    SearchBounds box{};
    bool searches = i < launch.num && !is_retired(centre) && reach < kHalfSide;
    if (searches) {
      box = {centre.x - reach, centre.x + reach, centre.y - reach, centre.y + reach};
      searches = !crosses_edge<kBoundary>(launch.space.world, box);
    }
    search_box(launch.space, launch.from.position, OneCircleOfBlock{circle}, box, searches, visit);
    return searches;
  }
}

}  // namespace pf
