// Measures the phases of a request on the device.
#pragma once

#include <nvtx3/nvToolsExt.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/timing.hpp"
#include "cuda/handles.cuh"

namespace pf {

// A range in a profiler's timeline, named like the phase.
class PhaseRange {
 public:
  explicit PhaseRange(Phase phase) { nvtxRangePushA(kPhaseNames[static_cast<std::size_t>(phase)]); }
  ~PhaseRange() { nvtxRangePop(); }
  PhaseRange(const PhaseRange&) = delete;
  PhaseRange& operator=(const PhaseRange&) = delete;
};

// CUDA events of a fixed number, made once and recorded in order. Beyond that number none is recorded.
class EventMarks {
 public:
  explicit EventMarks(std::size_t capacity) : events_(capacity) {}

  void clear() { num_ = 0; }
  std::size_t num() const { return num_; }
  bool is_full() const { return num_ == events_.size(); }
  void record(cudaStream_t stream);
  void wait(std::size_t k) const;
  // Between two recorded events that the device has reached.
  double elapsed_ms(std::size_t from, std::size_t to) const;

 private:
  std::vector<OwnedEvent> events_;
  std::size_t num_ = 0;
};

// Bytes per second of a plain copy on the current device, read plus written.
double measure_device_copy(std::size_t num_bytes, cudaStream_t stream);

class RequestTimer {
 public:
  void begin(cudaStream_t stream);
  // Before the counts, after them, after the scatter. One sort in kSortsPerMarked is marked, since an event
  // between short kernels costs as much as they do.
  void mark_sort(cudaStream_t stream);
  // For a sort within a step: before and after counts are summed, in a step of one kernel before the
  // counting.
  void mark_sums(cudaStream_t stream);
  void mark_ball(cudaStream_t stream);  // before and after steps are ended
  // Whether these do something: they do once in a request.
  bool marks_sums() const { return !sums_.is_full(); }
  bool marks_ball() const { return !ball_.is_full(); }
  // Method `exact`, for every step: before predict, after it, after solve, after commit. One step in
  // kStepsPerMarked is marked.
  void mark_stage(cudaStream_t stream);
  void end(cudaStream_t stream);

  // The number of repetitions in a request of a phase that is marked once.
  struct Repeats {
    std::uint32_t num_ends = 0;  // of steps
    std::uint32_t num_sums = 0;  // for sorts in steps
  };

  // Each of these waits for the end, and adds up to the time from begin to end. Marked sorts stand for all.
  // The rest of a step that sorts, and a ball that moves beside contacts, count as collide_integrate.
  PhaseTimes times(const Repeats& repeats);
  // Method `exact`: the marked steps say how the time beside the marked sorts is shared among the stages.
  // Reconciling is part of the marked solve stage; *reconcile_ns is its whole time, read after the wait.
  PhaseTimes exact_times(const unsigned long long* reconcile_ns);

 private:
  static constexpr std::size_t kSortsPerMarked = 8, kMaxMarkedSorts = 16;
  static constexpr std::size_t kStepsPerMarked = 8, kMaxMarkedSteps = 32;

  double wait_ms();
  PhaseTimes sort_times(double total_ms) const;

  EventMarks request_{2};  // begin and end
  EventMarks sorts_{3 * kMaxMarkedSorts};
  EventMarks sums_{2};
  EventMarks ball_{2};
  EventMarks stages_{4 * kMaxMarkedSteps};
  std::size_t num_sort_calls_ = 0, num_stage_calls_ = 0;
};

}  // namespace pf
