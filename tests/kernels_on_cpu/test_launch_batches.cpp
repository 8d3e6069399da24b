// Batches of launches (cuda/launch_batches.cuh).
#include <gtest/gtest.h>

#include <array>

#include "cuda/launch_batches.cuh"
#include "cuda/setup_kernels.cuh"

namespace pf {
namespace {

using Ids = std::array<std::uint32_t, 4>;
constexpr Ids kBefore = {9, 9, 9, 9}, kNumbered = {0, 1, 2, 3}, kZero = {};

struct LaunchBatchesTest : testing::Test {
  void number() { launch_number(ids.data(), static_cast<std::uint32_t>(ids.size()), nullptr); }
  void clear() { PF_CUDA(cudaMemsetAsync(ids.data(), 0, sizeof(ids), nullptr)); }

  LaunchBatches batches;
  Ids ids = kBefore;
};

TEST_F(LaunchBatchesTest, AreLaunchedAtAFlush) {
  const LaunchBatches::Scope scope(batches, nullptr);
  batches.extend();
  number();
  EXPECT_EQ(ids, kBefore);
  batches.flush();
  EXPECT_EQ(ids, kNumbered);
  clear();
  EXPECT_EQ(ids, kZero) << "what follows is launched at once";
}

TEST_F(LaunchBatchesTest, FullOnesAreLaunchedToo) {
  const LaunchBatches::Scope scope(batches, nullptr);
  for (int k = 0; k < 100 && ids == kBefore; ++k) {
    batches.extend();
    number();
  }
  EXPECT_EQ(ids, kNumbered);
}

TEST_F(LaunchBatchesTest, AreDroppedAfterAnError) {
  const auto fail = [&] {
    const LaunchBatches::Scope scope(batches, nullptr);
    batches.extend();
    number();
    throw DeviceError("in between");
  };
  EXPECT_THROW(fail(), DeviceError);
  EXPECT_EQ(ids, kBefore);
  const LaunchBatches::Scope scope(batches, nullptr);
  batches.extend();
  clear();
  batches.flush();
  EXPECT_EQ(ids, kZero);
}

TEST_F(LaunchBatchesTest, AGraphThatDoesNotFitIsReplaced) {
  const LaunchBatches::Scope scope(batches, nullptr);
  for (int k = 0; k < 2; ++k) {
    batches.extend();
    number();
    batches.flush();
    EXPECT_EQ(ids, kNumbered);
    batches.extend();  // as many nodes, of another type
    clear();
    batches.flush();
    EXPECT_EQ(ids, kZero);
  }
}

TEST_F(LaunchBatchesTest, AnEventIsRefused) {
  const LaunchBatches::Scope scope(batches, nullptr);
  cudaEvent_t event{};
  PF_CUDA(cudaEventCreate(&event));
  batches.extend();
  EXPECT_THROW(PF_CUDA(cudaEventRecord(event, nullptr)), DeviceError);
  PF_CUDA(cudaEventDestroy(event));
}

TEST_F(LaunchBatchesTest, OutsideOfAScopeAndEmptyNothingHappens) {
  batches.extend();
  number();
  EXPECT_EQ(ids, kNumbered);
  batches.flush();
  const LaunchBatches::Scope scope(batches, nullptr);
  batches.extend();
  batches.flush();
  EXPECT_EQ(ids, kNumbered);
}

}  // namespace
}  // namespace pf
