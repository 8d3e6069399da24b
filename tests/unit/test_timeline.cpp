// Parts of timeline and clip that need no window.
#include <gtest/gtest.h>

#include "app/flight_history.hpp"
#include "view/last_seconds.hpp"
#include "view/timeline_bar.hpp"

namespace pf::test {
namespace {

FlightHistory history_of(int num_frames) {
  FlightHistory history;
  history.begin(0.0);
  for (int k = 1; k <= num_frames; ++k) history.pass_frame({0.5 * k, 3, 0});
  return history;
}

TEST(FlightHistory, FindsFramesByTime) {
  const FlightHistory history = history_of(4);
  EXPECT_EQ(history.frame_at(-1.0), 0);
  EXPECT_EQ(history.frame_at(0.49), 0);
  EXPECT_EQ(history.frame_at(0.5), 1);
  EXPECT_EQ(history.frame_at(99.0), 4);
  for (int frame = 0; frame <= 4; ++frame) EXPECT_EQ(history.frame_at(history.time_at(frame)), frame);
}

TEST(FlightHistory, KeepsTheFutureUntilAChange) {
  FlightHistory history = history_of(4);
  history.end();
  history.go_to(2, 0);
  EXPECT_TRUE(history.is_past());
  ASSERT_NE(history.next_frame(), nullptr);
  EXPECT_EQ(history.next_frame()->time_s, 1.5);
  history.pass_frame({77.0, 1, 0});  // known already
  EXPECT_EQ(history.time_at(3), 1.5);
  EXPECT_TRUE(history.has_ended());
  Settings to;
  to.restitution = 0.25;
  history.change({}, to);
  EXPECT_EQ(history.latest(), 3);
  EXPECT_FALSE(history.is_past());
  EXPECT_FALSE(history.has_ended());
  ASSERT_EQ(history.changes().size(), 1U);
  EXPECT_EQ(history.changes()[0].what, "air.restitution = 0.25");
  history.go_to(1, 0);
  EXPECT_EQ(history.next_change(), nullptr) << "it comes two frames later";
  history.go_to(3, 0);
  EXPECT_EQ(history.next_change(), &history.changes()[0]);
}

TEST(TimelineBar, ItsScaleGrowsByQuartersAndEndsWithTheFlight) {
  EXPECT_EQ(timeline_span_s(0.0, false), 0.01);
  double before_s = 0.0;
  for (double flown_s = 0.01; flown_s < 10.0; flown_s *= 1.03) {
    const double span_s = timeline_span_s(flown_s, false);
    EXPECT_GE(span_s, flown_s * (1.0 - 1e-6));
    EXPECT_LT(span_s, 1.26 * flown_s);
    EXPECT_GE(span_s, before_s);
    before_s = span_s;
  }
  EXPECT_EQ(timeline_span_s(0.831, true), 0.831);
}

ClipFrame frame_after(double seconds) {
  const auto since = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  return {Clock::time_point{} + since, nullptr};
}

// Whatever the pace of the frames, the clip takes as long as they did.
TEST(LastSeconds, KeepTheClocksPace) {
  std::deque<ClipFrame> frames;
  for (double t : {0.0, 0.05, 0.30, 0.31, 1.0}) frames.push_back(frame_after(t));
  EXPECT_EQ(times_shown(frames, 20.0), (std::vector<int>{1, 5, 0, 14, 1}));
  EXPECT_TRUE(times_shown({}, 20.0).empty());
}

TEST(LastSeconds, AreReducedToASizeForASlide) {
  EXPECT_EQ(clip_size({1920, 1080}), (SizePx{640, 360}));
  EXPECT_EQ(clip_size({962, 618}), (SizePx{640, 410}));
  EXPECT_EQ(clip_size({500, 1000}), (SizePx{240, 480}));
  EXPECT_EQ(clip_size({301, 201}), (SizePx{300, 200}));
}

}  // namespace
}  // namespace pf::test
