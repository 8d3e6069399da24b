// The layer of parcels that a fast ball pushes up: event for event against the serial reference, in windows
// so short that roundings do not grow, and that nothing overlaps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "exact/event_match.hpp"
#include "exact/exact_support.hpp"

namespace pf::test {
namespace {

struct LayerCase {
  const char* name;
  std::int64_t num;
  double area_fraction, restitution, speed_mps;
  double flown_s;  // before the first window
  double collisions_per_window;
  int num_windows;
  double contact_clock = 0.0;
};

void PrintTo(const LayerCase& c, std::ostream* out) { *out << c.name; }

Settings settings_of(const LayerCase& c) {
  Settings s = exact(court(c.num));
  s.area_fraction = c.area_fraction;
  s.restitution = c.restitution;
  s.contact_clock = c.contact_clock;
  s.magnus = false;
  s.ball_y_m = 0.0;
  s.ball_vx_mps = c.speed_mps;
  return s;
}

// Largest overlap of two parcels, position units.
double largest_overlap_units(const SceneRun& run, std::vector<Vec2i> position) {
  const double contact = 2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m;
  std::erase_if(position, [](Vec2i p) { return is_retired(p); });
  std::sort(position.begin(), position.end(), [](Vec2i a, Vec2i b) { return a.x < b.x; });
  double least2 = contact * contact;
  for (std::size_t i = 0; i < position.size(); ++i) {
    for (std::size_t j = i + 1; j < position.size(); ++j) {
      const Vec2d e = to_double(position[j]) - to_double(position[i]);
      if (e.x > contact) break;
      least2 = std::min(least2, dot(e, e));
    }
  }
  return contact - std::sqrt(least2);
}

class Layer : public testing::TestWithParam<LayerCase> {};

TEST_P(Layer, MatchesTheReference) {
  const LayerCase& c = GetParam();
  SceneRun run(settings_of(c), 2);
  const StepReport flown = run.advance(20, c.flown_s / 20.0);
  run.ball = flown.ball;
  MatchPlan plan;
  plan.flown_s = c.flown_s;
  plan.collisions_per_window = c.collisions_per_window;
  plan.num_windows = c.num_windows * test_scale();
  const MatchResult result = match_events(run, plan);
  const double contact = 2.0 * run.physics.parcels.radius_m / run.physics.world.unit_m;
  const double overlap = largest_overlap_units(run, run.backend->snapshot().position);
  std::printf(
      "%s: %llu events and %llu hits before; %llu events in %llu windows, %llu lists differ; times within "
      "%.1e diameters; overlap %.2f units\n",
      c.name, static_cast<unsigned long long>(flown.totals.num_collisions),
      static_cast<unsigned long long>(flown.totals.num_ball_hits),
      static_cast<unsigned long long>(result.num_events), static_cast<unsigned long long>(result.num_windows),
      static_cast<unsigned long long>(result.num_differences()), result.max_shift, overlap);
  EXPECT_EQ(result.num_unexplained, 0U) << result.first_unexplained;
  EXPECT_GT(result.num_events, 200U);
  EXPECT_LE(static_cast<double>(result.num_explained()), 6.0 + 2e-3 * static_cast<double>(result.num_events));
  EXPECT_LE(overlap, 4.0 + 1e-6 * contact);
}

INSTANTIATE_TEST_SUITE_P(Exact, Layer,
                         testing::Values(LayerCase{"2000_elastic", 2000, 0.4, 1.0, 15.0, 0.1, 0.01, 200},
                                         LayerCase{"2000_e09", 2000, 0.4, 0.9, 15.0, 0.1, 0.01, 200},
                                         LayerCase{"2000_e05", 2000, 0.1, 0.5, 15.0, 0.2, 0.01, 200},
                                         LayerCase{"2000_bullet", 2000, 0.1, 0.5, 300.0, 0.01, 0.01, 300},
                                         LayerCase{"5000_dense_e03", 5000, 0.6, 0.3, 15.0, 0.006, 0.002, 100},
                                         LayerCase{"20000_e09", 20000, 0.1, 0.9, 15.0, 0.2, 0.003, 60},
                                         LayerCase{"20000_e05", 20000, 0.4, 0.5, 15.0, 0.02, 0.003, 60},
                                         LayerCase{"20000_dense", 20000, 0.6, 1.0, 15.0, 0.05, 0.003, 60},
                                         LayerCase{"20000_e03", 20000, 0.1, 0.3, 15.0, 0.02, 0.003, 16},
                                         LayerCase{"20000_e03_default_clock", 20000, 0.1, 0.3, 15.0, 0.02,
                                                   0.003, 16, Settings{}.contact_clock},
                                         LayerCase{"20000_bullet", 20000, 0.1, 0.9, 300.0, 0.015, 0.003, 60}),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

// Parcels that the ball pushes together without restitution have many events while they move a few units, and
// each one rounds their positions. If nothing undid that, they would overlap by 3.9 units here.
TEST(Layer, OverlapsDoNotAddUpWithoutRestitution) {
  SceneRun run(settings_of({"", 20000, 0.6, 0.0, 40.0, 0.0, 0.0, 0, Settings{}.contact_clock}), 2);
  double overlap = 0.0;
  for (int frame = 0; frame < 90; ++frame) {
    run.ball = run.advance(4, 2e-4).ball;
    if (frame % 3 == 0)
      overlap = std::max(overlap, largest_overlap_units(run, run.backend->snapshot().position));
  }
  std::printf("overlap %.2f units\n", overlap);
  EXPECT_LE(overlap, 2.5);
}

}  // namespace
}  // namespace pf::test
