// A fixed team of threads that runs one function at a time over a fixed partition. Idle threads spin for a
// while before they sleep: waking a thread takes ten times as long as many of the functions it runs.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace pf {

class ThreadTeam {
 public:
  // num_threads >= 1, the calling thread included.
  explicit ThreadTeam(unsigned num_threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  unsigned size() const { return num_threads_; }

  // Runs work(thread) on every thread, thread = 0 .. size() - 1, and returns when all are done.
  void run(const std::function<void(unsigned thread)>& work);

  // Share [begin, end) of `count` items for one thread. Shares are contiguous and in thread order.
  struct Share {
    std::size_t begin, end;
  };
  Share share(unsigned thread, std::size_t count) const {
    return {count * thread / num_threads_, count * (thread + 1) / num_threads_};
  }

 private:
  void serve(unsigned thread);

  unsigned num_threads_;
  std::atomic<std::uint32_t> started_{0};  // number of functions started
  std::atomic<std::uint32_t> running_{0};  // threads, without the calling one, still in the last function
  const std::function<void(unsigned)>* work_ = nullptr;
  bool stopping_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace pf
