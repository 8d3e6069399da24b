// Domains on GPUs give the bits of one backend on the CPU. On a machine with one GPU all domains share it.
#include <cmath>

#include "core/error.hpp"
#include "cuda/domains/domain_gpus.hpp"
#include "domains/domain_pair.hpp"
#include "gpu/gpu_scenes.hpp"

namespace pf::test {
namespace {

// Beside the tests in tests/domains, which are built for GPUs, too.
using GpuDomains = Domains;

// All parcels move into one slab, whose arrays grow, and the others are empty.
TEST_F(GpuDomains, GiveTheSameBitsWhereOneSlabTakesAllParcels) {
  Pair pair(busy_court(Boundary::walls, 20000), domains(4));
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    for (Vec2f& velocity : state.velocity) velocity.x = std::fabs(velocity.x) + 30.0F;
    run->backend->restore(state);
  }
  EXPECT_GT(pair.expect_same_steps(400, 1e-3).num_collisions, 0U);
}

// More parcels than are taken over at a time, and so many that a thread looks around two of them in either
// domain; later few.
TEST_F(GpuDomains, GiveTheSameBitsOfManyParcels) {
  Pair pair(busy_court(Boundary::periodic, 4'000'000), domains(2));
  pair.plain.backend = make_cpu_backend(0);
  pair.plain.physics = spawn_scene(pair.plain.settings, *pair.plain.backend).physics;
  EXPECT_GT(pair.expect_same_steps(8, 2e-5).num_collisions, 0U);
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    run->settings.num_parcels = 2000;
    run->physics = spawn_scene(run->settings, *run->backend).physics;
  }
  pair.expect_same_steps(20, 1e-3);
}

// A backend of one GPU works in turn with domains, which may be on others.
TEST_F(GpuDomains, WorkBesideOneBackend) {
  const Settings s = busy_court(Boundary::walls);
  SceneRun one(s, make_cuda_backend(0));
  Pair pair(s, domains(8));
  for (int k = 0; k < 4; ++k) {
    pair.expect_same_steps(10, 2e-4);
    one.advance(10, 2e-4);
    EXPECT_EQ(one.backend->state_hash(), pair.plain.backend->state_hash());
  }
  BackendState state;
  pair.divided.backend->save(state);
  one.backend->resume(pair.plain.physics, state);
  EXPECT_EQ(one.backend->state_hash(), pair.plain.backend->state_hash());
}

TEST_F(GpuDomains, RefuseWhatDoesNotFit) {
  const auto gpus = make_domain_gpus();
  const std::unique_ptr<Domain> domain = gpus->make(0, 0);
  EXPECT_NO_THROW(gpus->check_room(1000, {2, 1}, 0));
  const std::size_t free_bytes = usable_memory_bytes();
  EXPECT_NO_THROW(gpus->check_room(free_bytes / 40, {2, 1}, 0));
  EXPECT_THROW(gpus->check_room(free_bytes / 25, {2, 1}, 0), UserError);
  if (num_cuda_devices() == 1) {
    EXPECT_THROW(gpus->check_room(free_bytes / 40, {2, 2}, 0), UserError);
  }
}

}  // namespace
}  // namespace pf::test
