// How long the phases of a request took on the device.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>
#include <vector>

#include "core/timing.hpp"

namespace pf {

// Events of one request, made once: begin and end, and three around each sort.
class RequestTimer {
 public:
  RequestTimer();
  ~RequestTimer();
  RequestTimer(const RequestTimer&) = delete;
  RequestTimer& operator=(const RequestTimer&) = delete;

  void begin(cudaStream_t stream);
  void mark_sort(cudaStream_t stream);  // before the keys, after the keys, after the gather
  void mark_ball(cudaStream_t stream);  // before and after one ball kernel
  void end(cudaStream_t stream);
  // Waits for the end. The ball's time is that of the marked step times num_steps; sorts beyond the first
  // kMaxSorts of a request are not marked and count as collide_integrate.
  PhaseTimes times(std::uint32_t num_steps);

 private:
  static constexpr std::size_t kMaxSorts = 128;
  cudaEvent_t begin_{}, end_{};
  std::vector<cudaEvent_t> sort_marks_;  // 3 per sort
  cudaEvent_t ball_marks_[2]{};
  std::size_t num_sort_marks_ = 0;
  int num_ball_marks_ = 0;
};

}  // namespace pf
