#include "lab/parallel_for.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace pf {

namespace {

std::atomic<unsigned> thread_limit{0};

}  // namespace

void limit_parallel_threads(unsigned num_threads) { thread_limit = num_threads; }

unsigned parallel_threads() {
  const unsigned limit = thread_limit;
  return limit > 0 ? limit : std::max(1U, std::thread::hardware_concurrency());
}

void parallel_for(int num, unsigned num_threads, const std::function<void(int)>& work) {
  const unsigned wanted =
      std::min(num_threads == 0 ? parallel_threads() : num_threads, static_cast<unsigned>(std::max(num, 0)));
  std::atomic<int> next{0};
  std::mutex guard;
  std::exception_ptr first_error;
  const auto run = [&] {
    for (int k = next++; k < num; k = next++) {
      try {
        work(k);
      } catch (...) {
        const std::lock_guard lock(guard);
        if (!first_error) first_error = std::current_exception();
        next = num;
      }
    }
  };
  if (wanted <= 1) {
    run();
  } else {
    std::vector<std::jthread> threads;
    for (unsigned t = 0; t < wanted; ++t) threads.emplace_back(run);
  }
  if (first_error) std::rethrow_exception(first_error);
}

}  // namespace pf
