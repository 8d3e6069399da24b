// The part of CUDA that the sources of cuda/ use, on a CPU. Device memory is memory of the host; streams do
// their work at once. The device is called "CPU" and has two multiprocessors.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <type_traits>

#include "kernels_on_cpu/fibers.hpp"

// ---- the language

#define __global__
#define __device__
#define __host__
#define __shared__ static thread_local  // of the block, which a thread of the CPU runs
#define __forceinline__ inline
#define __noinline__
#define __launch_bounds__(...)
#define __grid_constant__

struct uint3 {
  unsigned x = 0, y = 0, z = 0;
};
struct alignas(16) uint4 {
  unsigned x, y, z, w;
};
struct int2 {
  int x, y;
};
struct float2 {
  float x, y;
};
struct alignas(16) float4 {
  float x, y, z, w;
};
struct alignas(16) int4 {
  int x, y, z, w;
};
struct uint2 {
  unsigned x, y;
};
struct dim3 {
  unsigned x, y, z;
  constexpr dim3(unsigned in_x = 1, unsigned in_y = 1, unsigned in_z = 1) : x(in_x), y(in_y), z(in_z) {}
};
inline thread_local uint3 threadIdx, blockIdx;
inline thread_local dim3 blockDim, gridDim;

// ---- barriers and exchanges within a warp, all of whose threads take part

inline void __syncthreads() { kernels_on_cpu::wait_for_block(); }
inline void __syncwarp(unsigned = ~0U) { kernels_on_cpu::wait_for_warp(); }
inline void __barrier_sync_count(unsigned barrier, unsigned num_threads) {
  kernels_on_cpu::wait_for_some(barrier, num_threads);
}

namespace kernels_on_cpu {

// Calls read(values), with a value of each lane. Returns its result.
template <class Read>
auto exchange(std::uint64_t value, Read read) {
  std::uint64_t* values = values_of_warp();  // others than those of the next exchange
  values[threadIdx.x % 32] = value;
  wait_for_warp();
  return read(values);
}

template <class To, class From>
To bits_of(From from) {
  static_assert(sizeof(From) <= sizeof(To) || sizeof(To) <= 8);
  To to{};
  std::memcpy(&to, &from, std::min(sizeof(To), sizeof(From)));
  return to;
}

template <class T>
T from_lane(T value, unsigned lane) {
  static_assert(sizeof(T) <= 8);
  const auto of_lane = [=](const std::uint64_t* values) { return values[lane]; };
  return bits_of<T>(exchange(bits_of<std::uint64_t>(value), of_lane));
}

// A bit for each lane whose value is equal to this one.
inline unsigned lanes_with(std::uint64_t value, std::uint64_t wanted) {
  return exchange(value, [=](const std::uint64_t* values) {
    unsigned lanes = 0;
    for (unsigned lane = 0; lane < 32; ++lane) lanes |= values[lane] == wanted ? 1U << lane : 0U;
    return lanes;
  });
}

}  // namespace kernels_on_cpu

inline unsigned __ballot_sync(unsigned, bool holds) { return kernels_on_cpu::lanes_with(holds ? 1 : 0, 1); }
inline int __any_sync(unsigned all, bool holds) { return __ballot_sync(all, holds) != 0; }
inline int __all_sync(unsigned all, bool holds) { return __ballot_sync(all, holds) == ~0U; }
inline unsigned __match_any_sync(unsigned, unsigned value) {
  return kernels_on_cpu::lanes_with(value, value);
}
inline int __syncthreads_or(int holds) {
  static thread_local int any;
  if (threadIdx.x == 0) any = 0;
  __syncthreads();
  any |= holds;
  __syncthreads();
  const int result = any;
  __syncthreads();
  return result;
}

template <class T>
T __shfl_sync(unsigned, T value, int lane, int width = 32) {
  const int here = static_cast<int>(threadIdx.x % 32);
  return kernels_on_cpu::from_lane(value, static_cast<unsigned>(here / width * width + lane % width));
}
template <class T>
T __shfl_up_sync(unsigned, T value, unsigned distance, int width = 32) {
  const unsigned here = threadIdx.x % 32, in_part = here % static_cast<unsigned>(width);
  return kernels_on_cpu::from_lane(value, in_part >= distance ? here - distance : here);
}
template <class T>
T __shfl_xor_sync(unsigned, T value, int mask, int = 32) {
  return kernels_on_cpu::from_lane(value, (threadIdx.x % 32) ^ static_cast<unsigned>(mask));
}

// ---- memory

