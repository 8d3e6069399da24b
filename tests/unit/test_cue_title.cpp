// The place of a cue's title.
#include "view/cue_title.hpp"

#include <gtest/gtest.h>

namespace pf {
namespace {

TEST(CueTitle, KeepsClearOfTheBallsStart) {
  const OverlayPlace place{100.0F, 800.0F, 500.0F, 1.0F};
  const PxRect start{200.0F, 440.0F, 230.0F, 470.0F};
  EXPECT_EQ(title_corner({300.0F, 60.0F}, place, {}), TitleCorner::lower_left);
  EXPECT_EQ(title_corner({300.0F, 60.0F}, place, start), TitleCorner::lower_right);
  EXPECT_EQ(title_corner({700.0F, 60.0F}, place, start), TitleCorner::upper_left) << "too wide for the right";
  EXPECT_EQ(title_corner({300.0F, 60.0F}, place, {0.0F, 0.0F, 1000.0F, 600.0F}), TitleCorner::lower_left)
      << "there is no place";
}

}  // namespace
}  // namespace pf
