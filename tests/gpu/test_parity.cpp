// The CUDA backend against the CPU backend: the same bits.
#include <gtest/gtest.h>

#include <limits>

#include "core/error.hpp"
#include "gpu/gpu_scenes.hpp"
#include "model/methods.hpp"
#include "support/snapshot_checks.hpp"

namespace pf::test {
namespace {

TEST_F(Gpu, SameBitsAsTheCpuForEverySceneAndBoundary) {
  for (const std::int64_t n : {1, 2, 1000, 100000}) {
    for (const Settings& s : scenes(n)) {
      for (const std::uint32_t steps : {1U, 100U}) expect_same_hashes(s, steps);
    }
  }
}

TEST_F(Gpu, SameBitsInNarrowPeriodicWorlds) {
  for (Settings s : narrow_scenes(600)) {
    for (const Method method : {Method::impulse, Method::spring, Method::exact}) {
      s.method = method;
      expect_same_hashes(s, 100);
    }
  }
}

TEST_F(Gpu, SameBitsAfterTwoThousandSteps) {
  for (const std::int64_t n : {1, 2, 1000}) {
    for (const Settings& s : scenes(n)) expect_same_hashes(s, 2000);
  }
  for (const Settings& s : scenes(100000)) expect_same_hashes(s, 2000);
}

TEST_F(Gpu, ReportsVelocitiesThatAreNotFiniteAsTheCpuDoes) {
  for (const Method method : {Method::impulse, Method::exact}) {
    const auto totals_and_hash = [&](std::unique_ptr<Backend> backend) {
      Settings s = gas(5000);
      s.method = method;
      SceneRun run(s, std::move(backend));
      run.advance(3);
      ParcelSnapshot broken = run.backend->snapshot();
      broken.velocity[4321].x = std::numeric_limits<float>::quiet_NaN();
      broken.velocity[1234].y = std::numeric_limits<float>::infinity();
      broken.velocity[4999].x = 1e20F;
      run.backend->restore(broken);
      run.advance(2);
      const StepTotals totals = run.advance(20).totals;  // `exact` takes steps together now
      return std::pair(totals, run.backend->state_hash());
    };
    const auto [on_cpu, cpu_hash] = totals_and_hash(make_cpu_backend(0));
    const auto [on_gpu, gpu_hash] = totals_and_hash(make_cuda_backend(0));
    EXPECT_EQ(on_gpu.first_invalid_step, on_cpu.first_invalid_step);
    if (method == Method::impulse) {
      EXPECT_EQ(on_gpu.first_invalid_step, 5U);
    }
    EXPECT_EQ(on_gpu.num_invalid, 3U);
    EXPECT_EQ(on_gpu.first_invalid_id, 1234U);
    EXPECT_EQ(on_gpu.num_invalid, on_cpu.num_invalid);
    EXPECT_EQ(on_gpu.first_invalid_id, on_cpu.first_invalid_id);
    EXPECT_GT(on_gpu.num_collisions, 0U);
    EXPECT_EQ(on_gpu.num_collisions, on_cpu.num_collisions);
    EXPECT_EQ(gpu_hash, cpu_hash);
  }
}

TEST_F(Gpu, SameBitsForAnyRequests) {
  const auto hash = [](std::uint32_t steps, int requests) {
    SceneRun run(court(20000), make_cuda_backend(0));
    for (int k = 0; k < requests; ++k) run.advance(steps, 1e-4);
    return run.backend->state_hash();
  };
  EXPECT_EQ(hash(1, 60), hash(60, 1));
  EXPECT_EQ(hash(7, 10), hash(35, 2));
}

// Without a ball up to 16 steps of a request follow one another before they are ended.
TEST_F(Gpu, SameBitsForAnyRequestsWithoutABall) {
  SceneRun cpu(gas(5000), make_cpu_backend(0)), gpu(gas(5000), make_cuda_backend(0));
  for (const std::uint32_t steps : {15U, 16U, 17U, 1U, 33U, 64U, 2U}) {
    const StepTotals on_cpu = cpu.advance(steps).totals, on_gpu = gpu.advance(steps).totals;
    EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash()) << steps;
    EXPECT_EQ(on_gpu.num_collisions, on_cpu.num_collisions) << steps;
    EXPECT_EQ(on_gpu.impulse_sum_mps, on_cpu.impulse_sum_mps) << steps;
    EXPECT_EQ(on_gpu.max_overlap_diameters, on_cpu.max_overlap_diameters) << steps;
  }
}

// Contacts exchange too much, so that parcels leave the range of numbers after some steps.
TEST_F(Gpu, NamesTheFirstInvalidStepOfMany) {
  Settings s = gas(2000, 0.4);
  s.impulse_scale = 1.5;
  SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
  const StepTotals on_cpu = cpu.advance(40).totals, on_gpu = gpu.advance(40).totals;
  EXPECT_GT(on_cpu.first_invalid_step, 16U);
  EXPECT_EQ(on_gpu.first_invalid_step, on_cpu.first_invalid_step);
  EXPECT_EQ(on_gpu.first_invalid_id, on_cpu.first_invalid_id);
  EXPECT_EQ(on_gpu.num_invalid, on_cpu.num_invalid);
  EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash());
}

