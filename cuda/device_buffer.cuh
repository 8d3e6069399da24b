// Owners of device memory, and of page-locked host memory for copies to and from it.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "cuda/check.cuh"

namespace pf {

struct DeviceMemory {
  static void* allocate(std::size_t num_bytes) {
    void* memory = nullptr;
    PF_CUDA(cudaMalloc(&memory, num_bytes));
    return memory;
  }
  static void release(void* memory) { cudaFree(memory); }
};

struct PinnedMemory {
  static void* allocate(std::size_t num_bytes) {
    void* memory = nullptr;
    PF_CUDA(cudaMallocHost(&memory, num_bytes));
    return memory;
  }
  static void release(void* memory) { cudaFreeHost(memory); }
};

// Uninitialised array of capacity() elements; move-only.
template <class T, class Memory>
class OwnedArray {
 public:
  OwnedArray() = default;
  explicit OwnedArray(std::size_t count) : count_(count) {
    if (count > 0) data_ = static_cast<T*>(Memory::allocate(count * sizeof(T)));
  }
  ~OwnedArray() { Memory::release(data_); }
  OwnedArray(OwnedArray&& o) noexcept { swap(o); }
  OwnedArray& operator=(OwnedArray&& o) noexcept {
    swap(o);
    return *this;
  }

  T* data() const { return data_; }
  std::size_t capacity() const { return count_; }
  std::size_t bytes() const { return count_ * sizeof(T); }
  void swap(OwnedArray& o) noexcept {
    std::swap(data_, o.data_);
    std::swap(count_, o.count_);
  }

 private:
  T* data_ = nullptr;
  std::size_t count_ = 0;
};

// On the current device.
template <class T>
using DeviceBuffer = OwnedArray<T, DeviceMemory>;

// The first `count` elements; waits for the stream.
template <class T>
std::vector<T> download(const DeviceBuffer<T>& from, std::size_t count, cudaStream_t stream) {
  std::vector<T> values(count);
  PF_CUDA(cudaMemcpyAsync(values.data(), from.data(), count * sizeof(T), cudaMemcpyDeviceToHost, stream));
  PF_CUDA(cudaStreamSynchronize(stream));
  return values;
}

// Page-locked, on the host.
template <class T>
using PinnedBuffer = OwnedArray<T, PinnedMemory>;

// One page-locked T on the host.
template <class T>
class PinnedValue {
 public:
  PinnedValue() { PF_CUDA(cudaMallocHost(&value_, sizeof(T))); }
  ~PinnedValue() { cudaFreeHost(value_); }
  PinnedValue(const PinnedValue&) = delete;
  PinnedValue& operator=(const PinnedValue&) = delete;

  T* get() const { return value_; }
  T& operator*() const { return *value_; }
  T* operator->() const { return value_; }

 private:
  T* value_ = nullptr;
};

}  // namespace pf
