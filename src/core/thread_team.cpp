#include "core/thread_team.hpp"

#include <algorithm>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pf {
namespace {

constexpr int kMaxSpins = 4000;  // before a thread sleeps; some 100 microseconds
constexpr int kSpinsPerYield = 128;
constexpr int kSpinsBeforeHelp = 32;  // for each part; some microseconds
constexpr std::size_t kMaxPartsOfThread = 4;

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

ThreadTeam::ThreadTeam(unsigned num_threads)
    : num_threads_(num_threads), parts_(std::make_unique<Part[]>(num_threads)) {
  try {
    for (unsigned part = 1; part < num_threads; ++part) {
      threads_.emplace_back([this, part] { serve(part); });
    }
  } catch (...) {
    stop();
    throw;
  }
}

ThreadTeam::~ThreadTeam() { stop(); }

// Ends the threads. The destructor of threads_ joins them.
void ThreadTeam::stop() {
  stopping_ = true;
  started_.fetch_add(1, std::memory_order_release);
  started_.notify_all();
}

void ThreadTeam::run(const std::function<void(unsigned)>& work) {
  if (num_threads_ == 1) return work(0);
  work_ = &work;
  running_.store(num_threads_ - 1, std::memory_order_relaxed);
  const std::uint32_t number = started_.fetch_add(1, std::memory_order_release) + 1;
  started_.notify_all();
  attempt(0);
  for (unsigned part = 1; part < num_threads_ && !finishes_soon(); ++part) {
    if (take(part, number)) do_part(part);
  }
  while (const std::uint32_t left = running_.load(std::memory_order_acquire)) await_change(running_, left);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

// Does a part. The first exception of all parts is kept.
void ThreadTeam::attempt(unsigned part) {
  try {
    (*work_)(part);
  } catch (...) {
    const std::lock_guard lock(failing_);
    if (!failure_) failure_ = std::current_exception();
  }
}

// Returns whether the threads are done with all parts, at once or while one spins.
bool ThreadTeam::finishes_soon() const {
  for (int spin = 0; spin < kSpinsBeforeHelp; ++spin) {
    if (running_.load(std::memory_order_acquire) == 0) return true;
    pause();
  }
  return false;
}

// Before a function starts, its predecessor's number is in all parts: each was taken once. So a thread that
// still knows an older number gets nothing. The load spares the thread whose part it is a cache miss.
bool ThreadTeam::take(unsigned part, std::uint32_t number) {
  std::atomic<std::uint32_t>& taken = parts_[part].taken;
  std::uint32_t before = number - 1;
  return taken.load(std::memory_order_relaxed) == before &&
         taken.compare_exchange_strong(before, number, std::memory_order_acq_rel);
}

void ThreadTeam::do_part(unsigned part) {
  attempt(part);
  if (running_.fetch_sub(1, std::memory_order_acq_rel) == 1) running_.notify_one();
}

std::size_t ThreadTeam::num_parts(std::size_t count, std::size_t min_items) const {
  if (num_threads_ == 1) return 1;
  return num_threads_ * std::clamp(count / (min_items * num_threads_), std::size_t{1}, kMaxPartsOfThread);
}

void ThreadTeam::run_parts(std::size_t num_parts, const std::function<void(unsigned, std::size_t)>& work) {
  for (unsigned thread = 0; thread < num_threads_; ++thread) {
    const Share share = this->share(thread, num_parts);
    parts_[thread].left.store(share.begin | share.end << 32, std::memory_order_relaxed);
  }
  run([&](unsigned thread) {
    std::size_t part = 0;
    while (take_first(thread, part) || take_of_others(part)) work(thread, part);
  });
}

// Takes the first part that is left of a thread's share. Returns false if there is none.
bool ThreadTeam::take_first(unsigned thread, std::size_t& part) {
  std::atomic<std::uint64_t>& left = parts_[thread].left;
  std::uint64_t range = left.load(std::memory_order_relaxed);
  do {
    part = range & UINT32_MAX;
    if (part == range >> 32) return false;
  } while (!left.compare_exchange_weak(range, range + 1, std::memory_order_relaxed));
  return true;
}

// Takes the last part of the share of which most are left. Returns false if nothing is left of any.
bool ThreadTeam::take_of_others(std::size_t& part) {
  constexpr auto num_of = [](std::uint64_t range) { return (range >> 32) - (range & UINT32_MAX); };
  while (true) {
    std::uint64_t longest = 0;
    unsigned victim = 0;
    for (unsigned thread = 0; thread < num_threads_; ++thread) {
      const std::uint64_t range = parts_[thread].left.load(std::memory_order_relaxed);
      if (num_of(range) > num_of(longest)) {
        longest = range;
        victim = thread;
      }
    }
    if (num_of(longest) == 0) return false;
    part = (longest >> 32) - 1;
    if (parts_[victim].left.compare_exchange_strong(longest, longest - (std::uint64_t{1} << 32),
                                                    std::memory_order_relaxed))
      return true;
  }
}

void ThreadTeam::serve(unsigned part) {
  for (std::uint32_t seen = 0;;) {
    await_change(started_, seen);
    seen = started_.load(std::memory_order_acquire);
    if (stopping_) return;
    if (take(part, seen)) do_part(part);
  }
}

}  // namespace pf
