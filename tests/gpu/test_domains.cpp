// Domains on GPUs give the bits of one backend on the CPU. On a machine with one GPU all domains share it.
#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>
#include <vector>

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

// Of two ranks that have given their GPU the same number. shared: it is the same one.
class TwoRanks final : public LocalCarrier {
 public:
  explicit TwoRanks(bool shared) : shared_(shared) {}
  unsigned num_ranks() const override { return 2; }
  void all_gather(const void* mine, std::size_t num_bytes, void* all) override {
    auto* to = static_cast<std::byte*>(all);
    std::memcpy(to, mine, num_bytes);
    std::memcpy(to + num_bytes, mine, num_bytes);
    if (!shared_) to[num_bytes] ^= std::byte{1};
  }

 private:
  bool shared_;
};

TEST_F(GpuDomains, RefuseWhatDoesNotFit) {
  const auto gpus = make_domain_gpus();
  const std::unique_ptr<Domain> domain = gpus->make(0, 0);
  TwoRanks apart(false), together(true);
  gpus->find_sharing(apart);
  EXPECT_NO_THROW(gpus->check_room(1000, 2, 0));
  const std::size_t free_bytes = usable_memory_bytes();
  EXPECT_NO_THROW(gpus->check_room(free_bytes / 40, 2, 0));
  EXPECT_THROW(gpus->check_room(free_bytes / 25, 2, 0), UserError);
  gpus->find_sharing(together);
  EXPECT_NO_THROW(gpus->check_room(1000, 2, 0));
  EXPECT_THROW(gpus->check_room(free_bytes / 40, 2, 0), UserError);
}

TEST_F(GpuDomains, OfARankShareItsGpus) {
  const auto gpus = make_domain_gpus();
  std::vector<std::unique_ptr<Domain>> domains;
  const unsigned num = 2 * static_cast<unsigned>(num_cuda_devices());
  for (unsigned k = 0; k < num; ++k) domains.push_back(gpus->make(k, k));
  LocalCarrier alone;
  gpus->find_sharing(alone);
  const std::size_t free_bytes = usable_memory_bytes();
  EXPECT_NO_THROW(gpus->check_room(free_bytes / 80, num, 0));
  EXPECT_THROW(gpus->check_room(num * free_bytes / 50, num, 0), UserError);
}

}  // namespace
}  // namespace pf::test