// In a gas where crowds heat parcels.
TEST_F(Gpu, SameBitsWhenTheMethodChangesInACrowd) {
  SceneRun cpu(gas(3000, 0.65), make_cpu_backend(0)), gpu(gas(3000, 0.65), make_cuda_backend(0));
  for (const Method method :
       {Method::impulse, Method::spring, Method::impulse, Method::exact, Method::impulse}) {
    for (SceneRun* run : {&cpu, &gpu}) {
      run->settings.method = method;
      run->advance(method == Method::impulse ? 25 : 3, method == Method::spring ? 0.002 : 0.04);
    }
    EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash()) << method_name(method);
    EXPECT_EQ(gpu.backend->snapshot().heated, cpu.backend->snapshot().heated) << method_name(method);
    EXPECT_EQ(cpu.backend->snapshot().heated.empty(), method != Method::impulse) << method_name(method);
  }
}

TEST_F(Gpu, SameBitsWithSpringAllPairsAndNoContacts) {
  Settings spring = gas(20000, 0.5);
  spring.method = Method::spring;
  spring.dt_s = 0.002;
  expect_same_hashes(spring, 200);
  Settings all_pairs = gas(3000);
  all_pairs.neighbors = Neighbors::all_pairs;
  expect_same_hashes(all_pairs, 50);
  Settings stream = court(5000, Boundary::periodic);
  stream.contacts = false;
  stream.ball_held = true;
  expect_same_hashes(stream, 300);
  Settings vacuum = court(0);
  vacuum.air = Air::vacuum;
  expect_same_hashes(vacuum, 50);
}

// A step of so many has three kernels, up to such an area fraction; of fewer only in domains.
TEST_F(Gpu, SameBitsOfManyParcels) {
  std::vector<Settings> many = scenes(1'000'000);
  many.push_back(court(1'000'000));
  many.back().area_fraction = 0.44;
  for (const Settings& s : many) expect_same_hashes(s, 30);
}

TEST_F(Gpu, RepeatsAtTenMillion) {
  const Settings s = gas(10'000'000);
  const auto hash = [&] {
    SceneRun run(s, make_cuda_backend(0));
    run.advance(60);
    return run.backend->state_hash();
  };
  EXPECT_EQ(hash(), hash());
}

TEST_F(Gpu, SnapshotAndRestoreKeepTheState) {
  expect_restored_is_the_same_state(gas(5000), make_cuda_backend(0));
}

TEST_F(Gpu, ARestoredSnapshotContinuesTheSame) {
  expect_restored_goes_on_as_it_did(gas(5000), make_cuda_backend(0));
  expect_heated_are_restored(make_cuda_backend(0));
}

TEST_F(Gpu, MeasuresAgreeWithTheCpu) {
  SceneRun cpu(court(30000), make_cpu_backend(0));
  SceneRun gpu(court(30000), make_cuda_backend(0));
  cpu.advance(50);
  gpu.advance(50);
  const Measures a = cpu.backend->measure();
  const Measures b = gpu.backend->measure();
  EXPECT_NEAR(a.energy_j(), b.energy_j(), 1e-12 * a.energy_j());
  EXPECT_EQ(a.num_live, b.num_live);
}

TEST_F(Gpu, RejectsTooManyParcelsWithTheFigures) {
  Settings s = gas(4'000'000'000LL);
  try {
    SceneRun run(s, make_cuda_backend(0));
    FAIL() << "4e9 parcels were accepted";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("GB are free"), std::string::npos) << error.what();
  }
}

TEST_F(Gpu, AtMostEightyBytesAParcel) {
  SceneRun run(gas(1'000'000), make_cuda_backend(0));
  run.advance(20);
  EXPECT_LE(run.backend->memory_bytes(), 80U * 1'000'000U);
}

}  // namespace
}  // namespace pf::test
