// The cameras of the stage: the one that follows the ball, and that of the magnifier.
#include <algorithm>

#include "view/stage_loop.hpp"

namespace pf {
namespace {

constexpr double kAtOnce_s = 1e3;
constexpr double kMaxFrame_s = 0.1;  // a longer wait is not made up for

}  // namespace

// The scene may ask for both; the command line and then the person have the last word.
void Stage::follow_wishes() {
  const FrameView& view = simulation_.view();
  const ViewWishes wishes = {view.num_scenes, view.settings->follow_ball, view.settings->magnifier};
  if (wishes == wishes_) return;
  const bool is_first = wishes_.num_scenes == 0;
  const bool is_new = wishes.num_scenes != wishes_.num_scenes;
  if (is_new || wishes.follow_ball != wishes_.follow_ball) switches_.follow_ball = wishes.follow_ball;
  if (is_new || wishes.magnifier != wishes_.magnifier) switches_.magnifier = wishes.magnifier;
  if (is_first && options_.follow) switches_.follow_ball = true;
  if (!options_.magnifier.empty() && is_new)
    switches_.magnifier = index_of<MagnifierMode>(options_.magnifier, kMagnifierNames);
  wishes_ = wishes;
}

// After the steps of the frame have begun: then it is known whether the ball moves in it.
void Stage::follow_ball() {
  follow_wishes();
  const FrameView& view = simulation_.view();
  const BallConstants& ball = view.physics->ball;
  const ViewRegion region = free_region();
  const bool wanted = switches_.follow_ball && ball.exists;
  if (wanted && !ball_camera_.is_on()) ball_camera_.start(camera_, ball.radius_m, region);
  if (!wanted && ball_camera_.is_on()) ball_camera_.stop(camera_, true);
  ball_m_ = aim_.active() ? initial_ball(*view.settings).position_m : ball_in_picture(view);
  const double passed_s =
      context_.window() != nullptr ? std::min(frame_s_, kMaxFrame_s) : 1.0 / view.settings->frame_rate_hz;
  if (ball_camera_.is_on()) {
    constexpr std::int64_t kAimed = -1;  // no flight: the camera glides to the start and back
    ball_camera_.move({ball_m_, aim_.active() ? kAimed : view.num_flights,
                       num_frames_ == first_frame_ ? kAtOnce_s : passed_s},
                      view.physics->world, region, camera_);
  }
  const bool with_marks = static_cast<OverlayMode>(switches_.overlay_mode) != OverlayMode::off;
  switches_.has_magnifier =
      !split_.is_on() && Magnifier::is_wanted(switches_.magnifier, view, camera_, scale_, with_marks);
  magnifier_px_ = switches_.has_magnifier ? Magnifier::side_px(static_cast<float>(region.width_px),
                                                               static_cast<float>(region.height_px), scale_)
                                          : 0.0F;
}

void Stage::follow_camera_keys(const InputFrame& input) {
  const bool has_ball = simulation_.view().physics->ball.exists;
  if (!has_ball && (input.toggle_follow || input.toggle_magnifier))
    notice_.show("This scene has no ball", Clock::now());
  if (input.toggle_follow && has_ball) switches_.follow_ball = !switches_.follow_ball;
  if (input.toggle_magnifier && split_.is_on()) {
    notice_.show("The magnifier is for one flight; X ends the second one", Clock::now());
  } else if (input.toggle_magnifier && has_ball) {
    switches_.magnifier = switches_.has_magnifier ? MagnifierMode::off : MagnifierMode::on;
  }
}

// A view that the person has chosen has the same middle and width in a window of another size.
void Stage::keep_view() {
  const OverlayPlace place = place_of_overlay();
  const ViewRegion now = {place.left_px, 0.0, place.width_px, place.bottom_px};
  const bool is_resized = kept_size_.width > 0 && !(kept_size_ == size_);
  if (is_resized && !camera_.fitted && !ball_camera_.is_on()) {
    camera_.center_m = camera_.to_world(beside_panel_.center_px());
    camera_.anchor_px = now.center_px();
    camera_.metres_per_px *= beside_panel_.width_px / now.width_px;
  }
  beside_panel_ = now;
  kept_size_ = size_;
}

// A pan ends following, and the picture stays where it is; fitting the view ends it, too.
void Stage::pan(Vec2d moved_px) {
  ball_camera_.stop(camera_, false);
  switches_.follow_ball = false;
  camera_.pan(moved_px);
}

// The wheel works on the picture that the pointer is over.
void Stage::zoom(const InputFrame& input) {
  const World& world = simulation_.view().physics->world;
  const Vec2d half_m = to_metres(world, world.half);
  const double width_m = 2.0 * std::max(half_m.x, half_m.y);
  const std::optional<PxRect>& inset = marks_.magnifier();
  const auto x = static_cast<float>(input.pointer_px.x);
  const auto y = static_cast<float>(size_.height - input.pointer_px.y);
  if (magnifier_ && inset && is_within({x, y, x, y}, *inset)) {
    magnifier_->zoom(input.zoom);
  } else if (ball_camera_.is_on()) {
    ball_camera_.zoom(input.zoom, width_m);
  } else {
    camera_.zoom_at(input.pointer_px, input.zoom, width_m);
  }
}

// Its place in the picture, for tests.
void Stage::note_followed_ball() {
  if (!ball_camera_.is_on()) return;
  const Vec2d px = camera_.to_px(ball_m_);
  const double radius_px = simulation_.view().physics->ball.radius_m / camera_.metres_per_px;
  const PxRect ball = square_around(static_cast<float>(px.x), static_cast<float>(size_.height - px.y),
                                    static_cast<float>(radius_px));
  panel_.controls().note("Followed ball", {ball.x0, ball.y0, ball.x1, ball.y1});
}

// The window's picture without the panel, as a film has it; without a window, what is drawn there.
PictureScene Stage::large_picture_scene() {
  parcels_ = target_->buffers(simulation_.backend().images());
  const bool has_window = context_.window() != nullptr;
  PictureScene scene;
  scene.frame = &simulation_.view();
  if (num_frames_ > first_frame_ || !parcels_.is_empty()) scene.parcels = &parcels_;
  scene.window = &camera_;
  scene.seen = free_region();
  scene.scale = has_window ? film_scale(size_) : scale_;
  scene.window_size = size_;
  if (options_.record_overlay) scene.overlay = &overlay_;
  scene.mode = has_window ? OverlayMode::full : static_cast<OverlayMode>(switches_.overlay_mode);
  scene.look = switches_.look;
  scene.magnifier = switches_.magnifier;
  scene.title = &title_;
  scene.window_gui = &gui_;
  return scene;
}

void Stage::draw_magnified_air(const ParcelBuffers& parcels) {
  if (magnifier_px_ <= 0.0F) return;
  if (!magnifier_) magnifier_ = std::make_unique<Magnifier>();
  magnifier_->set_look(switches_.look);
  magnifier_->draw_air(simulation_.view(), parcels, ball_m_, camera_, magnifier_px_, scale_);
}

void Stage::draw_magnified_rest(const FrameView& frame, const Viewport& viewport) {
  if (magnifier_px_ <= 0.0F || !marks_.magnifier()) return;
  magnifier_->draw_flight(frame);
  magnifier_->copy(*marks_.magnifier(), viewport);
}

}  // namespace pf
