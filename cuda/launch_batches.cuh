// Batches of launches. To launch a kernel costs the host 3.7 microseconds beside an H200, while a short one
// takes the device half a microsecond. A batch is recorded from the stream and launched as a CUDA graph of
// the same shape that was made before: 2 microseconds for each kernel.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <vector>

namespace pf {

class LaunchBatches {
 public:
  LaunchBatches() = default;
  ~LaunchBatches();
  LaunchBatches(const LaunchBatches&) = delete;
  LaunchBatches& operator=(const LaunchBatches&) = delete;

  // A while in which launches to a stream may be batched; without one extend() and flush() do nothing. Drops
  // at its end what was not flushed, as after an error.
  class Scope {
   public:
    Scope(LaunchBatches& batches, cudaStream_t stream);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    LaunchBatches& batches_;
  };

  // What is launched next joins the batch; if there is none, it begins one. Events may not be recorded there,
  // and nothing may wait. Batches that begin with the same kind, and have as many nodes, have nodes of the
  // same types.
  void extend(unsigned kind = 0);
  // Launches the batch. What follows is launched at once, until extend().
  void flush();

 private:
  struct Shape {
    unsigned kind = 0;
    std::size_t num_nodes = 0;
    bool operator==(const Shape&) const = default;
  };
  struct Graph {
    Shape shape;
    cudaGraphExec_t executable{};
  };

  cudaGraphExec_t executable_for(cudaGraph_t recorded, const Shape& shape);
  cudaError_t end_recording(cudaGraph_t& recorded);

  std::vector<Graph> graphs_;  // one of each shape
  cudaStream_t stream_{};
  bool is_enabled_ = false, is_recording_ = false;
  unsigned kind_ = 0;
  unsigned num_calls_ = 0, max_calls_ = 0;  // of extend(), in a batch
};

}  // namespace pf
