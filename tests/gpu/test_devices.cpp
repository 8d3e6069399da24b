// Devices smaller than the one that runs the tests; PICKLEFLIGHT_DEVICE_LIMITS stands for them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "core/error.hpp"
#include "gpu/gpu_scenes.hpp"

namespace pf::test {
namespace {

class Devices : public testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (num_cuda_devices(&why) == 0) GTEST_SKIP() << "no CUDA device: " << why;
  }
  void TearDown() override { ::unsetenv("PICKLEFLIGHT_DEVICE_LIMITS"); }
  static void limit(const char* text) { ::setenv("PICKLEFLIGHT_DEVICE_LIMITS", text, 1); }
};

std::uint64_t hash_after_flight(const Settings& s, std::unique_ptr<Backend> backend) {
  SceneRun run(s, std::move(backend));
  run.advance(30);
  return run.backend->state_hash();
}

TEST_F(Devices, AFewMultiprocessorsGiveTheSameBits) {
  for (const Method method : {Method::impulse, Method::exact}) {
    Settings s = court(50000, Boundary::walls);
    s.method = method;
    const std::uint64_t on_cpu = hash_after_flight(s, make_cpu_backend(0));
    for (const char* few : {"multiprocessors=1", "multiprocessors=3", "multiprocessors=14"}) {
      limit(few);
      auto backend = make_cuda_backend(0);
      EXPECT_NE(backend->device().find("limited to"), std::string::npos) << backend->device();
      EXPECT_EQ(hash_after_flight(s, std::move(backend)), on_cpu) << few;
    }
  }
}

// Few parcels, `spring`, a crowd and narrow worlds, of which some ways are faster than others.
TEST_F(Devices, StepsInAnyWayGiveTheSameBits) {
  Settings spring = court(50000, Boundary::periodic), crowd = court(50000, Boundary::walls);
  spring.method = Method::spring;
  crowd.area_fraction = 0.6;
  std::vector<Settings> list = narrow_scenes(600);
  list.insert(list.end(), {court(50000, Boundary::open), spring, crowd});
  for (const Settings& s : list) {
    ::unsetenv("PICKLEFLIGHT_DEVICE_LIMITS");
    const std::uint64_t on_cpu = hash_after_flight(s, make_cpu_backend(0));
    for (const char* way : kEveryWay) {
      limit(way);
      EXPECT_EQ(hash_after_flight(s, make_cuda_backend(0)), on_cpu) << way;
    }
  }
}

// Some parcels have the same centre, and which of two comes first in the order of a sort is left to chance.
TEST_F(Devices, StepsOfAPileGiveTheSameBits) {
  for (const char* way : kEveryWay) {
    limit(way);
    for (const Method method : {Method::impulse, Method::spring}) {
      Settings s = gas(5000, 0.2, Boundary::walls);
      s.method = method;
      SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
      for (SceneRun* run : {&cpu, &gpu}) pile_up(*run, 90);
      for (const std::uint32_t steps : {1U, 1U, 10U}) expect_same_request(cpu, gpu, steps);
    }
  }
}

// A gas of millions of parcels has two blocks of solve_kernel on a multiprocessor; others have one. Of many
// parcels another kernel solves most clusters of the first round. In both scenes a step has more clusters
// than four multiprocessors solve by blocks.
TEST_F(Devices, EveryArrangementOfTheSolverGivesTheSameBits) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    Settings with_ball = court(20000, boundary), without = gas(20000, 0.35, boundary);
    with_ball.dt_s = 1e-3;
    for (Settings s : {with_ball, without}) {
      s.method = Method::exact;
      s.restitution = 0.6;
      const std::uint64_t on_cpu = hash_after_flight(s, make_cpu_backend(0));
      for (const char* arrangement : {"solver_blocks=1", "solver_blocks=2", "solver_blocks=1 many_parcels=1",
                                      "solver_blocks=2 many_parcels=1"}) {
        limit((std::string("multiprocessors=4 ") + arrangement).c_str());
        EXPECT_EQ(hash_after_flight(s, make_cuda_backend(0)), on_cpu) << s.name << ", " << arrangement;
      }
    }
  }
}

TEST_F(Devices, RejectsMoreParcelsThanMemoryHoldsAndNamesANumberThatFits) {
  limit("memory_mb=2000");
  try {
    hash_after_flight(court(200'000'000), make_cuda_backend(0));
    ADD_FAILURE() << "2e8 parcels fit into 2 GB";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("at most about"), std::string::npos) << error.what();
  }
  EXPECT_NO_THROW(hash_after_flight(court(100'000), make_cuda_backend(0)));
}

TEST(DeviceLimitsTest, ReadsTheVariableOrRejectsIt) {
  const auto read = [](const char* text) {
    ::setenv("PICKLEFLIGHT_DEVICE_LIMITS", text, 1);
    const DeviceLimits limits = device_limits();
    ::unsetenv("PICKLEFLIGHT_DEVICE_LIMITS");
    return limits;
  };
  EXPECT_EQ(read("multiprocessors=4 memory_mb=500").num_multiprocessors, 4U);
  EXPECT_EQ(read("multiprocessors=4 memory_mb=500").memory_bytes, 500'000'000U);
  EXPECT_EQ(read("solver_blocks=2").solver_blocks, 2U);
  EXPECT_EQ(read("many_parcels=64").many_parcels, 64U);
  EXPECT_EQ(read("many_for_two=64").many_for_two, 64U);
  EXPECT_EQ(read("one_kernel=3").one_kernel, 3U);
  EXPECT_EQ(read("").memory_bytes, SIZE_MAX);
  for (const char* wrong :
       {"multiprocessors=0", "memory_mb=much", "cores=3", "memory_mb=5x", "solver_blocks=3", "one_kernel=4"})
    EXPECT_THROW(read(wrong), UserError) << wrong;
  ::unsetenv("PICKLEFLIGHT_DEVICE_LIMITS");
}

}  // namespace
}  // namespace pf::test
