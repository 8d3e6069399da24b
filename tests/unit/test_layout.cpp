// Everything drawn over the scene lies within the picture at every size, and nothing overlaps.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "unit/frames.hpp"
#include "view/inset_place.hpp"
#include "view/legend_columns.hpp"
#include "view/overlay_paint.hpp"
#include "view/panel.hpp"
#include "view/scene_marks.hpp"
#include "view/slide.hpp"
#include "view/timeline_bar.hpp"

namespace pf {
namespace {

TEST(InsetPlace, KeepsClearOfBallLegendAndNotices) {
  const PxRect free = {318.0F, 0.0F, 1280.0F, 560.0F};
  InsetRequest request = {free, 190.0F, 10.0F, {}, {}, {}};
  for (float x = 318.0F; x < 1280.0F; x += 40.0F) {
    for (float y = 0.0F; y < 560.0F; y += 40.0F) {
      request.keep_clear = {
          {900.0F, 0.0F, 1280.0F, 92.0F}, {500.0F, 10.0F, 800.0F, 40.0F}, square_around(x, y, 30.0F)};
      const auto place = place_inset(request);
      ASSERT_TRUE(place) << x << " " << y;
      EXPECT_TRUE(is_within(*place, free));
      EXPECT_EQ(overlap_px2(*place, request.keep_clear), 0.0F) << x << " " << y;
    }
  }
}

TEST(InsetPlace, StaysUntilTheBallComes) {
  InsetRequest request = {{0.0F, 0.0F, 1000.0F, 600.0F}, 200.0F, 10.0F, {}, {}, {}};
  request.keep_clear = {square_around(100.0F, 300.0F, 20.0F)};
  const auto first = place_inset(request);
  ASSERT_TRUE(first);
  request.before = first;
  request.keep_clear = {square_around(700.0F, 100.0F, 20.0F)};
  EXPECT_EQ(place_inset(request), first);
  request.keep_clear = {square_around(0.5F * (first->x0 + first->x1), first->y0 + 30.0F, 20.0F)};
  const auto moved = place_inset(request);
  ASSERT_TRUE(moved);
  EXPECT_FALSE(*moved == *first);
}

TEST(InsetPlace, ChoosesTheCornerWithoutAPath) {
  InsetRequest request = {{0.0F, 0.0F, 1000.0F, 600.0F}, 200.0F, 10.0F, {}, {}, {}};
  for (float x = 0.0F; x < 1000.0F; x += 5.0F) request.path_px.push_back({x, 500.0F});
  const auto place = place_inset(request);
  ASSERT_TRUE(place);
  EXPECT_LT(place->y1, 500.0F);
}

TEST(InsetPlace, NoneWhereThereIsNoRoom) {
  EXPECT_FALSE(place_inset({{0.0F, 0.0F, 200.0F, 150.0F}, 190.0F, 10.0F, {}, {}, {}}));
}

TEST(Labels, StandBesideEachOther) {
  const PxRect free = {0.0F, 0.0F, 800.0F, 600.0F};
  const std::vector<PxRect> wanted(5, PxRect{785.0F, 300.0F, 800.0F, 320.0F});
  const std::vector<PxRect> legend = {{600.0F, 200.0F, 800.0F, 310.0F}};
  std::vector<PxRect> places = place_labels(wanted, free, legend);
  ASSERT_EQ(places.size(), 5U);
  places.push_back(legend.front());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_TRUE(is_within(places[i], free));
    for (std::size_t j = 0; j < i; ++j) EXPECT_EQ(overlap_px2(places[i], places[j]), 0.0F) << i << " " << j;
  }
}

TEST(Sliders, TheNumberStandsWhereTheKnobIsNot) {
  for (const double share : {0.0, 0.3, 0.5, 0.51, 1.0}) {
    const BesideKnob room = beside_knob(100.0F, 300.0F, 12.0F, share, 4.0F);
    const float knob = 102.0F + static_cast<float>(share) * 184.0F;
    EXPECT_TRUE(room.x1 <= knob || room.x0 >= knob + 12.0F) << share;
    EXPECT_GT(room.x1 - room.x0, 75.0F) << share;
    EXPECT_TRUE(room.x0 >= 100.0F && room.x1 <= 300.0F) << share;
  }
  EXPECT_DOUBLE_EQ(last_decimal("%.5f free times"), 1e-5);
  EXPECT_NEAR(knob_share(5.2e-4, 0.0, 0.1, true, last_decimal("%.6f s")), 0.543, 1e-3) << "as ImGui draws it";
  EXPECT_EQ(number_text("%.3f", 0.1), "0.100");
  EXPECT_EQ(number_text("%.3f", 0.0005), "0.0005") << "not 0.001";
  EXPECT_EQ(number_text("%.5f kg", 1.87e-5), "1.87e-05 kg");
  EXPECT_EQ(number_text("%.6f s", 2e-7), "2e-07 s");
  EXPECT_EQ(number_text("%.1f rad/s", -0.04), "-0.04 rad/s");
  EXPECT_EQ(number_text("%.1f rad/s", 0.0), "0.0 rad/s");
  EXPECT_EQ(number_text("automatic", 0.0), "automatic");
  EXPECT_EQ(number_text("1.15e-14", 0.1), "1.15e-14");
  EXPECT_EQ(without_unit("0.00100 free times"), "0.00100");
  EXPECT_EQ(without_unit("-12.5 rad/s"), "-12.5");
  EXPECT_EQ(without_unit("as time scale asks"), "as time scale asks");
}

TEST(LegendColumns, EnergyAndCostOutliveSpeedAndSpin) {
  const auto has = [](int level, std::string FlightRow::*cell) {
    const auto columns = legend_columns(level);
    return std::any_of(columns.begin(), columns.end(), [&](const LegendColumn& c) { return c.cell == cell; });
  };
  EXPECT_EQ(legend_columns(0).size(), 7U);
  EXPECT_TRUE(has(5, &FlightRow::energy) && has(5, &FlightRow::cost) && has(5, &FlightRow::apart_end));
  EXPECT_FALSE(has(5, &FlightRow::speed) || has(5, &FlightRow::spin));
  for (int level = 0; level <= kMaxLegendLevel; ++level) {
    EXPECT_NE(has(level, &FlightRow::method), has(level, &FlightRow::name)) << level;
    EXPECT_TRUE(has(level, &FlightRow::number));
  }
  EXPECT_EQ(legend_columns(kMaxLegendLevel).size(), 2U);
}

// Text without a window.
class WithText : public ::testing::Test {
 protected:
  void SetUp() override { context_ = ImGui::CreateContext(); }
  void TearDown() override { ImGui::DestroyContext(context_); }

