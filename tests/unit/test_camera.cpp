// The camera that follows the ball, images of a periodic world, and the magnifier's scale.
#include <gtest/gtest.h>

#include <cmath>

#include "unit/frames.hpp"
#include "view/ball_camera.hpp"
#include "view/magnifier.hpp"
#include "view/world_images.hpp"

namespace pf {
namespace {

const ViewRegion kRegion = {318.0, 150.0, 962.0, 570.0};
constexpr double kRadius_m = 0.037;

struct Followed {
  World world = make_world(13.4, 6.1, Boundary::open);
  Camera camera;
  BallCamera follower;

  Followed() {
    fit_world(camera, world, kRegion, 1.0F);
    follower.start(camera, kRadius_m, kRegion);
  }
  // The ball in the picture, in pixels from its middle.
  Vec2d place_px(Vec2d ball_m) const { return (ball_m - camera.center_m) * (1.0 / camera.metres_per_px); }
  void move(Vec2d ball_m, double passed_s, std::int64_t flight = 1) {
    follower.move({ball_m, flight, passed_s}, world, kRegion, camera);
  }
};

// The way of the camera over half a second of wall time.
Followed followed_at(int frames_per_s) {
  Followed followed;
  followed.move({-6.7, 0.3}, 0.0);
  for (int i = 1; i <= frames_per_s / 2; ++i) {
    const double time_s = static_cast<double>(i) / frames_per_s;
    followed.move({-6.7 + 5.0 * time_s, 0.3}, 1.0 / frames_per_s);
  }
  return followed;
}

TEST(BallCamera, GoesTheSameWayAtEveryFrameRate) {
  const Followed slow = followed_at(24), fast = followed_at(240);
  EXPECT_NEAR(slow.camera.center_m.x, fast.camera.center_m.x, 1e-9);
  EXPECT_NEAR(slow.camera.center_m.y, fast.camera.center_m.y, 1e-9);
  EXPECT_NEAR(slow.camera.metres_per_px, fast.camera.metres_per_px, 1e-12);
}

TEST(BallCamera, ABallOfAnySpeedStandsStillInTheMiddle) {
  Followed followed;
  Vec2d ball_m = {-6.0, -1.0};
  for (int i = 0; i < 300; ++i) followed.move(ball_m += Vec2d{0.2, 0.01}, 1.0 / 60.0);
  EXPECT_NEAR(followed.place_px(ball_m).x, 0.0, 1e-3);
  EXPECT_NEAR(followed.place_px(ball_m).y, 0.0, 1e-3);
  EXPECT_EQ(followed.camera.anchor_px, kRegion.center_px());
  const double ball_px = 2.0 * kRadius_m / followed.camera.metres_per_px;
  EXPECT_NEAR(ball_px, 0.12 * 570.0, 0.1) << "well visible";
}

TEST(BallCamera, GlidesToANewLaunch) {
  Followed followed;
  for (int i = 0; i < 300; ++i) followed.move({6.0, 1.0}, 1.0 / 60.0);
  const Vec2d before_m = followed.camera.center_m;
  followed.move({-6.7, 0.0}, 1.0 / 60.0, 2);
  const Vec2d step_m = followed.camera.center_m - before_m;
  EXPECT_LT(length(step_m), 0.1 * 12.7) << "no cut";
  EXPECT_GT(length(step_m), 0.05 * 12.7);
  for (int i = 0; i < 120; ++i) followed.move({-6.7, 0.0}, 1.0 / 60.0, 2);
  EXPECT_NEAR(followed.camera.center_m.x, -6.7, 1e-3);
}

TEST(BallCamera, CrossesTheEdgeOfAPeriodicWorldWithoutAJump) {
  Followed followed;
  followed.world = make_world(10.0, 10.0, Boundary::periodic);
  double x_m = 3.0;
  for (int i = 0; i < 120; ++i) {
    x_m += 0.02;
    const Vec2d ball_m = {std::remainder(x_m, 10.0), 0.0};
    followed.move(ball_m, 1.0 / 60.0);
    if (i < 90) continue;
    EXPECT_NEAR(followed.place_px(ball_m).x, 0.0, 2.0);
    EXPECT_TRUE(followed.camera.shows_images);
  }
}

TEST(BallCamera, TheWheelZoomsAndTheBallStaysInTheMiddle) {
  Followed followed;
  for (int i = 0; i < 200; ++i) followed.move({1.0, 1.0}, 1.0 / 60.0);
  const double before = followed.camera.metres_per_px;
  followed.follower.zoom(2.0, 13.4);
  for (int i = 0; i < 200; ++i) followed.move({1.0, 1.0}, 1.0 / 60.0);
  EXPECT_NEAR(followed.camera.metres_per_px, 0.5 * before, 1e-9);
  EXPECT_NEAR(followed.place_px({1.0, 1.0}).x, 0.0, 1e-3);
}

TEST(BallCamera, EndsInTheViewOfBeforeOrWhereItIs) {
  Followed toggled, panned;
  for (Followed* followed : {&toggled, &panned}) followed->move({1.0, 1.0}, 1.0);
  toggled.follower.stop(toggled.camera, true);
  EXPECT_TRUE(toggled.camera.fitted);
  const Vec2d center_m = panned.camera.center_m;
  panned.follower.stop(panned.camera, false);
  EXPECT_FALSE(panned.camera.fitted);
  EXPECT_EQ(panned.camera.center_m, center_m);
  EXPECT_FALSE(panned.follower.is_on());
}

TEST(BallCamera, KnowsWhereTheBallWillBeInThePicture) {
  Frames frames;
  frames.view.ball.position_m = {1.0, 2.0};
  frames.view.ball.velocity_mps = {10.0, -5.0};
  frames.view.steps_per_frame = 4;
  frames.view.dt_s = 1e-3;
  EXPECT_EQ(ball_in_picture(frames.view), (Vec2d{1.0, 2.0})) << "no step has begun";
  frames.view.unfinished = true;
  EXPECT_NEAR(ball_in_picture(frames.view).x, 1.04, 1e-12);
  EXPECT_NEAR(ball_in_picture(frames.view).y, 1.98, 1e-12);
}

TEST(WorldImages, ThoseInThePictureAndNoOthers) {
  const World world = make_world(10.0, 10.0, Boundary::periodic);
  Camera camera;
  camera.metres_per_px = 0.01;
  camera.center_m = {5.0, 0.0};  // at the right edge
  camera.anchor_px = {200.0, 150.0};
  const SizePx size = {400, 300};
  EXPECT_EQ(image_cameras(camera, world, {}, size, 0.1).size(), 1U) << "not asked for";
  camera.shows_images = true;
  const std::vector<Camera> cameras = image_cameras(camera, world, {}, size, 0.1);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_DOUBLE_EQ(cameras[0].center_m.x, 5.0);
  EXPECT_DOUBLE_EQ(cameras[1].center_m.x, -5.0);  // what enters at the left is seen there
  EXPECT_EQ(image_cameras(camera, make_world(10.0, 10.0, Boundary::walls), {}, size, 0.1).size(), 1U);
}

TEST(Magnifier, ComesByItselfWhereTheBallIsSmall) {
  Frames frames;
  Camera camera;
  camera.metres_per_px = 2.0 * frames.physics.ball.radius_m / 20.0;
  const auto is_wanted = [&](MagnifierMode mode, float scale, bool with_marks) {
    return Magnifier::is_wanted(mode, frames.view, camera, scale, with_marks);
  };
  EXPECT_FALSE(is_wanted(MagnifierMode::automatic, 1.0F, true));
  EXPECT_TRUE(is_wanted(MagnifierMode::automatic, 2.0F, true)) << "20 pixels are 10 on such a screen";
  EXPECT_TRUE(is_wanted(MagnifierMode::on, 1.0F, true));
  camera.metres_per_px *= 4.0;
  EXPECT_TRUE(is_wanted(MagnifierMode::automatic, 1.0F, true));
  EXPECT_FALSE(is_wanted(MagnifierMode::automatic, 1.0F, false)) << "only the scene is wanted";
  EXPECT_FALSE(is_wanted(MagnifierMode::off, 1.0F, true));
  frames.physics.ball.exists = false;
  EXPECT_FALSE(is_wanted(MagnifierMode::on, 1.0F, true));
}

// With a ball as wide as the picture it would show less than the picture does.
TEST(Magnifier, NeverMakesSmaller) {
  MagnifierZoom zoom;
  const double usual = zoom.metres_per_px(kRadius_m, 190.0, 1.0);
  EXPECT_NEAR(2.0 * kRadius_m / usual, 0.3 * 190.0, 1e-9) << "pixels of the ball";
  const double around = 0.5 * usual;  // of a court that was zoomed
  EXPECT_EQ(zoom.metres_per_px(kRadius_m, 190.0, around), around);
  for (int i = 0; i < 20; ++i) zoom.change(0.8);
  EXPECT_EQ(zoom.metres_per_px(kRadius_m, 190.0, around), around);
  zoom.change(1.25);
  zoom.change(1.25);
  EXPECT_LT(zoom.metres_per_px(kRadius_m, 190.0, around), 0.81 * around) << "the wheel answers at once";
}

TEST(Magnifier, ItsScaleBarIsARoundLength) {
  EXPECT_EQ(scale_bar(0.034).text, "2 cm");
  EXPECT_DOUBLE_EQ(scale_bar(0.034).length_m, 0.02);
  EXPECT_EQ(scale_bar(0.05).text, "5 cm");
  EXPECT_EQ(scale_bar(0.0012).text, "1 mm");
  EXPECT_EQ(scale_bar(3.0).text, "2 m");
  EXPECT_EQ(scale_bar(7e-5).text, "50 \xC2\xB5m");
}

}  // namespace
}  // namespace pf