template <class T, class Value>
T atomicAdd(T* to, Value value) {
  return __atomic_fetch_add(to, static_cast<T>(value), __ATOMIC_SEQ_CST);
}
template <class T, class Value>
T atomicOr(T* to, Value value) {
  return __atomic_fetch_or(to, static_cast<T>(value), __ATOMIC_SEQ_CST);
}
template <class T, class Value>
T atomicAnd(T* to, Value value) {
  return __atomic_fetch_and(to, static_cast<T>(value), __ATOMIC_SEQ_CST);
}
template <class T, class Value>
T atomicExch(T* to, Value value) {
  return __atomic_exchange_n(to, static_cast<T>(value), __ATOMIC_SEQ_CST);
}
template <class T, class Expected, class Value>
T atomicCAS(T* to, Expected expected, Value value) {
  T found = static_cast<T>(expected);
  __atomic_compare_exchange_n(to, &found, static_cast<T>(value), false, __ATOMIC_SEQ_CST, __ATOMIC_SEQ_CST);
  return found;
}
template <class T, class Value>
T atomicMax(T* to, Value value) {
  T found = __atomic_load_n(to, __ATOMIC_SEQ_CST);
  while (found < static_cast<T>(value) &&
         !__atomic_compare_exchange_n(to, &found, static_cast<T>(value), false, __ATOMIC_SEQ_CST,
                                      __ATOMIC_SEQ_CST)) {
  }
  return found;
}
template <class T, class Value>
T atomicMin(T* to, Value value) {
  T found = __atomic_load_n(to, __ATOMIC_SEQ_CST);
  while (static_cast<T>(value) < found &&
         !__atomic_compare_exchange_n(to, &found, static_cast<T>(value), false, __ATOMIC_SEQ_CST,
                                      __ATOMIC_SEQ_CST)) {
  }
  return found;
}
inline void __threadfence() { __atomic_thread_fence(__ATOMIC_SEQ_CST); }
template <class T>
T __ldg(const T* from) {
  return *from;
}
template <class T>
T __ldcg(const T* from) {
  return *from;
}

// ---- arithmetic

inline int __popc(unsigned value) { return __builtin_popcount(value); }
inline int __ffs(int value) { return __builtin_ffs(value); }
inline int __clz(int value) { return value == 0 ? 32 : __builtin_clz(static_cast<unsigned>(value)); }
inline unsigned __funnelshift_l(unsigned low, unsigned high, unsigned shift) {
  shift %= 32;
  return shift == 0 ? high : high << shift | low >> (32 - shift);
}
inline float __uint_as_float(unsigned value) { return kernels_on_cpu::bits_of<float>(value); }
inline unsigned __float_as_uint(float value) { return kernels_on_cpu::bits_of<unsigned>(value); }
inline float __fmaf_rn(float a, float b, float c) { return std::fma(a, b, c); }
template <class A, class B>
constexpr std::common_type_t<A, B> min(A a, B b) {
  using T = std::common_type_t<A, B>;
  return static_cast<T>(a) < static_cast<T>(b) ? static_cast<T>(a) : static_cast<T>(b);
}
template <class A, class B>
constexpr std::common_type_t<A, B> max(A a, B b) {
  using T = std::common_type_t<A, B>;
  return static_cast<T>(a) > static_cast<T>(b) ? static_cast<T>(a) : static_cast<T>(b);
}

// ---- the host's side

enum cudaError_t {
  cudaSuccess,
  cudaErrorInsufficientDriver,
  cudaErrorGraphExecUpdateFailure,
  cudaErrorNoKernelImageForDevice,
  cudaErrorNotReady,
  cudaErrorPeerAccessAlreadyEnabled,
  cudaErrorStreamCaptureUnsupported,
  cudaErrorUnsupportedPtxVersion
};
#define CUDART_VERSION 12030
inline cudaError_t cudaGetLastError() { return cudaSuccess; }
inline const char* cudaGetErrorString(cudaError_t) { return ""; }
inline const char* cudaGetErrorName(cudaError_t) { return ""; }

using cudaStream_t = void*;
constexpr unsigned cudaStreamNonBlocking = 1;
inline cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned) {
  *stream = nullptr;
  return cudaSuccess;
}
inline cudaError_t cudaStreamCreateWithPriority(cudaStream_t* stream, unsigned flags, int) {
  return cudaStreamCreateWithFlags(stream, flags);
}
inline cudaError_t cudaDeviceGetStreamPriorityRange(int* lowest, int* highest) {
  *lowest = *highest = 0;
  return cudaSuccess;
}
inline cudaError_t cudaStreamDestroy(cudaStream_t) { return cudaSuccess; }

#include "kernels_on_cpu/graphs.hpp"

inline cudaError_t cudaStreamSynchronize(cudaStream_t) { return kernels_on_cpu::only_now(); }

