// Copies of arrays between host and device, in the order of a stream. Host arrays that are not page-locked
// may be used again at once after to_device, and are complete after to_host when the stream is.
#pragma once

#include <cstddef>

#include "cuda/check.cuh"

namespace pf {

template <class T>
void to_device(T* device, const T* host, std::size_t num, cudaStream_t stream) {
  if (num > 0) PF_CUDA(cudaMemcpyAsync(device, host, num * sizeof(T), cudaMemcpyHostToDevice, stream));
}

template <class T>
void to_host(T* host, const T* device, std::size_t num, cudaStream_t stream) {
  if (num > 0) PF_CUDA(cudaMemcpyAsync(host, device, num * sizeof(T), cudaMemcpyDeviceToHost, stream));
}

template <class T>
void copy_on_device(T* to, const T* from, std::size_t num, cudaStream_t stream) {
  if (num > 0) PF_CUDA(cudaMemcpyAsync(to, from, num * sizeof(T), cudaMemcpyDeviceToDevice, stream));
}

}  // namespace pf