  static void begin(float width, float height, float scale) {
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = ImVec2(width, height);
    io.DeltaTime = 1.0F / 60.0F;
    io.Fonts->Clear();
    const char* dejavu = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
    if (std::filesystem::exists(dejavu)) {
      io.Fonts->AddFontFromFileTTF(dejavu, 14.0F * scale);
    } else {
      ImFontConfig usual;
      usual.SizePixels = 14.0F * scale;
      io.Fonts->AddFontDefault(&usual);
    }
    unsigned char* pixels = nullptr;
    int texture_width = 0;
    int texture_height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &texture_width, &texture_height);
    ImGui::NewFrame();
  }

 private:
  ImGuiContext* context_ = nullptr;
};

// A complete flight across the court with long figures.
FlightRecord flight_of(int number, Method method) {
  FlightRecord flight;
  flight.number = number;
  flight.launch = 1;
  flight.method = method;
  flight.disturbed = number == 2;
  flight.half_step = number > 3;
  flight.launch_mps = {15.234, 0.0};
  flight.spin_radps = -104.7;
  for (int i = 0; i <= 100; ++i) {
    flight.points_m.push_back(
        {-6.7F + 0.14F * static_cast<float>(i), 0.001F * static_cast<float>(number * i)});
    flight.times_s.push_back(0.00712 * i);
  }
  flight.num_steps = 1234;
  flight.compute_ms = 1234.5;
  flight.start_energy_j = 2.93;
  flight.end_energy_j = 2.5123;
  return flight;
}

struct Stand {
  float width, height, scale;
  bool has_panel;
  int num_flights;
};

std::string text_of(const Stand& s) {
  return std::to_string(s.width) + " x " + std::to_string(s.height) + ", scale " + std::to_string(s.scale) +
         (s.has_panel ? ", panel, " : ", ") + std::to_string(s.num_flights) + " flights";
}

