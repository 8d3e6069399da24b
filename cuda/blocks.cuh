// Numbers of blocks of kernels.
#pragma once

#include <algorithm>
#include <cstdint>

namespace pf {

// Blocks that take `of_block` items each, for all of num. At least one: CUDA launches no kernel without
// blocks, and some kernels do more than their items.
inline unsigned blocks_for(std::uint32_t num, unsigned of_block) {
  return std::max(1U, (num + of_block - 1) / of_block);
}

}  // namespace pf
