#include "cuda/exact/timeline.hpp"

#include <cmath>

#include "backend/exact/limits.hpp"
#include "cuda/check.cuh"

namespace pf::cuda {

void ExactTimeline::reset_time() { *this = {}; }

void ExactTimeline::enter(const ExactLaunch& launch, cudaStream_t stream) {
  now_ = static_cast<std::uint64_t>(std::llround(time_s_ / launch.run.reference_ticks.tick_s));
  // The copy of the state to the host reads padding too.
  PF_CUDA(cudaMemsetAsync(launch.state, 0, sizeof(ExactState), stream));
  launch_enter(launch, now_, stream);
  is_active_ = true;
}

std::vector<std::uint64_t> ExactTimeline::plan_ends(const StepRequest& request, std::uint32_t num_together,
                                                    double tick_s) {
  std::vector<std::uint64_t> ends;
  const double start_s = time_s_;
  check_is_countable(start_s + request.num_steps * request.dt_s, tick_s);
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto end = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
    if ((k % num_together == 0 || k == request.num_steps) && end > now_) ends.push_back(now_ = end);
  }
  return ends;
}

}  // namespace pf::cuda
