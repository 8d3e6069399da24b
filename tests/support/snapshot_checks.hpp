// Checks that every backend restores a snapshot.
#pragma once

#include <gtest/gtest.h>

#include "support/scene_support.hpp"

namespace pf::test {

inline void expect_restored_is_the_same_state(const Settings& s, std::unique_ptr<Backend> backend) {
  SceneRun run(s, std::move(backend));
  run.advance(50);
  const std::uint64_t hash = run.backend->state_hash();
  run.backend->restore(run.backend->snapshot());
  EXPECT_EQ(run.backend->state_hash(), hash);
}

// The snapshot includes the count of steps, which keys the random roundings.
inline void expect_restored_goes_on_as_it_did(const Settings& s, std::unique_ptr<Backend> backend) {
  SceneRun run(s, std::move(backend));
  run.advance(50);
  const ParcelSnapshot then = run.backend->snapshot();
  run.advance(30);
  const std::uint64_t hash = run.backend->state_hash();
  run.backend->restore(then);
  run.advance(30);
  EXPECT_EQ(run.backend->state_hash(), hash);
}

// The snapshot includes which parcels are heated, which decides about the impulses of the next step.
inline void expect_heated_are_restored(std::unique_ptr<Backend> backend) {
  Settings s = gas(1500, 0.65);
  s.dt_s = 0.04;
  SceneRun run(s, std::move(backend));
  ParcelSnapshot then;
  for (int k = 0; k < 60 && then.heated.size() < 5; ++k) {
    run.advance(1);
    then = run.backend->snapshot();
  }
  ASSERT_GE(then.heated.size(), 5U);
  run.advance(5);
  const std::uint64_t hash = run.backend->state_hash();
  run.backend->restore(then);
  EXPECT_EQ(run.backend->snapshot().heated, then.heated);
  run.advance(5);
  EXPECT_EQ(run.backend->state_hash(), hash);
  then.heated.clear();
  run.backend->restore(then);
  run.advance(5);
  EXPECT_NE(run.backend->state_hash(), hash);
}

}  // namespace pf::test
