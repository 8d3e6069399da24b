#include "core/thread_team.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pf {
namespace {

constexpr int kMaxSpins = 4000;  // before a thread sleeps; some 100 microseconds
constexpr int kSpinsPerYield = 128;

void pause() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

// Returns when `value` differs from `old`.
void await_change(const std::atomic<std::uint32_t>& value, std::uint32_t old) {
  for (int spin = 1; spin <= kMaxSpins; ++spin) {
    if (value.load(std::memory_order_acquire) != old) return;
    pause();
    if (spin % kSpinsPerYield == 0) std::this_thread::yield();  // there may be more threads than cores
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

ThreadTeam::ThreadTeam(unsigned num_threads) : num_threads_(num_threads) {
  for (unsigned thread = 1; thread < num_threads; ++thread) {
    threads_.emplace_back([this, thread] { serve(thread); });
  }
}

ThreadTeam::~ThreadTeam() {
  stopping_ = true;
  started_.fetch_add(1, std::memory_order_release);
  started_.notify_all();
}

void ThreadTeam::run(const std::function<void(unsigned)>& work) {
  if (num_threads_ == 1) return work(0);
  work_ = &work;
  running_.store(num_threads_ - 1, std::memory_order_relaxed);
  started_.fetch_add(1, std::memory_order_release);
  started_.notify_all();
  work(0);
  while (const std::uint32_t left = running_.load(std::memory_order_acquire)) await_change(running_, left);
}

void ThreadTeam::serve(unsigned thread) {
  for (std::uint32_t seen = 0;; ++seen) {
    await_change(started_, seen);
    if (stopping_) return;
    (*work_)(thread);
    if (running_.fetch_sub(1, std::memory_order_acq_rel) == 1) running_.notify_one();
  }
}

}  // namespace pf
