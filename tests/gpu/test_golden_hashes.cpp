// The CUDA backend against the golden hashes, which the CPU backend wrote.
#include <gtest/gtest.h>

#include "cuda/cuda_backend.hpp"
#include "cuda/cuda_devices.hpp"
#include "support/golden_hashes.hpp"

namespace pf::test {
namespace {

class GpuGoldenHashes : public testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (num_cuda_devices(&why) == 0) GTEST_SKIP() << "no CUDA device: " << why;
  }
};

TEST_F(GpuGoldenHashes, MatchTheFile) {
  expect_golden_hashes([] { return make_cuda_backend(0); });
}

}  // namespace
}  // namespace pf::test
