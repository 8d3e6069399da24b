// The kernels of both kinds of methods, on the CPU, end in the bits of the CPU backend.
#include <cstdlib>

#include "gpu/gpu_scenes.hpp"

namespace pf::test {
namespace {

class Kernels : public testing::Test {
 protected:
  void TearDown() override { ::unsetenv("PICKLEFLIGHT_DEVICE_LIMITS"); }
  static void limit(const char* text) { ::setenv("PICKLEFLIGHT_DEVICE_LIMITS", text, 1); }
};

// The last list of pairs and the last warp are not full, and the last parcel is alone.
constexpr std::int64_t kNumParcels = 1451;

// In two requests, since `exact` takes several steps of the second one as one. Hits and retired parcels of
// the result are of both.
StepTotals expect_same_bits(const Settings& s, std::uint32_t steps) {
  SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
  const StepTotals first = expect_same_request(cpu, gpu, steps);
  StepTotals all = expect_same_request(cpu, gpu, steps);
  all.num_ball_hits += first.num_ball_hits;
  all.num_retired += first.num_retired;
  return all;
}

// Requests of different kinds that follow one another.
void expect_same_after_others(const Settings& s, const char* limits) {
  ::setenv("PICKLEFLIGHT_DEVICE_LIMITS", limits, 1);
  SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
  const auto go_on = [&](Method method, bool contacts, Neighbors neighbors, std::uint32_t steps) {
    for (SceneRun* run : {&cpu, &gpu}) {
      run->settings.method = method;
      run->settings.neighbors = neighbors;
      run->physics.parcels.contacts = contacts;
      run->backend->set_physics(run->physics);
    }
    expect_same_request(cpu, gpu, steps);
    EXPECT_EQ(gpu.backend->snapshot().heated, cpu.backend->snapshot().heated) << steps;
  };
  go_on(Method::impulse, true, Neighbors::grid, 25);
  go_on(Method::spring, true, Neighbors::grid, 3);
  go_on(Method::impulse, true, Neighbors::grid, 25);
  go_on(Method::exact, true, Neighbors::grid, 2);
  go_on(Method::impulse, true, Neighbors::grid, 25);
  go_on(Method::impulse, false, Neighbors::grid, 60);
  go_on(Method::impulse, true, Neighbors::grid, 25);
  go_on(Method::impulse, true, Neighbors::all_pairs, 30);
  go_on(Method::impulse, true, Neighbors::grid, 25);
}

TEST_F(Kernels, StepsGiveTheBitsOfTheCpu) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (Settings s : scenes(kNumParcels)) {
      expect_same_bits(s, 35);
      s.method = Method::spring;
      expect_same_bits(s, 35);
    }
  }
}

TEST_F(Kernels, StepsInNarrowPeriodicWorldsGiveTheBitsOfTheCpu) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (Settings s : narrow_scenes(200)) {
      for (const Method method : {Method::impulse, Method::spring, Method::exact}) {
        s.method = method;
        EXPECT_GT(expect_same_bits(s, 35).num_collisions, 0U);
      }
    }
  }
}

TEST_F(Kernels, StepsOfACrowdGiveTheBitsOfTheCpu) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
      Settings in_court = court(kNumParcels, boundary);
      in_court.area_fraction = 0.6;
      expect_same_bits(in_court, 35);
      expect_same_bits(gas(kNumParcels, 0.65, boundary), 35);
    }
  }
}

struct Pile {
  std::int64_t num_parcels;
  unsigned num;  // of them, that are in the pile
};

// Lists of pairs are too short: of a list for 128 parcels by few, so that the pool has room for these, and by
// many, so that they are found again; of a list for five parcels; and of a warp.
TEST_F(Kernels, StepsOfAPileGiveTheBitsOfTheCpu) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
      for (const auto& [num_parcels, num] :
           {Pile{5, 4}, {kNumParcels, 18}, {kNumParcels, 30}, {kNumParcels, 90}}) {
        for (const Method method : {Method::impulse, Method::spring}) {
          Settings s = gas(num_parcels, 0.2, boundary);
          s.method = method;
          SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
          for (SceneRun* run : {&cpu, &gpu}) pile_up(*run, num);
          for (const std::uint32_t steps : {1U, 1U, 6U}) expect_same_request(cpu, gpu, steps);
        }
      }
    }
  }
}

