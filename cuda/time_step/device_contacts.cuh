// What the kernels of a step share.
#pragma once

#include "cuda/time_step/kernel.cuh"

namespace pf {

// Half side of the search box of every parcel. displacement: since the sort, 0 to kHalfSide.
__device__ inline std::int32_t search_reach(const StepConstants& c, std::int32_t displacement) {
  const std::uint32_t reach =
      static_cast<std::uint32_t>(c.contact_reach) + static_cast<std::uint32_t>(displacement);
  return static_cast<std::int32_t>(min(reach, static_cast<std::uint32_t>(kHalfSide)));
}

__device__ inline DeviceSums& sums_of(const ContactScratch& contacts, std::uint32_t i) {
  static_assert(ContactScratch::kNumParts == 4);
  const std::uint32_t num = contacts.num_in_part;
  const unsigned k = (i >= num) + (i >= 2 * num) + (i >= 3 * num);
  return contacts.part[k][i - k * num];
}

}  // namespace pf
