// The order in which Esc leaves things, and the time for which its question stands.
#include <gtest/gtest.h>

#include "view/escape.hpp"
#include "view/passing_notice.hpp"

namespace pf {
namespace {

TEST(Escape, LeavesTheNearestThingFirst) {
  EXPECT_EQ(effect_of_escape({true, true, true, true}), EscapeEffect::close_popup);
  EXPECT_EQ(effect_of_escape({false, true, true, true}), EscapeEffect::stop_aiming);
  EXPECT_EQ(effect_of_escape({false, false, true, true}), EscapeEffect::leave_full_screen);
  EXPECT_EQ(effect_of_escape({false, false, false, false}), EscapeEffect::ask);
  EXPECT_EQ(effect_of_escape({false, false, false, true}), EscapeEffect::quit);
}

TEST(PassingNotice, GoesAfterTwoSeconds) {
  using std::chrono::milliseconds;
  const Clock::time_point start = Clock::now();
  PassingNotice notice;
  EXPECT_EQ(notice.text(start), "");
  notice.show("here", start);
  EXPECT_EQ(notice.text(start + milliseconds(1990)), "here");
  EXPECT_EQ(notice.text(start + milliseconds(2010)), "");
}

}  // namespace
}  // namespace pf
