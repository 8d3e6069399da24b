// Half a warp: 16 threads that work on one parcel, while the other half works on another.
#pragma once

namespace pf {

constexpr unsigned kHalfWarp = 16;

// The lanes of the caller's half for which it holds, as bits. Whole warps call it.
__device__ __forceinline__ unsigned in_half_warp(bool holds) {
  return __ballot_sync(0xFFFFFFFFU, holds) >> (threadIdx.x & kHalfWarp) & 0xFFFFU;
}

}  // namespace pf
