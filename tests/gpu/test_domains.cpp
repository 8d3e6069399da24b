// Domains on GPUs give the bits of one backend on the CPU. On a machine with one GPU all domains share it.
#include <algorithm>
#include <map>
#include <string>

#include "core/error.hpp"
#include "cuda/domains/domain_gpus.hpp"
#include "domains/domain_pair.hpp"
#include "domains/picture_checks.hpp"
#include "gpu/gpu_scenes.hpp"
#include "support/golden_hashes.hpp"

namespace pf::test {
namespace {

using GpuDomains = Gpu;

std::unique_ptr<Backend> gpu_domains(unsigned num) {
  return make_domain_backend(std::make_shared<LocalCarrier>(), num, 1, make_domain_gpus());
}

// All golden scenes but those of `exact`.
void expect_golden_states(const MakeBackend& make_backend) {
  std::map<std::string, std::string> expected = read_golden_hashes();
  int num_scenes = 0;
  for (const GoldenScene& scene : golden_scenes()) {
    if (scene.settings.method == Method::exact) continue;
    EXPECT_EQ(golden_line(scene, make_backend), expected[scene.name]) << scene.name;
    ++num_scenes;
  }
  EXPECT_GT(num_scenes, 20);
}

TEST_F(GpuDomains, GiveTheGoldenStates) {
  for (const unsigned num : {1U, 2U, 3U, 4U, 8U, 13U}) {
    SCOPED_TRACE(testing::Message() << num << " domains");
    expect_golden_states([=] { return gpu_domains(num); });
  }
}

TEST_F(GpuDomains, GiveTheGoldenStatesForSeveralRanks) {
  for (const auto& [num_ranks, num_domains] : {std::pair(2U, 2U), std::pair(2U, 6U), std::pair(3U, 3U)}) {
    SCOPED_TRACE(testing::Message() << num_ranks << " ranks, " << num_domains << " domains");
    ThreadRanks ranks(num_ranks, [] { return make_domain_gpus(); });
    expect_golden_states([&, num = num_domains] { return ranks.make_backend(num); });
  }
}

TEST_F(GpuDomains, GiveTheSameBitsWhileSettingsChange) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const unsigned num : {2U, 5U}) {
      SCOPED_TRACE(testing::Message() << "boundary " << static_cast<int>(boundary) << ", " << num);
      Settings s = busy_court(boundary);
      Pair pair(s, gpu_domains(num));
      EXPECT_GT(pair.expect_same_steps(60, 2e-4).num_ball_hits, 0U);
      s.contacts = false;
      pair.apply(s);
      pair.expect_same_steps(40, 5e-3);
      s.contacts = true;
      s.method = Method::spring;
      pair.apply(s);
      pair.expect_same_steps(80, 1e-4);
      s.method = Method::impulse;
      s.neighbors = Neighbors::all_pairs;
      pair.apply(s);
      pair.expect_same_steps(20, 1e-3);
      s.neighbors = Neighbors::grid;
      s.restitution = 0.2;
      pair.apply(s);
      EXPECT_GT(pair.expect_same_steps(40, 1e-3).num_collisions, 0U);
    }
  }
}

// A parcel crosses several slabs in a step, and every step sorts.
TEST_F(GpuDomains, GiveTheSameBitsOfParcelsThatCrossSeveralBordersInAStep) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    Pair pair(busy_court(boundary, 1500), gpu_domains(8));
    for (SceneRun* run : {&pair.plain, &pair.divided}) {
      ParcelSnapshot state = run->backend->snapshot();
      for (std::size_t i = 0; i < state.velocity.size(); i += 5) state.velocity[i] = {900.0F, -300.0F};
      run->backend->restore(state);
    }
    EXPECT_GT(pair.expect_same_steps(25, 4e-3).num_collisions, 0U);
  }
}

// All parcels move into one slab, whose arrays grow, and the others are empty.
TEST_F(GpuDomains, GiveTheSameBitsWhereOneSlabTakesAllParcels) {
  Pair pair(busy_court(Boundary::walls, 20000), gpu_domains(4));
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    for (Vec2f& velocity : state.velocity) velocity.x = std::fabs(velocity.x) + 30.0F;
    run->backend->restore(state);
  }
  EXPECT_GT(pair.expect_same_steps(400, 1e-3).num_collisions, 0U);
}

TEST_F(GpuDomains, NameTheFirstInvalidParcelAndStep) {
  Pair pair(busy_court(Boundary::walls, 400), gpu_domains(5));
  pair.expect_same_steps(5, 1e-4);
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    state.velocity[300] = state.velocity[77] = {1e20F, 0.0F};
    run->backend->restore(state);
  }
  const StepTotals totals = pair.expect_same_steps(3, 1e-4);
  EXPECT_EQ(totals.num_invalid, 6U);
  EXPECT_EQ(totals.first_invalid_id, 77U);
}

// Energy is summed in another order; pictures and checkpoints are the same.
TEST_F(GpuDomains, MeasureWhatOneBackendMeasures) {
  const Settings s = busy_court(Boundary::walls);
  Pair pair(s, gpu_domains(3));
  pair.expect_same_steps(50, 2e-4);
  const Measures plain = pair.plain.backend->measure(), divided = pair.divided.backend->measure();
  EXPECT_NEAR(divided.parcel_energy_j, plain.parcel_energy_j, 1e-12 * plain.parcel_energy_j);
  EXPECT_EQ(divided.num_live, plain.num_live);
  expect_same_pictures(*pair.plain.backend, *pair.divided.backend, 3000);
  BackendState state;
  pair.divided.backend->save(state);
  SceneRun other(s, make_cuda_backend(0));
  other.backend->resume(pair.plain.physics, state);
  EXPECT_EQ(other.backend->state_hash(), pair.plain.backend->state_hash());
}

TEST_F(GpuDomains, RefuseWhatDoesNotFit) {
  const auto gpus = make_domain_gpus();
  const std::unique_ptr<Domain> domain = gpus->make(0, 0);
  EXPECT_NO_THROW(gpus->check_room(1000, 0));
  EXPECT_THROW(gpus->check_room(1'000'000'000'000, 0), UserError);
}

}  // namespace
}  // namespace pf::test
