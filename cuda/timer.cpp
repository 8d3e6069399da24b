#include "cuda/timer.cuh"

#include <algorithm>

#include "cuda/check.cuh"

namespace pf {
namespace {

float elapsed_ms(cudaEvent_t from, cudaEvent_t to) {
  float ms = 0.0F;
  PF_CUDA(cudaEventElapsedTime(&ms, from, to));
  return ms;
}

}  // namespace

RequestTimer::RequestTimer() : sort_marks_(3 * kMaxSorts) {
  PF_CUDA(cudaEventCreate(&begin_));
  PF_CUDA(cudaEventCreate(&end_));
  for (cudaEvent_t& event : sort_marks_) PF_CUDA(cudaEventCreate(&event));
  for (cudaEvent_t& event : ball_marks_) PF_CUDA(cudaEventCreate(&event));
}

RequestTimer::~RequestTimer() {
  cudaEventDestroy(begin_);
  cudaEventDestroy(end_);
  for (cudaEvent_t event : sort_marks_) cudaEventDestroy(event);
  for (cudaEvent_t event : ball_marks_) cudaEventDestroy(event);
}

void RequestTimer::begin(cudaStream_t stream) {
  num_sort_marks_ = 0;
  num_ball_marks_ = 0;
  PF_CUDA(cudaEventRecord(begin_, stream));
}

void RequestTimer::mark_sort(cudaStream_t stream) {
  if (num_sort_marks_ < sort_marks_.size()) PF_CUDA(cudaEventRecord(sort_marks_[num_sort_marks_++], stream));
}

void RequestTimer::mark_ball(cudaStream_t stream) {
  if (num_ball_marks_ < 2) PF_CUDA(cudaEventRecord(ball_marks_[num_ball_marks_++], stream));
}

void RequestTimer::end(cudaStream_t stream) { PF_CUDA(cudaEventRecord(end_, stream)); }

PhaseTimes RequestTimer::times(std::uint32_t num_steps) {
  PF_CUDA(cudaEventSynchronize(end_));
  PhaseTimes times;
  for (std::size_t k = 0; k + 2 < num_sort_marks_; k += 3) {
    times[Phase::sort] += elapsed_ms(sort_marks_[k], sort_marks_[k + 1]);
    times[Phase::grid] += elapsed_ms(sort_marks_[k + 1], sort_marks_[k + 2]);
  }
  if (num_ball_marks_ == 2) times[Phase::ball] = elapsed_ms(ball_marks_[0], ball_marks_[1]) * num_steps;
  times[Phase::collide_integrate] = std::max(0.0, elapsed_ms(begin_, end_) - times.total());
  return times;
}

}  // namespace pf
