// Parts of the window that need no window: aiming, the overlay's figures and colours, the legend of flights.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "support/scene_support.hpp"
#include "temporary_folder.hpp"
#include "unit/frames.hpp"
#include "view/aim.hpp"
#include "view/color_map.hpp"
#include "view/legend_place.hpp"
#include "view/overlay_figures.hpp"
#include "view/phase_styles.hpp"
#include "view/scene_marks.hpp"
#include "view/setting_rows.hpp"
#include "view/slide.hpp"

namespace pf {
namespace {

const BallLaunch kCurrent = {{15.0, 0.0}, 25.0};

TEST(Aim, PullingBackLaunchesTheOtherWay) {
  Aim aim;
  aim.begin(kCurrent, 1.0);
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
  aim.begin(kCurrent, 2.0);
  aim.drag({5.0, 100.0}, true);
  EXPECT_EQ(aim.launch().velocity_mps, kCurrent.velocity_mps);
  EXPECT_DOUBLE_EQ(aim.launch().spin_radps, 50.0);  // 50 layout pixels up
  aim.drag({0.0, -300.0}, true);
  EXPECT_DOUBLE_EQ(aim.release()->spin_radps, -25.0);
}

TEST(Aim, AClickLaunchesNothing) {
  Aim aim;
  aim.begin(kCurrent, 1.0);
  aim.drag({1.0, -2.0}, false);
  EXPECT_FALSE(aim.release());
  aim.begin(kCurrent, 1.0);
  aim.drag({-50.0, 0.0}, false);
  aim.cancel();
  EXPECT_FALSE(aim.release());
}

TEST(Refusal, NamesTheRangeAndTheUnit) {
  EXPECT_EQ(refusal_of(7.0, {0.0, 1.0}), "7 is not within 0 to 1; nothing changed");
  EXPECT_EQ(refusal_of(-5.0, {1.0, 200e6}), "-5 is not within 1 to 200 million; nothing changed");
  EXPECT_EQ(refusal_of(1e9, {0.0, 1e3, "s"}), "1000000000 is not within 0 to 1000 s; nothing changed");
  EXPECT_EQ(refusal_of(99999999.0, {0.0, 1e3}), "99999999 is not within 0 to 1000; nothing changed")
      << "as typed";
  EXPECT_EQ(refusal_of(std::nan(""), {0.0, 1.0}), "nan is not within 0 to 1; nothing changed");
  EXPECT_EQ(refusal_of(0.0, {0.0, 1.0}), "");
  EXPECT_EQ(refusal_of(1.0, {0.0, 1.0}), "");
}

TEST(Sliders, TheKnobIsWhereTheValueIs) {
  EXPECT_DOUBLE_EQ(knob_share(0.25, 0.0, 1.0, false), 0.25);
  EXPECT_DOUBLE_EQ(knob_share(-200.0, -200.0, 200.0, false), 0.0);
  EXPECT_DOUBLE_EQ(knob_share(0.1, 0.01, 1.0, true), 0.5);
  EXPECT_EQ(knob_share(0.0, 0.0, 0.1, true), 0.0) << "an automatic time step";
  EXPECT_EQ(knob_share(300.0, 0.0, 60.0, false), 1.0) << "typed beyond the slider's end";
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

PhaseTimes computing(double ms) {
  PhaseTimes times;
  times[Phase::collide_integrate] = ms;
  return times;
}

TEST(OverlayFigures, MedianAndPercentileOfTheLastFrames) {
  Frames frames;
  FrameHistory history;
  for (int i = 0; i < 500; ++i)
    history.add(computing(99.0), 99.0, frames.view);  // pushed out by the next 120
  for (int i = 1; i <= 120; ++i) history.add(computing(i), 2.0 * i, frames.view);
  const OverlayFigures figures = history.figures(0.0);
  const auto phase = static_cast<std::size_t>(Phase::collide_integrate);
  EXPECT_DOUBLE_EQ(figures.phase_ms[phase].median, 60.5);
  EXPECT_DOUBLE_EQ(figures.phase_ms[phase].p99, 119.0);
  EXPECT_DOUBLE_EQ(figures.frame_ms.p99, 238.0);
  EXPECT_DOUBLE_EQ(figures.total_ms.median, 60.5);
  EXPECT_EQ(figures.copy_share, 0.0);
}

TEST(OverlayFigures, StayWhileTheBallHasLeft) {
  Frames frames;
  FrameHistory history;
  for (int i = 0; i < 10; ++i) history.add(computing(2.0), 16.0, frames.view);
  frames.view.flight = Flight::landed;
  history.add(computing(2.0), 16.0, frames.view);  // the step in which it left
  frames.view.frame_totals = {};
  for (int i = 0; i < 500; ++i) history.add({}, 16.0, frames.view);
  EXPECT_EQ(history.size(), 11U);
  const auto phase = static_cast<std::size_t>(Phase::collide_integrate);
  EXPECT_DOUBLE_EQ(history.figures(0.0).phase_ms[phase].median, 2.0);
  frames.view.flight = Flight::flying;
  for (int i = 0; i < 120; ++i) history.add({}, 16.0, frames.view);
  EXPECT_EQ(history.figures(0.0).phase_ms[phase].median, 0.0) << "the next flight has its own";
}

TEST(OverlayFigures, BeginAnewWithOtherWork) {
  Frames frames;
  FrameHistory history;
  const auto phase = static_cast<std::size_t>(Phase::collide_integrate);
  const auto expect_anew = [&](const char* after) {
    EXPECT_GT(history.size(), 1U) << after;
    const std::size_t num_before = history.num_added();
    history.add(computing(5.0), 20.0, frames.view);
    EXPECT_EQ(history.size(), 1U) << after;
    EXPECT_EQ(history.num_added(), num_before + 1) << after;
    EXPECT_DOUBLE_EQ(history.figures(0.0).phase_ms[phase].median, 5.0) << after;
    EXPECT_DOUBLE_EQ(history.figures(0.0).frame_ms.p99, 20.0) << after;
    for (int i = 0; i < 130; ++i) history.add(computing(2.0), 16.0, frames.view);
    EXPECT_EQ(history.size(), FrameHistory::kNumKept) << after;
    EXPECT_DOUBLE_EQ(history.figures(0.0).phase_ms[phase].p99, 2.0) << after;
  };
  for (int i = 0; i < 50; ++i) history.add(computing(2.0), 16.0, frames.view);
  ++frames.view.num_flights;
  history.add(computing(2.0), 16.0, frames.view);
  EXPECT_EQ(history.size(), 51U) << "a launch goes on";
  ++frames.view.num_scenes;
  expect_anew("another scene");
  frames.settings.method = Method::exact;
  expect_anew("another method");
  frames.view.num_parcels = 500;
  expect_anew("another number of parcels");
}

// Method exact spends its step in phases of its own.
TEST(OverlayFigures, StepTimeIncludesEveryPhaseOfAStep) {
  PhaseTimes times;
  for (std::size_t phase = 0; phase < kNumPhases; ++phase) times.ms[phase] = std::exp2(phase);
  EXPECT_EQ(times.step_ms(), std::exp2(kNumStepPhases) - 1.0);
  Frames frames;
  FrameHistory history;
  PhaseTimes exact;
  exact[Phase::predict] = exact[Phase::solve] = exact[Phase::reconcile] = exact[Phase::commit] = 0.5;
  history.add(exact, 16.0, frames.view);
  EXPECT_DOUBLE_EQ(history.figures(0.0).parcel_steps_per_s, 2e6);
}

TEST(OverlayPhases, EveryPhaseHasARow) {
  std::vector<Phase> shown(picture_phases().begin(), picture_phases().end());
  for (const Method method : {Method::impulse, Method::exact}) {
    EXPECT_LE(step_phases(method).size(), 6U) << "rows of the overlay";
    shown.insert(shown.end(), step_phases(method).begin(), step_phases(method).end());
  }
  for (const PhaseStyle& style : kPhaseStyles)
    EXPECT_NE(std::find(shown.begin(), shown.end(), style.phase), shown.end()) << style.label;
}

using Matrix = std::array<std::array<double, 3>, 3>;

double linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

// CIELAB (CIE 1976, white D65) of a colour. eye: matrix of linear RGB that simulates a vision.
std::array<double, 3> lab_of(const PhaseStyle& style, const Matrix& eye) {
  std::array<double, 3> rgb{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) rgb[i] += eye[i][j] * linear(style.color[j] / 255.0);
    rgb[i] = std::clamp(rgb[i], 0.0, 1.0);
  }
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0; };
  const double x = f((0.4124 * rgb[0] + 0.3576 * rgb[1] + 0.1805 * rgb[2]) / 0.95047);
  const double y = f(0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
  const double z = f((0.0193 * rgb[0] + 0.1192 * rgb[1] + 0.9505 * rgb[2]) / 1.08883);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

// Full dichromacy (Machado, Oliveira and Fernandes 2009).
TEST(OverlayPhases, ColoursDifferForColourBlindEyes) {
  const Matrix eyes[] = {
      {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
      {{{0.152286, 1.052583, -0.204868}, {0.114503, 0.786281, 0.099216}, {-0.003882, -0.048116, 1.051998}}},
      {{{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}}},
      {{{1.255528, -0.076749, -0.178779}, {-0.078411, 0.930809, 0.147602}, {0.004733, 0.691367, 0.303900}}}};
  for (const Method method : {Method::impulse, Method::exact}) {
    std::vector<Phase> shown(step_phases(method).begin(), step_phases(method).end());
    shown.insert(shown.end(), picture_phases().begin(), picture_phases().end());
    for (const Matrix& eye : eyes) {
      for (std::size_t i = 0; i < shown.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          const auto a = lab_of(style_of(shown[i]), eye);
          const auto b = lab_of(style_of(shown[j]), eye);
          EXPECT_GT(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), 20.0)
              << style_of(shown[i]).label << " and " << style_of(shown[j]).label;
        }
      }
    }
  }
}

struct WorldInWindow {
  Settings settings;
  ViewRegion free = {318.0, 150.0, 962.0, 570.0};
  LegendSize legend = {300.0, 92.0};

