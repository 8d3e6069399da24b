// Replays, on one backend, of flights logged on the other: the states are the same.
#include <gtest/gtest.h>

#include "cuda/cuda_backend.hpp"
#include "cuda/cuda_devices.hpp"
#include "support/logged_flight.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

class GpuReplay : public testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (num_cuda_devices(&why) == 0) GTEST_SKIP() << "no CUDA device: " << why;
  }
  TemporaryFolder folder_;
};

TEST_F(GpuReplay, ReplaysALogFromTheCpu) {
  const auto file = folder_.path() / "a.toml";
  const std::uint64_t hash = fly_logged(file, 0, make_cpu_backend(0));
  const Flown flown = fly_again(file, make_cuda_backend(0));
  EXPECT_EQ(flown.hash, hash) << flown.summary;
  EXPECT_EQ(flown.report["checks"], 2);
  EXPECT_EQ(flown.report["same"], true);
}

TEST_F(GpuReplay, ReplaysALogFromTheGpu) {
  const auto file = folder_.path() / "a.toml";
  const std::uint64_t hash = fly_logged(file, 0, make_cuda_backend(0));
  const Flown flown = fly_again(file, make_cpu_backend(0));
  EXPECT_EQ(flown.hash, hash) << flown.summary;
  EXPECT_EQ(flown.report["same"], true);
}

}  // namespace
}  // namespace pf::test
