// What the window does that needs no window: aiming, the figures of the overlay, the legend of flights.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "support/scene_support.hpp"
#include "temporary_folder.hpp"
#include "view/aim.hpp"
#include "view/color_map.hpp"
#include "view/overlay_figures.hpp"
#include "view/scene_marks.hpp"

namespace pf {
namespace {

const BallLaunch kPresent = {{15.0, 0.0}, 25.0};

TEST(Aim, PullingBackLaunchesTheOtherWay) {
  Aim aim;
  aim.begin(kPresent, 1.0);
  aim.drag({-40.0, 0.0}, false);
  aim.drag({-20.0, -30.0}, false);
  const auto launch = aim.release();
  ASSERT_TRUE(launch);
  EXPECT_DOUBLE_EQ(launch->velocity_mps.x, 15.0);  // 60 px at a quarter of a m/s each
  EXPECT_DOUBLE_EQ(launch->velocity_mps.y, 7.5);
  EXPECT_EQ(launch->spin_radps, 25.0);
  EXPECT_FALSE(aim.active());
}

TEST(Aim, WithShiftThePullIsSpin) {
  Aim aim;
  aim.begin(kPresent, 2.0);
  aim.drag({5.0, 100.0}, true);
  EXPECT_EQ(aim.launch().velocity_mps, kPresent.velocity_mps);
  EXPECT_DOUBLE_EQ(aim.launch().spin_radps, 50.0);  // 50 layout pixels up
  aim.drag({0.0, -300.0}, true);
  EXPECT_DOUBLE_EQ(aim.release()->spin_radps, -25.0);
}

TEST(Aim, AClickLaunchesNothing) {
  Aim aim;
  aim.begin(kPresent, 1.0);
  aim.drag({1.0, -2.0}, false);
  EXPECT_FALSE(aim.release());
  aim.begin(kPresent, 1.0);
  aim.drag({-50.0, 0.0}, false);
  aim.cancel();
  EXPECT_FALSE(aim.release());
}

TEST(ColorMaps, LightnessRisesAllTheWay) {
  for (const ColorMap map : {ColorMap::viridis, ColorMap::cividis, ColorMap::grey}) {
    float before = -1.0F;
    for (int i = 0; i <= 40; ++i) {
      const Rgb c = color_at(map, static_cast<float>(i) / 40.0F);
      const float luma = 0.2126F * c[0] + 0.7152F * c[1] + 0.0722F * c[2];
      EXPECT_GT(luma, before) << static_cast<int>(map) << " " << i;
      before = luma;
    }
  }
}

struct Frames {
  Settings settings = test::court(1000);
  Physics physics = derive_physics(settings);
  FlightRecord flight;
  std::deque<FlightRecord> old_flights;
  FrameView view;

  Frames() {
    view.settings = &settings;
    view.physics = &physics;
    view.flight_record = &flight;
    view.old_flights = &old_flights;
    view.num_parcels = 1000;
    view.frame_totals.num_steps = 4;
    view.min_bytes_moved = 1e5;
    view.memory_bytes = 4321;
  }
};

PhaseTimes computing(double ms) {
  PhaseTimes times;
  times[Phase::collide_integrate] = ms;
  return times;
}

TEST(OverlayFigures, MedianAndPercentileOfTheLastFrames) {
  Frames frames;
  FrameHistory history;
  for (int i = 0; i < 500; ++i)
    history.add(computing(99.0), 99.0, frames.view);  // pushed out by what follows
  for (int i = 1; i <= 120; ++i) history.add(computing(i), 2.0 * i, frames.view);
  const OverlayFigures figures = history.figures(0.0);
  const auto phase = static_cast<std::size_t>(Phase::collide_integrate);
  EXPECT_DOUBLE_EQ(figures.phase_ms[phase].median, 60.5);
  EXPECT_DOUBLE_EQ(figures.phase_ms[phase].p99, 119.0);
  EXPECT_DOUBLE_EQ(figures.frame_ms.p99, 238.0);
  EXPECT_DOUBLE_EQ(figures.total_ms.median, 60.5);
  EXPECT_EQ(figures.copy_share, 0.0);
}

// 4 steps of 1000 parcels in 2 ms are 2 million parcel-steps a second; 1e5 bytes in 2 ms are 5e7 a second, a
// fifth of the copy's. Frames that stand still do not count.
TEST(OverlayFigures, RateAndShareOfCopying) {
  Frames frames;
  FrameHistory history;
  for (int i = 0; i < 10; ++i) history.add(computing(2.0), 16.0, frames.view);
  frames.view.frame_totals = {};
  frames.view.min_bytes_moved = 0.0;
  for (int i = 0; i < 10; ++i) history.add(computing(5.0), 16.0, frames.view);
  const OverlayFigures figures = history.figures(2.5e8);
  EXPECT_DOUBLE_EQ(figures.particle_steps_per_s, 2e6);
  EXPECT_DOUBLE_EQ(figures.copy_share, 0.2);
}

TEST(OverlayCsv, OneLinePerFrameWithEveryColumn) {
  TemporaryFolder folder;
  Frames frames;
  FrameHistory history;
  {
    OverlayCsv csv(folder.path() / "overlay.csv");
    for (int i = 0; i < 3; ++i) {
      history.add(computing(2.0), 16.0, frames.view);
      csv.add_line(computing(2.0), {1.0, 0.5}, 16.0, frames.view, history.figures(0.0),
                   {"gl", "host: reason, and more", 0.0});
    }
  }
  std::istringstream text(contents_of(folder.path() / "overlay.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 4U);
  const auto num_columns = [](const std::string& line) {
    return std::count(line.begin(), line.end(), ',') + 1;
  };
  for (const std::string& line : lines) EXPECT_EQ(num_columns(line), 4 + 3 * 12 + 17) << line;
  EXPECT_TRUE(lines[3].starts_with("2,"));
  EXPECT_TRUE(lines[3].ends_with(",1.0000,0.5000,,")) << lines[3];  // the panel's are not known
  EXPECT_NE(lines[3].find(",1000,impulse,grid,"), std::string::npos) << lines[3];
  EXPECT_NE(lines[3].find(",4321,host,"), std::string::npos) << lines[3];
}

TEST(FlightLegend, ComparesFlightsOfTheSameLaunchOnly) {
  Frames frames;
  frames.flight.launch = 2;
  frames.flight.method = Method::spring;
  FlightRecord first = frames.flight, other = frames.flight;
  first.method = Method::impulse;
  first.points_m = {{0.0F, 0.0F}, {1.0F, 0.0F}};
  first.times_s = {0.0, 1.0};
  first.start_energy_j = 2.0;
  first.end_energy_j = 1.5;
  frames.flight.points_m = {{0.0F, 0.0F}, {1.0F, 2.0F}};
  frames.flight.times_s = {0.0, 1.0};
  other.launch = 1;
  frames.old_flights = {first, other};
  const auto rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].method, "spring");
  EXPECT_EQ(rows[0].apart, "2.00 m, 2.00 m");
  EXPECT_EQ(rows[0].energy, "...");
  EXPECT_EQ(rows[1].apart, "-");
  EXPECT_EQ(rows[1].energy, "-25.000 %");
  EXPECT_EQ(rows[2].apart, "");
}

}  // namespace
}  // namespace pf