class Layout : public WithText {
 protected:
  // Rectangles of the marks, after two frames as in a window.
  std::map<std::string, PxRect> marks_of(const Stand& stand) {
    Frames frames;
    for (int i = 1; i < stand.num_flights; ++i)
      frames.old_flights.push_front(flight_of(i, static_cast<Method>(i % 3)));
    frames.flight = flight_of(stand.num_flights, Method::exact);
    frames.view.half_step = stand.num_flights > 3;
    frames.view.ball.position_m = {7.0, 0.0};
    frames.view.profile = profile_;
    Panel panel(1000, "host: CPU backend", "llvmpipe");
    panel.fit(stand.width, 1.0F);
    const float left = stand.has_panel ? panel.width_px(stand.scale) : 0.0F;
    free_ = {left, 0.0F, stand.width, stand.height};
    const OverlayPlace strip = {left, free_.width(), stand.height, stand.scale};
    const OverlayMode mode = Overlay::fitting_mode(OverlayMode::full, strip);
    free_.y1 -= Overlay::height_px(mode, stand.scale);
    SceneMarks marks;
    for (int frame = 0; frame < 2; ++frame) show(marks, frames, stand);
    ControlMap controls;
    marks.note(controls);
    std::map<std::string, PxRect> rectangles;
    const auto json = nlohmann::json::parse(controls.text());
    for (const auto& [name, r] : json.items()) rectangles[name] = {r[0], r[1], r[2], r[3]};
    return rectangles;
  }

  void show(SceneMarks& marks, const Frames& frames, const Stand& stand) {
    begin(stand.width, stand.height, stand.scale);
    const ViewRegion region = {free_.x0, stand.height - free_.y1, free_.width(), free_.height()};
    const Look look;
    Camera camera;
    fit_world(camera, frames.physics.world, marks.region_for_world(frames.view, look, region, stand.scale),
              stand.scale);
    camera.metres_per_px /= zoom_;
    const OverlayPlace place = {free_.x0, free_.width(), free_.y1, stand.scale};
    const float side = Magnifier::side_px(free_.width(), free_.height(), stand.scale);
    marks.show(frames.view, {camera, place, stand.height, look, side, 0.001}, notices_);
    drawn_ = {1e9F, 1e9F, -1e9F, -1e9F};
    for (const ImDrawVert& vertex : ImGui::GetBackgroundDrawList()->VtxBuffer) {
      drawn_ = {std::min(drawn_.x0, vertex.pos.x), std::min(drawn_.y0, vertex.pos.y),
                std::max(drawn_.x1, vertex.pos.x), std::max(drawn_.y1, vertex.pos.y)};
    }
    ImGui::EndFrame();
  }

  PxRect free_, drawn_;
  WindowNotices notices_;
  const Profile* profile_ = nullptr;
  double zoom_ = 1.0;
};

TEST_F(Layout, MarksStandBesideEachOtherWithinTheWindow) {
  notices_ = {"0:12  court.mp4, 3 dropped", "picture \"court_t0.1234s.png\"", "Back to 0.25 s"};
  for (const auto& [width, height] : {std::pair(1280.0F, 720.0F), {1440.0F, 900.0F}, {1920.0F, 1080.0F}}) {
    for (const float scale : {1.0F, 2.0F}) {
      for (const bool has_panel : {true, false}) {
        for (const int num_flights : {1, 2, 5}) {
          const Stand stand = {width, height, scale, has_panel, num_flights};
          const auto marks = marks_of(stand);
          ASSERT_TRUE(marks.contains("Legend")) << text_of(stand);
          EXPECT_TRUE(is_within(drawn_, grown(free_, 1.0F)))
              << text_of(stand) << ": drawn from " << drawn_.x0 << ", " << drawn_.y0 << " to " << drawn_.x1
              << ", " << drawn_.y1 << ", free from " << free_.x0 << ", " << free_.y0 << " to " << free_.x1
              << ", " << free_.y1 << "; legend to " << marks.at("Legend").y1;
          for (const auto& [name, rectangle] : marks) {
            EXPECT_TRUE(is_within(rectangle, free_)) << name << " at " << text_of(stand);
            for (const auto& [other, place] : marks)
              EXPECT_TRUE(name >= other || overlap_px2(rectangle, place) == 0.0F)
                  << name << " and " << other << " at " << text_of(stand);
          }
        }
      }
    }
  }
}

