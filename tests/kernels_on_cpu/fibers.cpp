#include "kernels_on_cpu/fibers.hpp"

#include <cuda_runtime.h>

#include <algorithm>
#include <array>
#include <barrier>
#include <boost/context/fiber.hpp>
#include <boost/context/preallocated.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

namespace kernels_on_cpu {
namespace {

using boost::context::fiber;

constexpr unsigned kWarp = 32, kMaxBlock = 1024, kMaxBarriers = 16;
constexpr std::size_t kStackBytes = 256 * 1024;

enum class Wait { none, warp, block, grid, some };

// Stacks are used again. Fibers do not free them.
struct Stack {
  std::unique_ptr<char[]> memory{new char[kStackBytes]};
  boost::context::stack_context context;

  Stack() {
    context.sp = memory.get() + kStackBytes;
    context.size = kStackBytes;
  }
};
struct KeepStack {
  void deallocate(boost::context::stack_context&) {}
};

struct Thread {
  Stack stack;
  fiber context;
  fiber scheduler;  // while the thread runs
  bool has_ended = true;
  Wait waits = Wait::none;
  unsigned barrier = 0, num_at_barrier = 0;
};

// The block that this thread of the CPU runs.
class Block {
 public:
  void run(uint3 index, Size grid, unsigned size, const std::function<void()>& kernel,
           std::barrier<>* grid_barrier) {
    blockIdx = index;
    gridDim = dim3(grid.x, grid.y);
    blockDim = dim3(size);
    size_ = size;
    num_left_ = size;
    grid_barrier_ = grid_barrier;
    while (threads_.size() < size) threads_.push_back(std::make_unique<Thread>());
    for (unsigned t = 0; t < size; ++t) start(*threads_[t], kernel);
    while (num_left_ > 0) {
      bool has_moved = false;
      for (unsigned first = 0; first < size; first += kWarp) has_moved |= run_warp(first);
      for (unsigned barrier = 0; barrier < kMaxBarriers; ++barrier) has_moved |= release_some(barrier);
      has_moved |= release(0, size, Wait::block) || release(0, size, Wait::grid);
      if (!has_moved && num_left_ > 0) stop("threads of a block wait at different barriers");
    }
  }

  void wait(Wait kind, unsigned barrier = 0, unsigned num_threads = 0) {
    Thread& self = *threads_[current_];
    self.waits = kind;
    self.barrier = barrier;
    self.num_at_barrier = num_threads;
    self.scheduler = std::move(self.scheduler).resume();
  }

  std::uint64_t* values_of_warp() {
    const unsigned warp = current_ / kWarp;
    return values_[warp][turn_[warp]].data();
  }

 private:
  [[noreturn]] static void stop(const char* why) {
    std::fprintf(stderr, "kernels_on_cpu: %s\n", why);
    std::abort();
  }

  static void start(Thread& thread, const std::function<void()>& kernel) {
    thread.has_ended = false;
    thread.waits = Wait::none;
    const boost::context::stack_context& stack = thread.stack.context;
    thread.context = fiber(std::allocator_arg, boost::context::preallocated(stack.sp, stack.size, stack),
                           KeepStack{}, [&thread, &kernel](fiber&& scheduler) {
                             thread.scheduler = std::move(scheduler);
                             kernel();
                             thread.has_ended = true;
                             return std::move(thread.scheduler);
                           });
  }

  // Runs the threads of a warp until they wait for others than each other. Returns whether one has moved.
  bool run_warp(unsigned first) {
    const unsigned end = std::min(first + kWarp, size_);
    bool has_moved = false;
    do {
      for (unsigned t = first; t < end; ++t) {
        Thread& thread = *threads_[t];
        if (thread.has_ended || thread.waits != Wait::none) continue;
        has_moved = true;
        current_ = t;
        threadIdx = {t, 0, 0};
        thread.context = std::move(thread.context).resume();
        if (thread.has_ended) --num_left_;
      }
    } while (release(first, end, Wait::warp));
    return has_moved;
  }

  // Lets threads go on if all of them that have not ended wait that way. Returns whether they do.
  bool release(unsigned first, unsigned end, Wait kind) {
    bool is_any = false;
    for (unsigned t = first; t < end; ++t) {
      if (threads_[t]->has_ended) continue;
      if (threads_[t]->waits != kind) return false;
      is_any = true;
    }
    if (!is_any) return false;
    if (kind == Wait::grid) {
      if (grid_barrier_ == nullptr) stop("a plain launch waits for its grid");
      grid_barrier_->arrive_and_wait();
    }
    for (unsigned t = first; t < end; ++t) threads_[t]->waits = Wait::none;
    if (kind == Wait::warp) turn_[first / kWarp] ^= 1U;
    return true;
  }

  bool release_some(unsigned barrier) {
    const auto waits = [&](const Thread& thread) {
      return !thread.has_ended && thread.waits == Wait::some && thread.barrier == barrier;
    };
    unsigned num = 0, num_needed = 0;
    for (unsigned t = 0; t < size_; ++t) {
      if (!waits(*threads_[t])) continue;
      ++num;
      num_needed = threads_[t]->num_at_barrier;
    }
    if (num == 0 || num < num_needed) return false;
    for (unsigned t = 0; t < size_; ++t) {
      if (waits(*threads_[t])) threads_[t]->waits = Wait::none;
    }
    return true;
  }

  std::vector<std::unique_ptr<Thread>> threads_;
  // Each barrier of a warp ends a turn: some of its threads may be in the next exchange while others still
  // read.
  std::array<std::array<std::array<std::uint64_t, kWarp>, 2>, kMaxBlock / kWarp> values_{};
  std::array<unsigned, kMaxBlock / kWarp> turn_{};
  unsigned size_ = 0, num_left_ = 0, current_ = 0;
  std::barrier<>* grid_barrier_ = nullptr;
};

thread_local Block block;

}  // namespace

void run(Size grid, unsigned size, bool is_cooperative, const std::function<void()>& kernel) {
  if (!is_cooperative) {
    for (unsigned y = 0; y < grid.y; ++y) {
      for (unsigned x = 0; x < grid.x; ++x) block.run({x, y, 0}, grid, size, kernel, nullptr);
    }
    return;
  }
  std::barrier<> barrier(grid.x);
  std::vector<std::thread> blocks;
  for (unsigned x = 0; x < grid.x; ++x)
    blocks.emplace_back([&, x] { block.run({x, 0, 0}, grid, size, kernel, &barrier); });
  for (std::thread& thread : blocks) thread.join();
}

void wait_for_warp() { block.wait(Wait::warp); }
void wait_for_block() { block.wait(Wait::block); }
void wait_for_grid() { block.wait(Wait::grid); }
void wait_for_some(unsigned barrier, unsigned num_threads) { block.wait(Wait::some, barrier, num_threads); }
std::uint64_t* values_of_warp() { return block.values_of_warp(); }

}  // namespace kernels_on_cpu
