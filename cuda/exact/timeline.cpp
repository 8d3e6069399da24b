#include "cuda/exact/timeline.hpp"

#include <algorithm>
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
  is_mid_step_ = false;
}

const std::vector<ExactTimeline::End>& ExactTimeline::plan_ends(const StepRequest& request, double tick_s) {
  request_ = request;
  ends_.clear();
  if (request.num_done == 0) series_start_s_ = time_s_;
  check_is_countable(series_start_s_ + (request.num_done + request.num_steps) * request.dt_s, tick_s);
  std::uint64_t last = now_;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    const double end_s = series_start_s_ + (request.num_done + k) * request.dt_s;
    const auto end = static_cast<std::uint64_t>(std::llround(end_s / tick_s));
    if (end > last) ends_.push_back({last = end, k});
  }
  return ends_;
}

std::uint32_t ExactTimeline::finish(std::uint64_t now) {
  std::uint32_t num_complete = 0;
  std::uint64_t last_end = is_mid_step_ ? 0 : now_;
  bool all = true;
  for (const End& end : ends_) {
    all = all && end.tick <= now;
    if (!all) break;
    num_complete = end.num_steps;
    last_end = end.tick;
  }
  if (all) num_complete = request_.num_steps;
  is_mid_step_ = !all && now > last_end;
  now_ = std::max(now, now_);
  time_s_ = series_start_s_ + (request_.num_done + num_complete) * request_.dt_s;
  return num_complete;
}

}  // namespace pf::cuda
