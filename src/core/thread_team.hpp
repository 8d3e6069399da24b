// A fixed team of threads that runs one function at a time, over one part for each of them, or over parts
// that any of them may take. Idle threads spin for a while before they sleep: waking a thread takes ten times
// as long as many of the functions it runs. The calling thread does the part of a thread that is late,
// because it is still waking or the system runs something else in its place. Processors of a virtual machine
// are up to a third slower than others at times: so longer work has more parts than threads, and those that
// are done early take some of others.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace pf {

class ThreadTeam {
 public:
  // num_threads >= 1, the calling thread included. Throws std::system_error if the system has no more
  // threads.
  explicit ThreadTeam(unsigned num_threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  unsigned size() const { return num_threads_; }

  // Runs work(part) once for every part, 0 .. size() - 1, and returns when all are done. Each part has a
  // thread of its own, or is done by the calling one after others. A part may not wait for another one.
  // Throws what a part has thrown, after all are done; of several exceptions one.
  void run(const std::function<void(unsigned part)>& work);

  // Share [begin, end) of `count` items for one part. Shares are contiguous and in the order of parts.
  struct Share {
    std::size_t begin, end;
  };
  static Share share(std::size_t part, std::size_t num_parts, std::size_t count) {
    return {count * part / num_parts, count * (part + 1) / num_parts};
  }
  Share share(unsigned part, std::size_t count) const { return share(part, num_threads_, count); }

  // Number of parts that `count` items are divided into for run_parts(): as many for each thread, each of at
  // least `min_items` if it is more than one.
  std::size_t num_parts(std::size_t count, std::size_t min_items) const;
  // Runs work(thread, part) once for every part, 0 .. num_parts - 1, and returns when all are done. Each
  // thread, 0 .. size() - 1, does a share of them in order, and then the last ones of others. No two calls
  // with the same `thread` overlap. A part may not wait for another one. Throws as run() does; then some
  // parts may not be done.
  void run_parts(std::size_t num_parts, const std::function<void(unsigned thread, std::size_t part)>& work);

 private:
  // In a cache line of its own: threads take their parts at the same time.
  struct alignas(64) Part {
    std::atomic<std::uint32_t> taken{0};  // number of the last function of which a thread took this part
    // Parts of run_parts() that are left of its share: the first one, and in the high half the end.
    std::atomic<std::uint64_t> left{0};
  };

  void stop();
  void serve(unsigned part);
  void attempt(unsigned part);
  bool take(unsigned part, std::uint32_t number);
  void do_part(unsigned part);
  bool take_first(unsigned thread, std::size_t& part);
  bool take_of_others(std::size_t& part);
  bool finishes_soon() const;

  unsigned num_threads_;
  std::atomic<std::uint32_t> started_{0};  // number of functions started
  std::atomic<std::uint32_t> running_{0};  // parts of the last function, but the first, that are not done
  const std::function<void(unsigned)>* work_ = nullptr;
  std::mutex failing_;
  std::exception_ptr failure_;         // of the last function
  std::atomic<bool> stopping_{false};  // a thread that is late may look while it is set
  std::unique_ptr<Part[]> parts_;
  std::vector<std::jthread> threads_;
};

}  // namespace pf
