// The state hash is the same for any number of threads, neighbour search, and division into requests.
#include <gtest/gtest.h>

#include "support/scene_support.hpp"
#include "support/snapshot_checks.hpp"

namespace pf::test {
namespace {

struct Case {
  const char* name;
  Settings settings;
  double dt_s;
};

std::vector<Case> cases() {
  std::vector<Case> list;
  for (const Boundary b : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    list.push_back({"court", court(3000, b), 4e-4});
    list.push_back({"gas", gas(3000, 0.4, b), 0.03});
  }
  Settings spring = gas(2000, 0.5);
  spring.method = Method::spring;
  list.push_back({"spring", spring, 0.002});
  return list;
}

std::uint64_t hash_after(const Settings& s, unsigned threads, double dt_s, int requests, int steps) {
  SceneRun run(s, threads);
  for (int k = 0; k < requests; ++k) run.advance(static_cast<std::uint32_t>(steps), dt_s);
  return run.backend->state_hash();
}

TEST(Determinism, AnyNumberOfThreads) {
  for (const Case& c : cases()) {
    const std::uint64_t one = hash_after(c.settings, 1, c.dt_s, 4, 50);
    for (const unsigned threads : {2U, 3U, 8U}) {
      EXPECT_EQ(hash_after(c.settings, threads, c.dt_s, 4, 50), one) << c.name << " with " << threads;
    }
  }
}

TEST(Determinism, GridEqualsAllPairs) {
  for (const Case& c : cases()) {
    Settings all_pairs = c.settings;
    all_pairs.neighbors = Neighbors::all_pairs;
    EXPECT_EQ(hash_after(c.settings, 2, c.dt_s, 2, 40), hash_after(all_pairs, 2, c.dt_s, 2, 40)) << c.name;
  }
}

TEST(Determinism, FewParcelsInFewCells) {
  for (const Boundary b : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const std::int64_t n : {1, 2, 5, 12}) {
      Settings grid = gas(n, 0.15, b);
      Settings all_pairs = grid;
      all_pairs.neighbors = Neighbors::all_pairs;
      EXPECT_EQ(hash_after(grid, 1, 0.05, 1, 400), hash_after(all_pairs, 1, 0.05, 1, 400)) << n;
    }
  }
}

TEST(Determinism, AnyDivisionIntoRequests) {
  const Settings s = court(2000, Boundary::walls);
  EXPECT_EQ(hash_after(s, 2, 4e-4, 1, 120), hash_after(s, 2, 4e-4, 120, 1));
}

TEST(Determinism, RestoredSnapshotHasTheSameState) {
  expect_restored_is_the_same_state(gas(1000), make_cpu_backend(2));
}

TEST(Determinism, RestoredSnapshotContinuesIdentically) {
  expect_restored_goes_on_as_it_did(gas(1000), make_cpu_backend(2));
  expect_heated_are_restored(make_cpu_backend(2));
}

}  // namespace
}  // namespace pf::test
