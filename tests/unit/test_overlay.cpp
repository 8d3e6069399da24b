// The overlay's size and its texts.
#include "view/overlay.hpp"

#include <gtest/gtest.h>

#include "core/progress_line.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"
#include "view/overlay_text.hpp"

namespace pf {
namespace {

TEST(Overlay, IsOneLineWhereItsColumnsDoNotFit) {
  const auto shown = [](float width, float height, float scale, OverlayMode mode = OverlayMode::full) {
    return Overlay::fitting_mode(mode, {0.0F, width, height, scale});
  };
  EXPECT_EQ(shown(1280.0F, 720.0F, 1.0F), OverlayMode::full);
  EXPECT_EQ(shown(2560.0F, 1440.0F, 2.0F), OverlayMode::full);
  EXPECT_EQ(shown(640.0F, 720.0F, 1.0F), OverlayMode::compact);
  EXPECT_EQ(shown(1400.0F, 300.0F, 1.0F), OverlayMode::compact);
  EXPECT_EQ(shown(1400.0F, 700.0F, 2.0F), OverlayMode::compact);
  EXPECT_EQ(shown(1280.0F, 720.0F, 1.0F, OverlayMode::off), OverlayMode::off);
}

TEST(Overlay, ALineDropsTheLeastImportantParts) {
  const auto width_of = [](const std::string& text) { return static_cast<float>(text.size()); };
  const std::vector<LinePart> parts = {{"60 frames/s", 3}, {"16.7 ms", 1}, {"t = 0.123 s", 6}};
  EXPECT_EQ(fitting_parts(parts, 100.0F, width_of), "60 frames/s   16.7 ms   t = 0.123 s");
  EXPECT_EQ(fitting_parts(parts, 30.0F, width_of), "60 frames/s   t = 0.123 s");
  EXPECT_EQ(fitting_parts(parts, 12.0F, width_of), "t = 0.123 s");
}

TEST(OverlayText, CountsWithTheirNoun) {
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "ball hit"), "1 ball hit");
  EXPECT_EQ(counted(1234567, "step"), "1,234,567 steps");
}

TEST(OverlayText, PaceOnAScreenOfAnotherRate) {
  const Settings settings = load_scene("court");
  ASSERT_EQ(settings.frame_rate_hz, 60.0);
  FrameView frame;
  frame.settings = &settings;
  frame.slow_motion = 0.05;
  EXPECT_EQ(pace_text(frame, 0.0), "20\xC3\x97 slow motion") << "a picture";
  EXPECT_EQ(pace_text(frame, 60.0), "20\xC3\x97 slow motion");
  EXPECT_EQ(pace_text(frame, 55.0), "20\xC3\x97 slow motion") << "nobody sees that";
  EXPECT_EQ(pace_text(frame, 8.0), "20\xC3\x97 slow motion, 150\xC3\x97 on screen");
  EXPECT_EQ(pace_text(frame, 240.0), "20\xC3\x97 slow motion, 5\xC3\x97 on screen");
  frame.slow_motion = 1.0;
  EXPECT_EQ(pace_text(frame, 120.0), "1 \xC3\x97 real time, 2 \xC3\x97 on screen");
  frame.slow_motion = 0.0;
  EXPECT_EQ(pace_text(frame, 8.0), "time stands still");
  frame.slow_motion = 0.1;
  frame.num_pictures = 3;
  EXPECT_EQ(pace_text(frame, 20.0), "3 pictures a frame, 30\xC3\x97 slow motion on screen");
}

TEST(OverlayText, BallMovesOrIsComparedWithTheory) {
  FrameView frame;
  frame.ball.velocity_mps = {3.0, -4.0};
  frame.ball.spin_radps = 25.04;
  frame.ball_distance_m = 1.5;
  const auto texts = [&] {
    std::string all;
    for (const NamedText& line : ball_texts(frame)) all += line.name + ": " + line.text + "\n";
    return all;
  };
  EXPECT_EQ(texts(), "ball: 5.00 m/s\nspin: 25.0 rad/s\nflown: 1.50 m\n");
  frame.free_flow = {1.0083, 0.0251, 0.99, 0.012};
  EXPECT_EQ(texts(), "held ball: of theory\ndrag: 100.8 \xC2\xB1 2.5 %\nhits: 99.0 \xC2\xB1 1.2 %\n");
}

TEST(Overlay, TellsTheTimeOfALaterFlight) {
  FrameView frame;
  FlightRecord flight;
  flight.number = 1;
  flight.times_s = {0.0, 0.6667};
  frame.simulated_s = 3.98;
  EXPECT_EQ(clock_text(frame), "t = 3.980 s");
  frame.flight_record = &flight;
  EXPECT_EQ(clock_text(frame), "t = 3.980 s");
  flight.number = 5;
  EXPECT_EQ(clock_text(frame), "t = 3.980 s, flight 5: 0.667 s");
}

TEST(Text, IsCutBetweenCharactersAndEscapedForXml) {
  const std::string cut = in_quotes(std::string(79, 'a') + "\xC3\xA4 and more");
  EXPECT_EQ(cut, "'" + std::string(79, 'a') + "...'");
  EXPECT_EQ(in_quotes(std::string(78, 'a') + "\xC3\xA4"), "'" + std::string(78, 'a') + "\xC3\xA4'");
  EXPECT_EQ(xml_text("a<b & \"c\"> \xC3\xA4 \xFF\x01"),
            "a&lt;b &amp; &quot;c&quot;&gt; \xC3\xA4 \xEF\xBF\xBD");
}

TEST(ProgressLine, SaysWhatIsLeftOnceSomethingIsDone) {
  EXPECT_EQ(time_left_text(0.0, 5.0), "");
  EXPECT_EQ(time_left_text(0.25, 5.0), "; about 15 s left");
  EXPECT_EQ(time_left_text(1.0, 5.0), "; about 0 s left");
}

}  // namespace
}  // namespace pf
