// Functions that the kernels of a step share.
#pragma once

#include "backend/draw_buffers.hpp"
#include "cuda/tally.cuh"
#include "cuda/time_step/kernel.cuh"
#include "model/contact.hpp"
#include "model/time_step.hpp"

namespace pf {

// Half side of the search box of every parcel. displacement: since the sort, 0 to kHalfSide.
__device__ inline std::int32_t search_reach(const StepConstants& c, std::int32_t displacement) {
  const std::uint32_t reach =
      static_cast<std::uint32_t>(c.contact_reach) + static_cast<std::uint32_t>(displacement);
  return static_cast<std::int32_t>(min(reach, static_cast<std::uint32_t>(kHalfSide)));
}

// Bound on displacements along an axis since the sort, position units; kHalfSide: parcels may be anywhere.
__device__ inline std::int32_t displacement_since_sort(const StepLaunch& launch) {
  const std::uint32_t bound = __ldg(launch.displaced.before_last) + __ldg(launch.displaced.in_last);
  return static_cast<std::int32_t>(min(bound, static_cast<std::uint32_t>(kHalfSide)));
}

// Notes it for the steps that follow before launch_end_steps. One thread of a step calls it.
__device__ inline void note_displacement(const StepLaunch& launch) {
  launch.state->displaced_before[launch.num_open] =
      static_cast<std::uint32_t>(displacement_since_sort(launch));
}

// Key of the random roundings of this step.
__device__ inline std::uint32_t key_of(const StepLaunch& launch) {
  return launch.state->rounding_key[launch.num_open];
}

// Adds the tallies of the threads to those of the step. All threads of a block call it.
__device__ inline void add_block(const StepLaunch& launch, const DeviceTally& tally, TallySlot& block) {
  std::uint32_t& displacement = launch.state->displacement[launch.num_open];
  std::uint32_t noted = 0;
  if (threadIdx.x == 0) noted = __ldcg(&displacement);  // on its way meanwhile
  reduce_warp(tally, block);
  __syncthreads();
  if (threadIdx.x != 0) return;
  add_slot(launch.slots[launch.num_open * kNumSlots + blockIdx.x % kNumSlots], block);
  const std::uint32_t displaced = min(block.max_displacement, static_cast<std::uint32_t>(kHalfSide));
  if (noted < displaced) atomicMax(&displacement, displaced);
}

// Values that are the same for all parcels of a step of one kernel.
struct OfStep {
  std::int32_t reach;  // see search_reach()
  std::uint32_t key;
};

// The first thread of a block calls it.
__device__ inline OfStep begin_block(const StepLaunch& launch, TallySlot& block_tally) {
  block_tally = {};
  if (blockIdx.x == 0) note_displacement(launch);
  return {search_reach(launch.constants, displacement_since_sort(launch)), key_of(launch)};
}

// For a sort in a step: counts a parcel in its cell, and once counts are summed returns its place. Whole
// warps call it.
__device__ inline std::uint32_t place_of(const StepLaunch& launch, Vec2i position, bool is_parcel) {
  return rank_in_cell(launch.sort.grid, launch.sort.places, cell_key(launch.sort.grid, position), is_parcel);
}

// These read or write a position or a velocity at once. id, is_heated: 0.
__device__ __forceinline__ Parcel motion_at(const ParcelPointers& parcels, std::uint32_t i) {
  const int2 position = reinterpret_cast<const int2*>(parcels.position)[i];
  const float2 velocity = reinterpret_cast<const float2*>(parcels.velocity)[i];
  return {{position.x, position.y}, {velocity.x, velocity.y}, 0};
}
// The id keeps its kGhostBit.
__device__ __forceinline__ Parcel parcel_with_bits(const ParcelPointers& parcels, std::uint32_t i) {
  Parcel parcel = motion_at(parcels, i);
  parcel.id = parcels.id[i];
  return parcel;
}
__device__ inline void store_at_once(Vec2i& to, Vec2i value) {
  reinterpret_cast<int2&>(to) = {value.x, value.y};
}
__device__ inline void store_at_once(Vec2f& to, Vec2f value) {
  reinterpret_cast<float2&>(to) = {value.x, value.y};
}

// If this step is drawn.
__device__ inline void draw_moved(const StepLaunch& launch, std::uint32_t place, const Parcel& after) {
  if (launch.draw.position_m != nullptr)
    draw_parcel(launch.draw, launch.constants.physics.world, place, after.position, after.velocity);
}

// Writes a parcel to its place in a step that sorts, and draws it.
__device__ inline void put_in_place(const StepLaunch& launch, std::uint32_t place, const Parcel& after) {
  store_at_once(launch.to.position[place], after.position);
  store_at_once(launch.to.velocity[place], after.velocity);
  launch.to.id[place] = after.id;
  if (after.is_heated != 0) set_heated(launch.to, place, 1);
  draw_moved(launch, place, after);
}

// Counts parcel i, and clears the words in which the step will set bits.
__device__ inline void prepare_sort(const StepLaunch& launch, std::uint32_t i) {
  const bool is_parcel = i < launch.num;
  if (i % 32 == 0 && is_parcel) launch.to.heated[i / 32] = 0;
  place_of(launch, is_parcel ? launch.from.position[i] : Vec2i{}, is_parcel);
}

// A bit of a word for each parcel.
__device__ inline std::uint32_t bit_of(std::uint32_t i) { return 1U << (i % 32); }

__device__ inline bool has_bit(const std::uint32_t* words, std::uint32_t i) {
  return (words[i / 32] & bit_of(i)) != 0;
}

// Sums of a parcel between two sorts.
__device__ inline DeviceSums& sums_of(const ContactScratch& contacts, std::uint32_t i) {
  return contacts.part[i % ContactScratch::kNumParts][i / ContactScratch::kNumParts];
}

// For the next step, once the contacts of this one are summed.
__device__ inline void clear_pool(const ContactScratch& contacts) {
  if (blockIdx.x == 0 && threadIdx.x == 0) *contacts.num_pooled = 0;
}

__device__ inline ContactSums as_sums(const DeviceSums& sums) {
  constexpr unsigned kHighBits = 64 - kCountShift;
  const std::int64_t push_x = static_cast<std::int64_t>(sums.counted_push_x << kHighBits) >> kHighBits;
  const std::uint64_t count = (sums.counted_push_x - static_cast<std::uint64_t>(push_x)) >> kCountShift;
  return {static_cast<std::int64_t>(sums.velocity_x), static_cast<std::int64_t>(sums.velocity_y), push_x,
          static_cast<std::int64_t>(sums.push_y), static_cast<std::uint8_t>(count)};
}

__device__ inline void clear_touched(const ContactScratch& contacts, std::uint32_t list) {
  reinterpret_cast<uint4*>(contacts.touched)[list] = {};
  reinterpret_cast<uint4*>(contacts.touched_again)[list] = {};
}

// A word for each 32 parcels of a list.
__device__ inline uint4 words_of_list(const std::uint32_t* words, std::uint32_t list) {
  static_assert(kPairList == 128, "four words");
  return reinterpret_cast<const uint4*>(words)[list];
}

__device__ inline std::uint32_t word_of(const uint4& words, std::uint32_t i) {
  const std::uint32_t low = (i & 32) == 0 ? words.x : words.y, high = (i & 32) == 0 ? words.z : words.w;
  return (i & 64) == 0 ? low : high;
}

__device__ inline bool has_bit(const uint4& words, std::uint32_t i) {
  return (word_of(words, i) & bit_of(i)) != 0;
}

// The sums of a parcel that touches another one, in a step that sorts; null: there is no room for them.
// touched: the words of its list.
__device__ inline DeviceSums* few_sums_of(const ContactScratch& contacts, std::uint32_t i,
                                          const uint4& touched) {
  const unsigned word = i / 32 % 4;
  const std::uint32_t own = word_of(touched, i);
  int before = __popc(own & (bit_of(i) - 1));
  if (word > 0) before += __popc(touched.x);
  if (word > 1) before += __popc(touched.y);
  if (word > 2) before += __popc(touched.z);
  constexpr unsigned kFew = ContactScratch::kFewSums;
  return static_cast<unsigned>(before) < kFew ? contacts.few + i / kPairList * kFew + before : nullptr;
}

__device__ inline Parcel parcel_at(const StepLaunch& launch, std::uint32_t i) {
  const ParcelPointers& parcels = launch.from;
  return {parcels.position[i], parcels.velocity[i], parcels.id[i] & kIdBits, is_heated(parcels, i)};
}

// Returns whether two parcels of a thin periodic world see each other in the same direction, half a period
// away.
template <Boundary kBoundary>
__device__ bool is_half_around(const World& world, Vec2i offset) {
  return kBoundary == Boundary::periodic && (offset.x == -world.half.x || offset.y == -world.half.y);
}

// Returns whether what one of two parcels gains in their contact the other loses, to the bit: all that is
// computed then changes its sign with the side that it is seen from.
template <Boundary kBoundary>
__device__ bool is_same_from_both(const World& world, Vec2i offset) {
  return offset != Vec2i{} && !is_half_around<kBoundary>(world, offset);
}

// Adds the contact of parcel i with parcel j, seen from i alone, if they touch.
template <class Contact, Boundary kBoundary>
__device__ inline void touch_from(const StepLaunch& launch, const Parcel& self, std::uint32_t j,
                                  ContactSums& sums, DeviceTally& tally) {
  const Parcel other = parcel_at(launch, j);
  add_contact<Contact>(launch.constants, self, other,
                       separation<kBoundary>(launch.constants.physics.world, self.position, other.position),
                       sums, tally);
}

}  // namespace pf
