// The state of domains as others set, read and draw it.
#include <gtest/gtest.h>

#include <algorithm>
#include <new>

#include "core/error.hpp"
#include "domains/domain_pair.hpp"
#include "domains/picture_checks.hpp"
#include "support/snapshot_checks.hpp"

namespace pf::test {
namespace {

TEST_F(Domains, RestoreASnapshot) {
  expect_restored_is_the_same_state(gas(900), domains(3));
  expect_restored_goes_on_as_it_did(gas(900), domains(3));
  expect_heated_are_restored(domains(3));
  ThreadRanks ranks(2);
  expect_heated_are_restored(ranks.make_backend(4));
}

TEST_F(Domains, GoOnFromAStateOfTheOtherBackendAndBack) {
  for (const unsigned num_ranks : {1U, 2U}) {
    ThreadRanks ranks(num_ranks);
    Pair pair(busy_court(Boundary::periodic), ranks.make_backend(4));
    pair.expect_same_steps(30, 5e-4);
    BackendState state;
    pair.plain.backend->save(state);
    pair.divided.backend->resume(pair.divided.physics, state);
    pair.expect_same_steps(30, 5e-4);
    pair.divided.backend->save(state);
    pair.plain.backend->resume(pair.plain.physics, state);
    pair.expect_same_steps(30, 5e-4);
  }
}

TEST_F(Domains, StartAnewAfterAReset) {
  for (const unsigned num_ranks : {1U, 2U}) {
    ThreadRanks ranks(num_ranks);
    Pair pair(busy_court(Boundary::periodic), ranks.make_backend(4));
    pair.expect_same_steps(20, 1e-4);
    Settings other = busy_court(Boundary::walls, 1200);
    other.height_m = 20.0;
    for (SceneRun* run : {&pair.plain, &pair.divided})
      run->physics = spawn_scene(other, *run->backend).physics;
    pair.expect_same_steps(20, 1e-4);
  }
}

TEST_F(Domains, RestoreASnapshotOnAllRanks) {
  ThreadRanks ranks(2);
  Pair pair(busy_court(Boundary::walls), ranks.make_backend(2));
  const ParcelSnapshot then = pair.plain.backend->snapshot();
  pair.expect_same_steps(20, 1e-4);
  for (SceneRun* run : {&pair.plain, &pair.divided}) run->backend->restore(then);
  pair.expect_same_steps(20, 1e-4);
}

// Memory that is lacking for what this rank gathers, while the other ranks wait for it.
class LackingCarrier final : public Carrier {
 public:
  explicit LackingCarrier(unsigned num_ranks) : num_ranks_(num_ranks) {}
  unsigned rank() const override { return 0; }
  unsigned num_ranks() const override { return num_ranks_; }
  unsigned num_ranks_here() const override { return num_ranks_; }
  unsigned num_ranks_on_cpus() const override { return num_ranks_; }
  unsigned rank_here() const override { return 0; }
  void broadcast(std::vector<std::byte>&) override {}
  void all_gather(const void*, std::size_t, void*) override { throw std::bad_alloc(); }
  void exchange(const std::vector<Outgoing>&, const std::vector<Incoming>&) override {}
  void send(unsigned, const std::vector<std::byte>&) override {}
  std::optional<Letter> try_receive() override { return std::nullopt; }

