#include "cuda/stream.hpp"

#include "cuda/check.cuh"

namespace pf {

cudaStream_t work_stream() {
  static const cudaStream_t stream = [] {
    cudaStream_t made{};
    PF_CUDA(cudaStreamCreateWithFlags(&made, cudaStreamNonBlocking));
    return made;
  }();
  return stream;
}

}  // namespace pf