// The pool is used for many steps, with sorts among them.
TEST_F(Kernels, StepsOfALayerThatIsPressedGiveTheBitsOfTheCpu) {
  for (const char* limits : {"many_parcels=1", "many_parcels=1 many_for_two=1"}) {
    limit(limits);
    Settings s = gas(45'000, 0.2, Boundary::walls);
    s.restitution = 0.0;
    SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
    for (SceneRun* run : {&cpu, &gpu}) press(*run, 500);
    std::uint64_t num_sorts = 0;
    for (const std::uint32_t steps : {3U, 9U}) num_sorts += expect_same_request(cpu, gpu, steps).num_sorts;
    EXPECT_GE(num_sorts, 2U);
  }
}

// Steps are ended sixteen at a time, and at the end of a request.
TEST_F(Kernels, StepsOfAnyRequestsGiveTheBitsOfTheCpu) {
  const Settings s = gas(kNumParcels, 0.44, Boundary::walls);
  for (const char* limits : kEveryWay) {
    limit(limits);
    SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
    for (const std::uint32_t steps : {3U, 15U, 16U, 17U, 1U, 33U, 2U, 70U}) {
      expect_same_request(cpu, gpu, steps);
      EXPECT_EQ(gpu.backend->snapshot().heated, cpu.backend->snapshot().heated) << limits << steps;
    }
  }
}

// The ball moves at a step's end, or in the next step. It is held, turns, hits many parcels, or is slowed by
// drag without any.
TEST_F(Kernels, StepsWithABallGiveTheBitsOfTheCpu) {
  Settings fast = court(kNumParcels, Boundary::walls);
  fast.ball_vx_mps = 100.0;
  fast.area_fraction = 0.3;
  Settings held = fast, without_contacts = fast, in_drag = fast;
  held.ball_held = true;
  held.ball_x_m = held.ball_vx_mps = 0.0;
  held.flow_x_mps = 10.0;
  without_contacts.contacts = false;
  in_drag.air = Air::drag;
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (const Settings& s : {fast, held, without_contacts, in_drag}) {
      SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
      std::uint64_t num_hits = 0;
      for (const std::uint32_t steps : {1U, 2U, 15U, 16U, 17U, 33U, 70U})
        num_hits += expect_same_request(cpu, gpu, steps).num_ball_hits;
      EXPECT_EQ(num_hits > 0, s.air == Air::parcels) << limits;
    }
  }
}

// Warps and lists of pairs are full, or have a parcel too few or too many.
TEST_F(Kernels, StepsOfFewParcelsGiveTheBitsOfTheCpu) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (const std::int64_t num : {1, 2, 31, 32, 33, 63, 65, 127, 128, 129, 255, 257}) {
      for (const Settings& s : scenes(num)) expect_same_bits(s, 40);
    }
  }
}

// The output of a step is scratch of the next one, and the uses of the last sort's order change.
TEST_F(Kernels, StepsAfterOthersGiveTheBitsOfTheCpu) {
  Settings in_court = court(kNumParcels, Boundary::walls);
  in_court.area_fraction = 0.4;
  for (const char* limits : kEveryWay) {
    for (const Settings& s : {gas(kNumParcels, 0.65, Boundary::walls), in_court})
      expect_same_after_others(s, limits);
  }
}

// A sort of its own has the phase grid. Steps without contacts do not sort, but parcels move.
TEST_F(Kernels, StepsSortOnTheirWayUnlessTheirSearchWouldBeWide) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    SceneRun gpu(gas(kNumParcels), make_cuda_backend(0));
    const auto has_own_sort = [&](bool contacts, std::uint32_t steps) {
      gpu.physics.parcels.contacts = contacts;
      gpu.backend->set_physics(gpu.physics);
      const StepReport report = gpu.advance(steps);
      EXPECT_EQ(report.totals.num_sorts > 0, contacts) << steps;
      return report.times[Phase::grid] > 0.0;
    };
    EXPECT_TRUE(has_own_sort(true, 1));
    EXPECT_FALSE(has_own_sort(true, 60));
    EXPECT_FALSE(has_own_sort(false, 200));
    EXPECT_TRUE(has_own_sort(true, 1));
  }
}

