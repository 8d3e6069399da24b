// Domains give the bits of one backend without domains: states, counts, profiles, pictures.
#include <gtest/gtest.h>

#include <algorithm>

#include "backend/domains/domain_backend.hpp"
#include "backend/domains/slabs.hpp"
#include "core/error.hpp"
#include "domains/thread_ranks.hpp"
#include "support/golden_hashes.hpp"
#include "support/snapshot_checks.hpp"

namespace pf::test {
namespace {

std::unique_ptr<Backend> domains(unsigned num, unsigned num_threads = 1) {
  return make_domain_backend(std::make_shared<LocalCarrier>(), num, num_threads);
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

class NumDomains : public testing::TestWithParam<unsigned> {};

TEST_P(NumDomains, GivesTheGoldenStates) {
  expect_golden_states([] { return domains(GetParam()); });
}

INSTANTIATE_TEST_SUITE_P(Domains, NumDomains, testing::Values(1U, 2U, 3U, 4U, 8U, 13U),
                         testing::PrintToStringParamName());

TEST(Domains, GiveTheGoldenStatesForAnyNumberOfRanks) {
  for (const auto& [num_ranks, num_domains] : {std::pair(2U, 2U), std::pair(2U, 6U), std::pair(3U, 3U)}) {
    SCOPED_TRACE(testing::Message() << num_ranks << " ranks, " << num_domains << " domains");
    ThreadRanks ranks(num_ranks);
    expect_golden_states([&, num = num_domains] { return ranks.make_backend(num); });
  }
}

// A dense gas through which a ball flies, with what the panel changes while it does.
struct Pair {
  explicit Pair(const Settings& s, std::unique_ptr<Backend> with)
      : plain(s, make_cpu_backend(1)), divided(s, std::move(with)) {}

  // Returns the totals of the domains.
  StepTotals expect_same_steps(std::uint32_t num, double dt_s) {
    const StepReport expected = plain.advance(num, dt_s), report = divided.advance(num, dt_s);
    EXPECT_EQ(divided.backend->state_hash(), plain.backend->state_hash());
    EXPECT_EQ(report.ball, expected.ball);
    EXPECT_EQ(report.totals.num_steps, expected.totals.num_steps);
    EXPECT_EQ(report.totals.num_collisions, expected.totals.num_collisions);
    EXPECT_EQ(report.totals.num_ball_hits, expected.totals.num_ball_hits);
    EXPECT_EQ(report.totals.num_retired, expected.totals.num_retired);
    EXPECT_EQ(report.totals.num_invalid, expected.totals.num_invalid);
    EXPECT_EQ(report.totals.first_invalid_id, expected.totals.first_invalid_id);
    EXPECT_EQ(report.totals.impulse_sum_mps, expected.totals.impulse_sum_mps);
    EXPECT_EQ(report.totals.max_overlap_diameters, expected.totals.max_overlap_diameters);
    return report.totals;
  }
  void apply(const Settings& s) {
    for (SceneRun* run : {&plain, &divided}) {
      run->settings = s;
      run->physics = derive_physics(s);
      run->backend->set_physics(run->physics);
    }
  }

  SceneRun plain, divided;
};

Settings busy_court(Boundary boundary, std::int64_t num_parcels = 3000) {
  Settings s = court(num_parcels, boundary);
  s.area_fraction = 0.3;
  s.restitution = 0.8;
  s.ball_vx_mps = 40.0;
  s.ball_vy_mps = 7.0;
  return s;
}

TEST(Domains, GiveTheSameBitsWhileSettingsChange) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const unsigned num : {2U, 5U}) {
      SCOPED_TRACE(testing::Message() << "boundary " << static_cast<int>(boundary) << ", " << num);
      Settings s = busy_court(boundary);
      Pair pair(s, domains(num, 2));
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

// Eight slabs of a metre or less: a parcel crosses several in a step, and every step sorts.
TEST(Domains, GiveTheSameBitsOfParcelsThatCrossSeveralBordersInAStep) {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    Pair pair(busy_court(boundary, 1500), domains(8));
    for (SceneRun* run : {&pair.plain, &pair.divided}) {
      ParcelSnapshot state = run->backend->snapshot();
      for (std::size_t i = 0; i < state.velocity.size(); i += 5) state.velocity[i] = {900.0F, -300.0F};
      run->backend->restore(state);
    }
    EXPECT_GT(pair.expect_same_steps(25, 4e-3).num_collisions, 0U);
  }
}

// All parcels and the ball around one border; the other domains are empty.
TEST(Domains, GiveTheSameBitsWhereMostDomainsAreEmpty) {
  Pair pair(busy_court(Boundary::walls, 400), domains(8));
  for (SceneRun* run : {&pair.plain, &pair.divided}) {
    ParcelSnapshot state = run->backend->snapshot();
    for (Vec2i& position : state.position) position = {position.x / 64, position.y};
    run->backend->restore(state);
    BallState ball = run->ball;
    ball.position_m = {0.0, 0.0};
    run->backend->set_ball(ball);
  }
  const StepTotals totals = pair.expect_same_steps(150, 2e-4);
  EXPECT_GT(totals.num_collisions, 0U);
  EXPECT_GT(totals.num_ball_hits, 0U);
}

TEST(Domains, RestoreASnapshot) {
  expect_restored_is_the_same_state(gas(900), domains(3));
  expect_restored_goes_on_as_it_did(gas(900), domains(3));
}

TEST(Domains, GoOnFromAStateOfTheOtherBackendAndBack) {
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

TEST(Domains, AreCutByABudgetAndGoOn) {
  Pair pair(busy_court(Boundary::open), domains(3));
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

TEST(Domains, ShowWhatOneBackendShows) {
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

TEST(Domains, RefuseExact) {
  Settings s = busy_court(Boundary::open, 50);
  s.method = Method::exact;
  SceneRun run(s, domains(2));
  EXPECT_NE(run.backend->refusal_of(Method::exact), "");
  EXPECT_EQ(run.backend->refusal_of(Method::spring), "");
  EXPECT_THROW(run.advance(1, 1e-3), UserError);
}

TEST(Domains, KeepTheirNumberWithOtherThreads) {
  const std::unique_ptr<Backend> two = domains(5)->with_threads(2);
  EXPECT_EQ(two->num_domains(), 5U);
  EXPECT_NE(two->device().find("5 domains"), std::string::npos) << two->device();
  EXPECT_NE(two->device().find("2 threads"), std::string::npos) << two->device();
}

TEST(Slabs, CoverTheWorldOnce) {
  for (const Boundary boundary : {Boundary::open, Boundary::periodic}) {
    for (const unsigned num : {1U, 3U, 7U, 64U}) {
      const Slabs slabs{make_world(2.0, 1.0, boundary), num};
      EXPECT_EQ(slabs.edge(0), -kHalfSide);
      EXPECT_EQ(slabs.edge(num), kHalfSide);
      for (unsigned k = 0; k < num; ++k) {
        const auto first = static_cast<std::int32_t>(slabs.edge(k));
        const auto last = static_cast<std::int32_t>(slabs.edge(k + 1) - 1);
        EXPECT_EQ(slabs.owner(first), k);
        EXPECT_EQ(slabs.owner(last), k);
        EXPECT_EQ(slabs.distance(first, k), 0);
        if (k > 0) {
          EXPECT_EQ(slabs.distance(first - 10, k), 10);
        }
      }
      const bool wraps = boundary == Boundary::periodic && num > 1;
      EXPECT_EQ(slabs.distance(-kHalfSide, num - 1), wraps || num == 1 ? 0 : slabs.edge(num - 1) + kHalfSide);
    }
  }
}

}  // namespace
}  // namespace pf::test
