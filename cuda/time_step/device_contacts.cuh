// What the kernels of a step share.
#pragma once

#include "cuda/time_step/kernel.cuh"

namespace pf {

// Half side of the search box of every parcel.
__device__ inline std::int32_t search_reach(const StepConstants& c, std::int32_t displacement) {
  const long long reach = static_cast<long long>(c.contact_reach) + displacement;
  return static_cast<std::int32_t>(reach < kHalfSide ? reach : kHalfSide);
}

__device__ inline DeviceSums& sums_of(const ContactScratch& contacts, std::uint32_t i) {
  DeviceSums* part = contacts.part[0];
#pragma unroll
  for (unsigned k = 1; k < ContactScratch::kNumParts; ++k) {
    if (i < contacts.num_in_part) break;
    part = contacts.part[k];
    i -= contacts.num_in_part;
  }
  return part[i];
}

}  // namespace pf
