// Scenes of the tests of the CUDA backend, and their comparison with the CPU backend.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/portable_math.hpp"
#include "cuda/cuda_backend.hpp"
#include "cuda/cuda_devices.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

class Gpu : public testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (num_cuda_devices(&why) == 0) GTEST_SKIP() << "no CUDA device: " << why;
  }
};

inline std::vector<Settings> scenes(std::int64_t n) {
  std::vector<Settings> list;
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    Settings in_court = court(n, boundary);
    if (n <= 2) in_court.area_fraction = 0.01;  // so few parcels would be wider than the court
    list.push_back(in_court);
    list.push_back(gas(n, n <= 2 ? 0.05 : 0.2, boundary));
  }
  return list;
}

// Periodic worlds that are one, two and a few cells wide, or high: search boxes cross an edge, or cover all.
inline std::vector<Settings> narrow_scenes(std::int64_t n) {
  constexpr double kAreaFraction = 0.2;
  const double area = static_cast<double>(n) * kPi / (4.0 * kAreaFraction);  // in diameters
  std::vector<Settings> list;
  for (const double diameters : {2.2, 3.0, 7.5}) {
    Settings narrow = gas(n, kAreaFraction, Boundary::periodic), flat = narrow;
    narrow.width_m = flat.height_m = diameters * diameters / area;  // of the other side
    list.push_back(narrow);
    list.push_back(flat);
  }
  return list;
}

// Values of PICKLEFLIGHT_DEVICE_LIMITS: the fastest way; each kernel that does a whole step, launched one by
// one and in batches; and steps in parts, in which a thread looks around one parcel or two.
constexpr const char* kEveryWay[] = {"",
                                     "one_kernel=1 many_steps=1",
                                     "one_kernel=2",
                                     "one_kernel=3 many_steps=1",
                                     "many_parcels=1 many_for_two=4000000000",
                                     "many_parcels=1 many_for_two=1"};

// Position units.
inline double diameter_of_parcels(const SceneRun& run) {
  return 2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m;
}

// Moves the first `num` parcels onto each other: all of them touch, some have the same centre.
inline void pile_up(SceneRun& run, unsigned num) {
  ParcelSnapshot state = run.backend->snapshot();
  for (unsigned k = 0; k < num; ++k) {
    const double x = 0.3 * (k % 7) / 7.0, y = 0.3 * (k % 11) / 11.0;
    state.position[k] = {static_cast<std::int32_t>(x * diameter_of_parcels(run)),
                         static_cast<std::int32_t>(y * diameter_of_parcels(run))};
  }
  run.backend->restore(state);
}

// Moves the first `num` parcels to a lattice in which each overlaps six others by a fifth.
inline void press(SceneRun& run, unsigned num) {
  constexpr unsigned kInRow = 25;
  ParcelSnapshot state = run.backend->snapshot();
  for (unsigned k = 0; k < num; ++k) {
    const unsigned row = k / kInRow;
    const double x = 0.8 * (k % kInRow + 0.5 * (row % 2)), y = 0.8 * 0.866 * row;
    state.position[k] = {static_cast<std::int32_t>(x * diameter_of_parcels(run)),
                         static_cast<std::int32_t>(y * diameter_of_parcels(run))};
  }
  run.backend->restore(state);
}

// Both make a request, to the same bits. Returns what the GPU reports.
inline StepTotals expect_same_request(SceneRun& cpu, SceneRun& gpu, std::uint32_t steps) {
  const StepReport on_cpu = cpu.advance(steps);
  const StepReport on_gpu = gpu.advance(steps);
  const Settings& s = cpu.settings;
  const std::string where = s.name + ", boundary " + std::to_string(static_cast<int>(s.boundary)) +
                            ", N = " + std::to_string(s.num_parcels) + ", steps " + std::to_string(steps);
  EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash()) << where;
  EXPECT_EQ(on_gpu.totals.num_collisions, on_cpu.totals.num_collisions) << where;
  EXPECT_EQ(on_gpu.totals.impulse_sum_mps, on_cpu.totals.impulse_sum_mps) << where;
  EXPECT_EQ(on_gpu.totals.event_hash, on_cpu.totals.event_hash) << where;
  EXPECT_EQ(on_gpu.totals.num_ball_hits, on_cpu.totals.num_ball_hits) << where;
  EXPECT_EQ(on_gpu.totals.num_retired, on_cpu.totals.num_retired) << where;
  EXPECT_EQ(on_gpu.totals.max_overlap_diameters, on_cpu.totals.max_overlap_diameters) << where;
  EXPECT_EQ(on_gpu.ball, on_cpu.ball) << where;
  for (const ProfileAxis axis : {ProfileAxis::x, ProfileAxis::radius}) {
    const ProfileShape shape = profile_shape(cpu.physics, axis, 37);
    EXPECT_EQ(gpu.backend->profile(shape).bins, cpu.backend->profile(shape).bins) << where;
  }
  return on_gpu.totals;
}

inline void expect_same_hashes(const Settings& s, std::uint32_t steps) {
  SceneRun cpu(s, make_cpu_backend(0));
  SceneRun gpu(s, make_cuda_backend(0));
  EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash())
      << s.name << " spawned, N = " << s.num_parcels;
  expect_same_request(cpu, gpu, steps);
}

}  // namespace pf::test