 private:
  unsigned num_ranks_;
};

TEST(BrokenRanks, ReachTheProgramPastHandlersOfLesserFailures) {
  const auto go_on_after = [](unsigned num_ranks, const auto& work) {
    const auto backend = make_domain_backend(std::make_shared<LackingCarrier>(num_ranks), 2, 1);
    try {
      work(*backend);
    } catch (const std::exception&) {
      return true;
    } catch (const BrokenRanks& broken) {
      EXPECT_THROW(std::rethrow_exception(broken.cause), std::bad_alloc);
    }
    return false;
  };
  const PixelGrid grid{{0.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 0.0F}, 1.0F, 2, 2};
  const auto picture = [&](Backend& backend) { backend.images()->count(grid, {}); };
  const auto snapshot = [](Backend& backend) { backend.snapshot(); };
  const auto measure = [](Backend& backend) { backend.measure(); };
  EXPECT_FALSE(go_on_after(2, picture));
  EXPECT_FALSE(go_on_after(2, snapshot));
  EXPECT_FALSE(go_on_after(2, measure));
  EXPECT_TRUE(go_on_after(1, measure)) << "no other rank waits";
}

// A backend that has spawned nothing, in a world that is not as wide as others.
TEST_F(Domains, ResumeWithoutAReset) {
  Settings s = busy_court(Boundary::periodic);
  s.height_m = 20.0;
  Pair pair(s, domains(4));
  pair.expect_same_steps(20, 1e-4);
  BackendState state, again;
  pair.plain.backend->save(state);
  state.exact_s = 0.5;
  pair.divided.backend = are_domains_on_gpus() ? domains(4) : pair.divided.backend->with_threads(2);
  pair.divided.backend->resume(pair.divided.physics, state);
  pair.expect_same_steps(60, 5e-3);
  pair.divided.backend->save(again);
  EXPECT_EQ(again.exact_s, 0.5);
  StepTotals one_step;
  one_step.num_steps = 1;
  EXPECT_GE(pair.divided.backend->min_bytes_moved(one_step), 3000.0 * 36);
}

// Ranks that cut at different steps would wait for each other forever.
TEST_F(Domains, AreCutByABudgetAndGoOn) {
  for (const unsigned num_ranks : {1U, 3U}) {
    ThreadRanks ranks(num_ranks);
    Pair pair(busy_court(Boundary::open), ranks.make_backend(3));
    StepRequest request = step_request(pair.divided.settings, pair.divided.physics, 40, 5e-4);
    request.budget_ms = 1e-6;
    std::uint32_t done = 0;
    int num_requests = 0;
    while (done < 40) {
      StepRequest rest = request;
      rest.num_steps = 40 - done;
      rest.num_done = done;
      done += static_cast<std::uint32_t>(pair.divided.backend->advance(rest).totals.num_steps);
      ++num_requests;
    }
    EXPECT_EQ(num_requests, 40);  // each makes one step at least, and no more
    pair.plain.advance(40, 5e-4);
    EXPECT_EQ(pair.divided.backend->state_hash(), pair.plain.backend->state_hash());
  }
}

// Parcels as drawn, in an order that does not depend on memory.
std::vector<std::tuple<float, float, float>> picture_of(Backend& backend, std::size_t num) {
  std::vector<Vec2f> position(num);
  std::vector<float> speed(num);
  backend.draw({position.data(), speed.data(), num});
  std::vector<std::tuple<float, float, float>> picture;
  for (std::size_t i = 0; i < num; ++i) picture.emplace_back(position[i].x, position[i].y, speed[i]);
  std::sort(picture.begin(), picture.end());
  return picture;
}

TEST_F(Domains, DrawWithTheLastStep) {
  Pair pair(busy_court(Boundary::walls, 500), domains(3));
  std::vector<Vec2f> position(500);
  std::vector<float> speed(500);
  const DrawBuffers buffers{position.data(), speed.data(), 500};
  StepRequest request = step_request(pair.divided.settings, pair.divided.physics, 3, 1e-3);
  request.draw = &buffers;
  pair.divided.backend->advance(request);
  std::vector<std::tuple<float, float, float>> picture;
  for (std::size_t i = 0; i < 500; ++i) picture.emplace_back(position[i].x, position[i].y, speed[i]);
  std::sort(picture.begin(), picture.end());
  EXPECT_EQ(picture, picture_of(*pair.divided.backend, 500));
}

TEST_F(Domains, ShowWhatOneBackendShows) {
  for (const unsigned num_ranks : {1U, 3U}) {
    ThreadRanks ranks(num_ranks);
    Pair pair(busy_court(Boundary::open), ranks.make_backend(6));
    pair.expect_same_steps(50, 2e-3);  // some leave
    Backend &plain = *pair.plain.backend, &divided = *pair.divided.backend;
    EXPECT_EQ(picture_of(divided, 3000), picture_of(plain, 3000));
    const ProfileShape shape = profile_shape(pair.plain.physics, ProfileAxis::x, 20);
    EXPECT_EQ(divided.profile(shape).bins, plain.profile(shape).bins);
    const Measures expected = plain.measure(), measures = divided.measure();
    EXPECT_EQ(measures.num_live, expected.num_live);
    EXPECT_LT(measures.num_live, 3000U);
    EXPECT_NEAR(measures.energy_j() / expected.energy_j(), 1.0, 1e-12);
    EXPECT_NEAR(measures.momentum_scale_kg_mps / expected.momentum_scale_kg_mps, 1.0, 1e-12);
    EXPECT_GT(divided.memory_bytes(), 3000U * 40);
    EXPECT_GT(divided.measure_copy_bandwidth(1 << 20), 0.0);
  }
}

TEST_F(Domains, CountAndGatherPictures) {
  for (const unsigned num_ranks : {1U, 3U}) {
    ThreadRanks ranks(num_ranks);
    Pair pair(busy_court(Boundary::open), ranks.make_backend(3));
    pair.expect_same_steps(50, 2e-3);  // some leave
    expect_same_pictures(*pair.plain.backend, *pair.divided.backend, 3000);
  }
}

TEST_F(Domains, RefuseExact) {
  Settings s = busy_court(Boundary::open, 50);
  s.method = Method::exact;
  SceneRun run(s, domains(2));
  EXPECT_NE(run.backend->refusal_of(Method::exact), "");
  EXPECT_EQ(run.backend->refusal_of(Method::spring), "");
  EXPECT_THROW(run.advance(1, 1e-3), UserError);
}

TEST_F(Domains, KeepTheirNumberWithOtherThreads) {
  const std::unique_ptr<Backend> two = domains(5)->with_threads(2);
  if (are_domains_on_gpus()) {
    EXPECT_EQ(two, nullptr);
    return;
  }
  EXPECT_EQ(two->num_domains(), 5U);
  EXPECT_NE(two->device().find("5 domains"), std::string::npos) << two->device();
  EXPECT_NE(two->device().find("2 threads"), std::string::npos) << two->device();
}

}  // namespace
}  // namespace pf::test