  World world() const { return derive_physics(settings).world; }
  // Area of the legend beside the world, in square pixels.
  double overlap() const {
    Camera camera;
    fit_world(camera, world(), region_beside(free, legend, world(), 1.0F), 1.0F);
    const ViewRegion world_px = region_of_world(camera, world());
    return overlap_px2(place_legend(free, legend, world_px), world_px);
  }
};

TEST(LegendPlace, StandsBesideACourtInWindowsOfAnyShape) {
  WorldInWindow window;
  window.settings = test::court(100);
  for (const double width_px : {482.0, 768.0, 962.0, 1920.0}) {
    for (const double height_px : {300.0, 570.0, 1000.0}) {
      for (const double legend_px : {92.0, 177.0}) {
        window.free.width_px = width_px;
        window.free.height_px = height_px;
        window.legend.height_px = legend_px;
        EXPECT_EQ(window.overlap(), 0.0) << width_px << " x " << height_px << ", legend " << legend_px;
      }
    }
  }
}

TEST(LegendPlace, StandsAtTheSideOfASquareWorld) {
  WorldInWindow window;
  window.settings = test::court(100);
  window.settings.width_m = window.settings.height_m = 6.1;
  window.settings.ball_x_m = window.settings.ball_y_m = 0.0;
  const ViewRegion region = region_beside(window.free, window.legend, window.world(), 1.0F);
  EXPECT_EQ(region.height_px, window.free.height_px);
  EXPECT_EQ(window.overlap(), 0.0);
}

// After zooming in, the world covers all but the left of the free region.
TEST(LegendPlace, TakesTheCornerWithLeastOfTheWorld) {
  const WorldInWindow window;
  const ViewRegion world = {700.0, 200.0, 2000.0, 2000.0};
  const ViewRegion at = place_legend(window.free, window.legend, world);
  EXPECT_EQ(at.left_px, window.free.left_px);
  const ViewRegion everywhere = {0.0, 0.0, 2000.0, 2000.0};
  const ViewRegion usual = place_legend(window.free, window.legend, everywhere);
  EXPECT_EQ(usual.left_px + usual.width_px, 1280.0);
  EXPECT_EQ(usual.bottom_px + usual.height_px, 720.0);
}

// 4 steps of 1000 parcels in 2 ms are 2 million parcel-steps a second; 1e5 bytes in 2 ms are 5e7 a second, a
// fifth of the copy's. Frames without steps do not count.
TEST(OverlayFigures, RateAndShareOfCopying) {
  Frames frames;
  FrameHistory history;
  for (int i = 0; i < 10; ++i) history.add(computing(2.0), 16.0, frames.view);
  frames.view.frame_totals = {};
  frames.view.min_bytes_moved = 0.0;
  for (int i = 0; i < 10; ++i) history.add(computing(5.0), 16.0, frames.view);
  const OverlayFigures figures = history.figures(2.5e8);
  EXPECT_DOUBLE_EQ(figures.parcel_steps_per_s, 2e6);
  EXPECT_DOUBLE_EQ(figures.copy_share, 0.2);
}

TEST(OverlayFigures, TheRateIsThatOfTheAirShown) {
  Frames frames;
  FrameHistory history;
  for (int i = 0; i < 10; ++i) history.add(computing(2.0), 16.0, frames.view);
  frames.view.num_parcels = 0;  // a vacuum, while the ball has left
  frames.view.flight = Flight::landed;
  frames.view.frame_totals = {};
  history.add({}, 16.0, frames.view);
  EXPECT_EQ(history.figures(2.5e8).parcel_steps_per_s, 0.0);
  frames.view.flight = Flight::flying;
  frames.view.num_parcels = 500;
  frames.view.frame_totals.num_steps = 4;
  history.add(computing(2.0), 16.0, frames.view);
  EXPECT_DOUBLE_EQ(history.figures(2.5e8).parcel_steps_per_s, 1e6);
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
                   {"host: reason, and more", 0.0});
    }
  }
  std::istringstream text(contents_of(folder.path() / "overlay.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 4U);
  const auto num_columns = [](const std::string& line) {
    return std::count(line.begin(), line.end(), ',') + 1;
  };
  for (const std::string& line : lines)
    EXPECT_EQ(num_columns(line), 4 + 3 * (2 + int{kNumPhases}) + 21) << line;
  EXPECT_TRUE(lines[3].starts_with("2,"));
  EXPECT_TRUE(lines[3].ends_with(",1.0000,0.5000,,,0,0,0,1")) << lines[3];  // the panel's are not known
  EXPECT_NE(lines[3].find(",1000,impulse,grid,"), std::string::npos) << lines[3];
  EXPECT_NE(lines[3].find(",4321,host,"), std::string::npos) << lines[3];
}

}  // namespace
}  // namespace pf