// New memory holds no zeros.
template <class T>
cudaError_t cudaMalloc(T** memory, std::size_t num_bytes) {
  *memory = static_cast<T*>(std::malloc(std::max<std::size_t>(num_bytes, 1)));
  std::memset(static_cast<void*>(*memory), 0xA5, num_bytes);
  return cudaSuccess;
}
template <class T>
cudaError_t cudaMallocHost(T** memory, std::size_t num_bytes) {
  return cudaMalloc(memory, num_bytes);
}
inline cudaError_t cudaFree(void* memory) {
  std::free(memory);
  return cudaSuccess;
}
inline cudaError_t cudaFreeHost(void* memory) { return cudaFree(memory); }
inline cudaError_t cudaMemsetAsync(void* to, int value, std::size_t num_bytes, cudaStream_t) {
  kernels_on_cpu::now_or_later(cudaGraphNodeTypeMemset, [=] { std::memset(to, value, num_bytes); });
  return cudaSuccess;
}
enum cudaMemcpyKind { cudaMemcpyDeviceToHost, cudaMemcpyHostToDevice, cudaMemcpyDeviceToDevice };
inline cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t num_bytes, cudaMemcpyKind,
                                   cudaStream_t) {
  std::memmove(to, from, num_bytes);
  return kernels_on_cpu::only_now();
}
inline cudaError_t cudaMemcpy(void* to, const void* from, std::size_t num_bytes, cudaMemcpyKind kind) {
  return cudaMemcpyAsync(to, from, num_bytes, kind, nullptr);
}
inline cudaError_t cudaMemcpyPeerAsync(void* to, int, const void* from, int, std::size_t num_bytes,
                                       cudaStream_t stream) {
  return cudaMemcpyAsync(to, from, num_bytes, cudaMemcpyDeviceToDevice, stream);
}
inline cudaError_t cudaMemcpyPeer(void* to, int, const void* from, int, std::size_t num_bytes) {
  return cudaMemcpyPeerAsync(to, 0, from, 0, num_bytes, nullptr);
}

using cudaEvent_t = std::chrono::steady_clock::time_point*;
inline cudaError_t cudaEventCreate(cudaEvent_t* event) {
  *event = new std::chrono::steady_clock::time_point;
  return cudaSuccess;
}
constexpr unsigned cudaEventDisableTiming = 2;
inline cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned) { return cudaEventCreate(event); }
inline cudaError_t cudaEventQuery(cudaEvent_t) { return cudaSuccess; }
inline cudaError_t cudaStreamWaitEvent(cudaStream_t, cudaEvent_t, unsigned) { return cudaSuccess; }
inline cudaError_t cudaEventDestroy(cudaEvent_t event) {
  delete event;
  return cudaSuccess;
}
inline cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t) {
  *event = std::chrono::steady_clock::now();
  return kernels_on_cpu::only_now();
}
inline cudaError_t cudaEventSynchronize(cudaEvent_t) { return cudaSuccess; }
inline cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t begin, cudaEvent_t end) {
  *ms = std::chrono::duration<float, std::milli>(*end - *begin).count();
  return cudaSuccess;
}

struct cudaUUID_t {
  char bytes[16];
};
struct cudaDeviceProp {
  char name[256] = "CPU";
  cudaUUID_t uuid{};
  int multiProcessorCount = 2, major = 9, minor = 0;
};
inline cudaError_t cudaGetDeviceCount(int* num) {
  *num = 1;
  return cudaSuccess;
}
inline cudaError_t cudaDriverGetVersion(int* version) {
  *version = CUDART_VERSION;
  return cudaSuccess;
}
inline cudaError_t cudaGetDevice(int* device) {
  *device = 0;
  return cudaSuccess;
}
inline cudaError_t cudaSetDevice(int) { return cudaSuccess; }
inline cudaError_t cudaDeviceCanAccessPeer(int* can_access, int, int) {
  *can_access = 1;
  return cudaSuccess;
}
inline cudaError_t cudaDeviceEnablePeerAccess(int, unsigned) { return cudaSuccess; }
inline cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int) {
  *properties = {};
  return cudaSuccess;
}
enum cudaDeviceAttr { cudaDevAttrMultiProcessorCount };
inline cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr, int) {
  *value = cudaDeviceProp{}.multiProcessorCount;
  return cudaSuccess;
}
inline cudaError_t cudaMemGetInfo(std::size_t* free_bytes, std::size_t* all_bytes) {
  *free_bytes = *all_bytes = std::size_t{4} << 30;
  return cudaSuccess;
}
struct cudaFuncAttributes {
  int ptxVersion = 90, binaryVersion = 90;
};
template <class Kernel>
cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, Kernel) {
  *attributes = {};
  return cudaSuccess;
}
// A block, so that a cooperative launch has as many threads of the CPU as there are multiprocessors.
template <class Kernel>
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessor(int* num_blocks, Kernel, int, std::size_t) {
  *num_blocks = 1;
  return cudaSuccess;
}

// ---- launches, as rewrite.py writes them

namespace kernels_on_cpu {

// kernel<<<grid, block, 0, stream>>>(arguments)
template <class... Parameters>
void launch(dim3 grid, unsigned block, unsigned, cudaStream_t, void (*kernel)(Parameters...),
            const std::type_identity_t<Parameters>&... arguments) {
  now_or_later(cudaGraphNodeTypeKernel, [=] {
    run({grid.x, grid.y}, block, false, [&] { kernel(arguments...); });
  });
}

}  // namespace kernels_on_cpu

template <class Parameter>
cudaError_t cudaLaunchCooperativeKernel(void (*kernel)(Parameter), dim3 grid, dim3 block, void** arguments,
                                        std::size_t, cudaStream_t) {
  const auto& argument = *static_cast<const std::remove_cvref_t<Parameter>*>(arguments[0]);
  kernels_on_cpu::run({grid.x, grid.y}, block.x, true, [&] { kernel(argument); });
  return kernels_on_cpu::only_now();
}
