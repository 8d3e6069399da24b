// Owners of device memory, and of page-locked host memory for copies to and from it.
#pragma once

#include <cstddef>
#include <utility>

#include "cuda/check.cuh"

namespace pf {

// Uninitialised array of capacity() elements on the current device; move-only.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  explicit DeviceBuffer(std::size_t count) : count_(count) {
    if (count > 0) PF_CUDA(cudaMalloc(&data_, count * sizeof(T)));
  }
  ~DeviceBuffer() { cudaFree(data_); }
  DeviceBuffer(DeviceBuffer&& o) noexcept { swap(o); }
  DeviceBuffer& operator=(DeviceBuffer&& o) noexcept {
    swap(o);
    return *this;
  }

  T* data() const { return data_; }
  std::size_t capacity() const { return count_; }
  std::size_t bytes() const { return count_ * sizeof(T); }
  void swap(DeviceBuffer& o) noexcept {
    std::swap(data_, o.data_);
    std::swap(count_, o.count_);
  }

 private:
  T* data_ = nullptr;
  std::size_t count_ = 0;
};

// Uninitialised page-locked array of capacity() elements on the host; move-only.
template <class T>
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  explicit PinnedBuffer(std::size_t count) : count_(count) {
    if (count > 0) PF_CUDA(cudaMallocHost(&data_, count * sizeof(T)));
  }
  ~PinnedBuffer() { cudaFreeHost(data_); }
  PinnedBuffer(PinnedBuffer&& o) noexcept { swap(o); }
  PinnedBuffer& operator=(PinnedBuffer&& o) noexcept {
    swap(o);
    return *this;
  }

  T* data() const { return data_; }
  std::size_t capacity() const { return count_; }
  void swap(PinnedBuffer& o) noexcept {
    std::swap(data_, o.data_);
    std::swap(count_, o.count_);
  }

 private:
  T* data_ = nullptr;
  std::size_t count_ = 0;
};

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
