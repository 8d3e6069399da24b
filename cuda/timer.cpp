#include "cuda/timer.cuh"

#include <algorithm>

#include "cuda/check.cuh"
#include "cuda/device_buffer.cuh"

namespace pf {

void EventMarks::record(cudaStream_t stream) {
  if (num_ < events_.size()) PF_CUDA(cudaEventRecord(events_[num_++], stream));
}

void EventMarks::wait(std::size_t k) const { PF_CUDA(cudaEventSynchronize(events_[k])); }

double EventMarks::elapsed_ms(std::size_t from, std::size_t to) const {
  float ms = 0.0F;
  PF_CUDA(cudaEventElapsedTime(&ms, events_[from], events_[to]));
  return static_cast<double>(ms);
}

double measure_device_copy(std::size_t num_bytes, cudaStream_t stream) {
  constexpr int kRepeats = 10;
  const DeviceBuffer<std::byte> from(num_bytes), to(num_bytes);
  const auto copy = [&] {
    PF_CUDA(cudaMemcpyAsync(to.data(), from.data(), num_bytes, cudaMemcpyDeviceToDevice, stream));
  };
  PF_CUDA(cudaMemsetAsync(from.data(), 0, num_bytes, stream));
  copy();
  EventMarks marks(2);
  marks.record(stream);
  for (int repeat = 0; repeat < kRepeats; ++repeat) copy();
  marks.record(stream);
  marks.wait(1);
  return 2e3 * static_cast<double>(num_bytes) * kRepeats / marks.elapsed_ms(0, 1);
}

void RequestTimer::begin(cudaStream_t stream) {
  for (EventMarks* marks : {&request_, &sorts_, &sums_, &ball_, &stages_}) marks->clear();
  num_sort_calls_ = num_stage_calls_ = 0;
  request_.record(stream);
}

void RequestTimer::mark_sort(cudaStream_t stream) {
  const std::size_t sort = num_sort_calls_++ / 3;
  if (sort % kSortsPerMarked == 0) sorts_.record(stream);
}

void RequestTimer::mark_sums(cudaStream_t stream) { sums_.record(stream); }

void RequestTimer::mark_ball(cudaStream_t stream) { ball_.record(stream); }

void RequestTimer::mark_stage(cudaStream_t stream) {
  const std::size_t step = num_stage_calls_++ / 4;
  if (step % kStepsPerMarked == 0) stages_.record(stream);
}

void RequestTimer::end(cudaStream_t stream) { request_.record(stream); }

double RequestTimer::wait_ms() {
  request_.wait(1);
  return request_.elapsed_ms(0, 1);
}

// At most total_ms, since a marked sort may be the one that takes longest.
PhaseTimes RequestTimer::sort_times(double total_ms) const {
  PhaseTimes times;
  for (std::size_t k = 0; k + 2 < sorts_.num(); k += 3) {
    times[Phase::sort] += sorts_.elapsed_ms(k, k + 1);
    times[Phase::grid] += sorts_.elapsed_ms(k + 1, k + 2);
  }
  const double marked_ms = times.total();
  if (!(marked_ms > 0.0)) return times;
  const double sorts_per_marked = static_cast<double>(num_sort_calls_) / static_cast<double>(sorts_.num());
  for (const Phase phase : {Phase::sort, Phase::grid})
    times[phase] *= std::min(sorts_per_marked, total_ms / marked_ms);
  return times;
}

PhaseTimes RequestTimer::times(const Repeats& repeats) {
  const double total_ms = wait_ms();
  PhaseTimes times = sort_times(total_ms);
  if (sums_.num() == 2) times[Phase::sort] += sums_.elapsed_ms(0, 1) * repeats.num_sums;
  if (ball_.num() == 2) times[Phase::ball] = ball_.elapsed_ms(0, 1) * repeats.num_ends;
  times[Phase::collide_integrate] = std::max(0.0, total_ms - times.total());
  return times;
}

PhaseTimes RequestTimer::exact_times(const unsigned long long* reconcile_ns) {
  const double total_ms = wait_ms();
  PhaseTimes times = sort_times(total_ms);
  const double steps_ms = std::max(0.0, total_ms - times.total());
  PhaseTimes marked;
  for (std::size_t k = 0; k + 3 < stages_.num(); k += 4) {
    marked[Phase::predict] += stages_.elapsed_ms(k, k + 1);
    marked[Phase::solve] += stages_.elapsed_ms(k + 1, k + 2);
    marked[Phase::commit] += stages_.elapsed_ms(k + 2, k + 3);
  }
  const double marked_ms = marked.total();
  if (!(marked_ms > 0.0)) {  // no step, as with steps shorter than a tick
    times[Phase::commit] = steps_ms;
    return times;
  }
  for (const Phase stage : {Phase::predict, Phase::solve, Phase::commit})
    times[stage] = marked[stage] * (steps_ms / marked_ms);
  times[Phase::reconcile] = std::min(1e-6 * static_cast<double>(*reconcile_ns), times[Phase::solve]);
  times[Phase::solve] -= times[Phase::reconcile];
  return times;
}

}  // namespace pf
