// The same scene on one backend and on domains.
#pragma once

#include <gtest/gtest.h>

#include "backend/domains/domain_backend.hpp"
#include "domains/thread_ranks.hpp"
#include "support/golden_hashes.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

inline std::unique_ptr<Backend> domains(unsigned num, unsigned num_threads = 1) {
  return make_domain_backend(std::make_shared<LocalCarrier>(), num, num_threads, domain_gpus());
}

// On GPUs the tests are skipped where there is none.
class Domains : public testing::Test {
 protected:
  void SetUp() override {
    if (are_domains_on_gpus() && domain_gpus() == nullptr) GTEST_SKIP() << "no CUDA device";
  }
};

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
    EXPECT_EQ(report.totals.first_invalid_step, expected.totals.first_invalid_step);
    EXPECT_EQ(report.totals.impulse_sum_mps, expected.totals.impulse_sum_mps);
    EXPECT_EQ(report.totals.max_overlap_diameters, expected.totals.max_overlap_diameters);
    return report.totals;
  }
  void set_radius(double factor) {
    for (SceneRun* run : {&plain, &divided}) {
      run->physics.parcels.radius_m *= factor;
      run->backend->set_physics(run->physics);
    }
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

// All golden scenes but those of `exact`.
inline void expect_golden_states(const MakeBackend& make_backend) {
  std::map<std::string, std::string> expected = read_golden_hashes();
  int num_scenes = 0;
  for (const GoldenScene& scene : golden_scenes()) {
    if (scene.settings.method == Method::exact) continue;
    EXPECT_EQ(golden_line(scene, make_backend), expected[scene.name]) << scene.name;
    ++num_scenes;
  }
  EXPECT_GT(num_scenes, 20);
}

inline Settings busy_court(Boundary boundary, std::int64_t num_parcels = 3000) {
  Settings s = court(num_parcels, boundary);
  s.area_fraction = 0.3;
  s.restitution = 0.8;
  s.ball_vx_mps = 40.0;
  s.ball_vy_mps = 7.0;
  return s;
}

}  // namespace pf::test
