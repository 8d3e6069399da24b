// Differences between GPU architectures, from Turing (7.5) on.
#pragma once

#include <cstdint>

namespace pf {

// Threads that a multiprocessor holds (CUDA C++ Programming Guide, technical specifications per compute
// capability).
#if !defined(__CUDA_ARCH__)
constexpr unsigned kThreadsPerSm = 2048;  // the host's pass, which ignores launch bounds
#elif __CUDA_ARCH__ == 750
constexpr unsigned kThreadsPerSm = 1024;
#elif (__CUDA_ARCH__ > 800 && __CUDA_ARCH__ < 900) || __CUDA_ARCH__ >= 1100
constexpr unsigned kThreadsPerSm = 1536;
#else
constexpr unsigned kThreadsPerSm = 2048;
#endif

// `wanted` blocks of `block` threads, or as many as fit: the compiler ignores launch bounds that cannot be
// met.
constexpr unsigned blocks_per_sm(unsigned wanted, unsigned block) {
  return wanted * block <= kThreadsPerSm ? wanted : kThreadsPerSm / block;
}

// Reductions over the 32 threads of a warp. All of them must call these, and all get the result. From Ampere
// (8.0) on each is one instruction, before that five exchanges.
template <class Combine>
__device__ inline std::uint32_t exchange_in_warp(std::uint32_t value, Combine combine) {
  for (int lane = 16; lane > 0; lane /= 2) value = combine(value, __shfl_xor_sync(0xFFFFFFFFU, value, lane));
  return value;
}

__device__ inline std::uint32_t warp_max(std::uint32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  return __reduce_max_sync(0xFFFFFFFFU, value);
#else
  return exchange_in_warp(value, [](std::uint32_t a, std::uint32_t b) { return a > b ? a : b; });
#endif
}

__device__ inline std::uint32_t warp_min(std::uint32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  return __reduce_min_sync(0xFFFFFFFFU, value);
#else
  return exchange_in_warp(value, [](std::uint32_t a, std::uint32_t b) { return a < b ? a : b; });
#endif
}

__device__ inline std::uint32_t warp_add(std::uint32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  return __reduce_add_sync(0xFFFFFFFFU, value);
#else
  return exchange_in_warp(value, [](std::uint32_t a, std::uint32_t b) { return a + b; });
#endif
}

}  // namespace pf