// Also where the world fills the picture, as while the camera follows the ball.
TEST_F(Layout, NothingLiesUnderAProfile) {
  Settings settings = test::court(1000);
  settings.profile = ProfileAxis::x;
  const Simulation simulation(settings, make_cpu_backend(1));
  profile_ = simulation.view().profile;
  notices_ = {"0:12  court.mp4, 3 dropped", "picture \"court_t0.1234s.png\"", "Back to 0.25 s"};
  for (const double zoom : {1.0, 5.0}) {
    zoom_ = zoom;
    for (const int num_flights : {1, 2}) {
      const auto marks = marks_of({1280.0F, 720.0F, 1.0F, true, num_flights});
      ASSERT_TRUE(marks.contains("profile") && marks.contains("Legend"));
      EXPECT_TRUE(is_within(marks.at("profile"), free_));
      for (const auto& [name, rectangle] : marks)
        EXPECT_TRUE(name == "profile" || overlap_px2(rectangle, marks.at("profile")) == 0.0F)
            << name << ", zoom " << zoom;
    }
  }
}

TEST_F(Layout, NoticesStayAboveTheOverlayWithVeryLargeText) {
  notices_ = {"0:12  court.mp4, 3 dropped", "picture \"court_t0.1234s.png\"", "Back to 0.25 s"};
  for (const auto& [name, rectangle] : marks_of({640.0F, 480.0F, 2.8F, true, 2})) {
    if (name.find("notice") == std::string::npos) continue;
    EXPECT_TRUE(rectangle.y0 >= 0.0F && rectangle.y1 <= free_.y1) << name;
  }
}

// In the narrowest window, too, with the longest times of a talk.
TEST_F(Layout, TheTimeStandsBesideItsBar) {
  for (const float scale : {1.0F, 2.0F, 2.4F, 3.0F}) {
    Panel panel(1000, "host", "llvmpipe");
    panel.fit(640.0F, 1.0F);
    for (const float left : {0.0F, panel.width_px(scale)}) {
      for (const double time_s : {0.487, 123.456}) {
        Frames frames;
        FlightHistory history;
        history.begin(0.0);
        history.pass_frame({time_s, 1, 0});
        frames.view.history = &history;
        frames.view.paused = true;
        begin(640.0F, 480.0F, scale);
        TimelineBar bar;
        ControlMap controls;
        bar.edit(frames.view, {left, 640.0F - left, 480.0F, scale}, Theme::dark, controls);
        ImGui::EndFrame();
        const auto places = nlohmann::json::parse(controls.text());
        const auto time = places.at(fmt::format("Time {:.4f} s", time_s));
        EXPECT_GE(time[0].get<float>(), left) << scale << ", " << time_s;
        EXPECT_LT(time[2], places.at("Timeline")[0]) << scale << ", " << time_s;
        EXPECT_GE(time[3].get<float>() - time[1].get<float>(), 12.0F) << "it can be read";
      }
    }
  }
}

TEST_F(Layout, ATextIsMadeSmallerToFit) {
  begin(640.0F, 480.0F, 3.0F);
  const std::string time = "t = 123.456 s";
  const float width = text_width(time);
  EXPECT_EQ(fitting_size(time, width + 1.0F), 1.0F);
  EXPECT_EQ(fitting_size("", 100.0F), 1.0F);
  EXPECT_LE(text_width(time, fitting_size(time, 0.6F * width)), 0.62F * width);
  ImGui::EndFrame();
}

TEST_F(Layout, TheMagnifierHasAPlace) {
  for (const float scale : {1.0F, 2.0F}) {
    const auto marks = marks_of({1280.0F, 720.0F, scale, true, 2});
    EXPECT_TRUE(marks.contains("Magnifier square")) << scale;
  }
}

TEST_F(Layout, ThePanelTakesAtMostAThirdOrSo) {
  Panel panel(1000, "host", "llvmpipe");
  panel.fit(1280.0F, 1.0F);
  EXPECT_FLOAT_EQ(panel.width_px(1.0F), 318.0F);
  EXPECT_LT(panel.width_px(2.0F), 0.37F * 1280.0F);
  EXPECT_GT(panel.width_px(2.0F), 1.3F * 318.0F);
  panel.fit(1920.0F, 1.0F);
  EXPECT_FLOAT_EQ(panel.width_px(2.0F), 636.0F);
  panel.fit(960.0F, 2.0F);  // a dense screen: text keeps its size
  EXPECT_FLOAT_EQ(panel.width_px(2.0F), 636.0F);
}

}  // namespace
}  // namespace pf
