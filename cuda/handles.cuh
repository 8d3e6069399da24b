// A CUDA stream and a CUDA event that are destroyed with their owner.
#pragma once

#include "cuda/check.cuh"

namespace pf {

class OwnedStream {
 public:
  // priority: 0 is the lowest.
  explicit OwnedStream(int priority = 0) {
    PF_CUDA(cudaStreamCreateWithPriority(&stream_, cudaStreamNonBlocking, priority));
  }
  ~OwnedStream() { cudaStreamDestroy(stream_); }
  OwnedStream(const OwnedStream&) = delete;
  OwnedStream& operator=(const OwnedStream&) = delete;

  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_{};
};

class OwnedEvent {
 public:
  explicit OwnedEvent(unsigned flags = 0) { PF_CUDA(cudaEventCreateWithFlags(&event_, flags)); }
  ~OwnedEvent() { cudaEventDestroy(event_); }
  OwnedEvent(const OwnedEvent&) = delete;
  OwnedEvent& operator=(const OwnedEvent&) = delete;

  operator cudaEvent_t() const { return event_; }

 private:
  cudaEvent_t event_{};
};

}  // namespace pf