// The displacement of a step is estimated from the step before, which may have been shorter.
TEST_F(Kernels, StepsSortAsOftenAsTheirLengthWants) {
  for (const char* limits : kEveryWay) {
    limit(limits);
    SceneRun gpu(gas(kNumParcels), make_cuda_backend(0));
    gpu.settings.dt_s *= 0.1;
    gpu.advance(20);
    gpu.settings.dt_s *= 10.0;
    EXPECT_GE(gpu.advance(120).totals.num_sorts, 4U) << limits;
  }
}

TEST_F(Kernels, ExactGivesTheBitsOfTheCpu) {
  for (const char* limits : {"multiprocessors=1", "many_parcels=1"}) {
    limit(limits);
    for (Settings s : scenes(kNumParcels)) {
      s.method = Method::exact;
      s.restitution = 0.8;
      expect_same_bits(s, 20);
    }
  }
}

// So few and so large parcels that search boxes reach as far as positions do, beside a slow ball. In one of
// these flights steps that were taken together moved parcels so far that the next ones were a tick long.
TEST_F(Kernels, ExactWithLargeParcelsInLongStepsGivesTheBitsOfTheCpu) {
  for (const double step_s : {0.3, 0.36, 0.42}) {
    for (int seed = 8; seed <= 10; ++seed) {
      Settings s = unit_gas(20, 0.1, Boundary::walls);
      add_resting_ball(s, 100.0, 0.625);
      s.method = Method::exact;
      s.seed = seed;
      s.dt_s = step_s;
      expect_same_bits(s, 40);
    }
  }
}

// Parcels leave the world, and others are sorted among what is left.
TEST_F(Kernels, StepsOfAGasThatEscapesGiveTheBitsOfTheCpu) {
  Settings s = gas(kNumParcels, 0.2, Boundary::open);
  s.dt_s = 0.1;
  for (const char* limits : kEveryWay) {
    limit(limits);
    for (const Method method : {Method::impulse, Method::exact}) {
      s.method = method;
      EXPECT_GT(expect_same_bits(s, 100).num_retired, 100U);
    }
  }
}

// More clusters than the blocks, or the kernel of the first round, solve at once; their neighbours conflict.
TEST_F(Kernels, ExactWithManyClustersGivesTheBitsOfTheCpu) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    Settings with_ball = court(8000, boundary), without = gas(8000, 0.35, boundary);
    with_ball.dt_s = 1e-3;
    for (Settings s : {with_ball, without}) {
      s.method = Method::exact;
      s.restitution = 0.6;
      for (const char* limits : {"solver_blocks=1", "solver_blocks=2 many_parcels=1"}) {
        limit(limits);
        expect_same_bits(s, 30);
      }
    }
  }
}

// Clusters of many events, which whole blocks solve, and a path of the ball with many segments.
TEST_F(Kernels, ExactInTheLayerBeforeAFastBallGivesTheBitsOfTheCpu) {
  for (const double restitution : {1.0, 0.4}) {
    Settings s = court(kNumParcels, Boundary::walls);
    s.method = Method::exact;
    s.restitution = restitution;
    s.area_fraction = 0.5;
    s.ball_vx_mps = 100.0;
    EXPECT_GT(expect_same_bits(s, 150).num_ball_hits, 30U);
  }
}

TEST_F(Kernels, MeasuresAndSnapshotsAreThoseOfTheCpu) {
  const Settings s = gas(kNumParcels);
  SceneRun cpu(s, make_cpu_backend(0)), gpu(s, make_cuda_backend(0));
  cpu.advance(5);
  gpu.advance(5);
  const ParcelSnapshot on_cpu = cpu.backend->snapshot(), on_gpu = gpu.backend->snapshot();
  EXPECT_EQ(on_gpu.position, on_cpu.position);
  EXPECT_EQ(on_gpu.velocity, on_cpu.velocity);
  const Measures of_cpu = cpu.backend->measure(), of_gpu = gpu.backend->measure();
  EXPECT_EQ(of_gpu.num_live, of_cpu.num_live);
  EXPECT_NEAR(of_gpu.energy_j(), of_cpu.energy_j(), 1e-12 * of_cpu.energy_j());
  EXPECT_EQ(gpu.backend->state_hash(), cpu.backend->state_hash());
}

}  // namespace
}  // namespace pf::test
