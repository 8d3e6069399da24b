// Runs a kernel on the CPU. The threads of a block are fibers of one thread of the CPU. The blocks of a plain
// launch run one after the other, those of a cooperative one at the same time, each in a thread of its own.
//
// A fiber goes on until it waits at a barrier. So a missing barrier, a barrier that not all come to (which
// ends the program), wrong indices and wrong arithmetic are found, but not what depends on the order of a
// block's threads between barriers.
#pragma once

#include <cstdint>
#include <functional>

namespace kernels_on_cpu {

struct Size {
  unsigned x = 1, y = 1;
};

// Returns when the kernel has ended. Each thread of the grid calls it, with the indices of cuda_runtime.h
// set.
void run(Size grid, unsigned block, bool is_cooperative, const std::function<void()>& kernel);

// Called by the threads of a kernel. A warp's and a block's barrier waits for those that have not ended.
void wait_for_warp();
void wait_for_block();
void wait_for_grid();
void wait_for_some(unsigned barrier, unsigned num_threads);  // of a block

// A value for each lane, for exchanges within the calling thread's warp up to its next barrier; they can be
// read until the one after that.
std::uint64_t* values_of_warp();

}  // namespace kernels_on_cpu
