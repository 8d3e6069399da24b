// A frame of the stage: drawing it, taking it for the film, showing it.
#include <algorithm>

#include "view/profile_strip.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// Without an overlay there is no legend either, only the scene.
Look Stage::look_of_marks() const {
  Look look = switches_.look;
  look.paths =
      look.paths && !split_.is_on() && static_cast<OverlayMode>(switches_.overlay_mode) != OverlayMode::off;
  return look;
}

// Right of the panel, down to the window's lower edge.
OverlayPlace Stage::place_of_overlay() const {
  const float left = switches_.show_panel ? panel_.width_px(scale_) : 0.0F;
  return {left, std::max(static_cast<float>(size_.width) - left, 1.0F), static_cast<float>(size_.height),
          scale_};
}

OverlayMode Stage::shown_overlay() const {
  return Overlay::fitting_mode(static_cast<OverlayMode>(switches_.overlay_mode), place_of_overlay());
}

// Notices, legend, profile and magnifier: not in the film of a run without a window that is to have no
// overlay.
bool Stage::has_marks() const { return context_.window() != nullptr || options_.record_overlay; }

ViewRegion Stage::free_region() {
  const double left = place_of_overlay().left_px;
  const double bottom = overlay_.used_height_px(shown_overlay(), scale_) + timeline_height_px();
  const ViewRegion free = {left, bottom, std::max(size_.width - left, 1.0),
                           std::max(size_.height - bottom, 1.0)};
  const bool has_strip = has_marks();
  if (split_.is_on())
    return split_.lay_out(has_strip ? above_profile_strip(free, simulation_.view(), scale_) : free,
                          switches_.look, scale_);
  if (!has_strip) return free;
  return marks_.region_for_world(simulation_.view(), look_of_marks(), free, scale_);
}

void Stage::fit_camera() {
  const ViewRegion region = free_region();  // it places two flights, also where nothing is fitted
  if (camera_.fitted) fit_world(camera_, simulation_.view().physics->world, region, scale_);
}

void Stage::describe_overlay() {
  ScopedPhase timing(times_, Phase::panel);
  OverlayPlace place = place_of_overlay();
  const FrameView view = pair_.view();
  split_.describe(camera_, static_cast<float>(size_.height), scale_);
  overlay_.show(view, static_cast<OverlayMode>(switches_.overlay_mode), place, switches_.look);
  place.bottom_px -= overlay_.used_height_px(shown_overlay(), scale_) + timeline_height_px();
  const auto height_px = static_cast<float>(size_.height);
  // A film with a picture of its own does not show the window's notices.
  WindowNotices notices;
  if (context_.window() != nullptr)
    notices = {recorder_.film_line(), recorder_.news(), notice_.text(Clock::now())};
  notices.below_px = split_.covered_at_top_px(place, height_px);
  const double magnifier_scale = magnifier_ ? magnifier_->camera().metres_per_px : 0.0;
  const ScenePlace scene = {camera_,       place,           height_px,   look_of_marks(),
                            magnifier_px_, magnifier_scale, title_place_};
  if (has_marks()) marks_.show(view, scene, notices);
  if (ring_m_) {
    SceneMarks::show_ring(*ring_m_, ring_px(), launched_by_hand_ ? "" : "pull back and let go",
                          {camera_, place, height_px, switches_.look});
  }
  if (aim_.active()) {
    SceneMarks::show_aim(aim_.launch(), initial_ball(*view.settings).position_m, view.physics->ball.radius_m,
                         {camera_, place, height_px, switches_.look});
  }
  title_place_ = title_.show(has_marks() ? above_profile_strip(place, view) : place, switches_.look.theme,
                             SceneMarks::start_rect(view, camera_, height_px, scale_));
  gui_.end_frame();
}

void Stage::draw_air(const Viewport& viewport) {
  const Clock::time_point start = Clock::now();
  const ParcelBuffers parcels = target_->buffers(simulation_.backend().images());
  renderer_.set_look(switches_.look);
  air_timer_.begin();
  renderer_.draw_air(simulation_.view(), &parcels, camera_, viewport);
  draw_magnified_air(parcels);
  split_.draw_air(switches_.look, camera_, viewport);
  air_timer_.end();
  const double film_before_ms = times_[Phase::encode];
  if (FilmScene* film = recorder_.scene()) {
    ScopedPhase timing(times_, Phase::encode);
    film->set_look(switches_.look);
    film->set_magnifier(switches_.magnifier);
    film->set_split(split_.scene());
    film->draw_air(simulation_.view(), parcels, camera_, free_region(),
                   recorder_.has_overlay() ? &overlay_ : nullptr);
  }
  target_->frame_drawn();
  split_.air_is_drawn();
  settle();
  draw_air_ms_ = milliseconds_since(start) - (times_[Phase::encode] - film_before_ms);
}

void Stage::draw_flight(const Viewport& viewport) {
  const Clock::time_point start = Clock::now();
  flight_timer_.begin();
  if (aim_.active()) {
    FrameView aimed = simulation_.view();
    aimed.ball = initial_ball(*aimed.settings);
    aimed.ghosts = &aimed_ghosts_;
    renderer_.set_look({switches_.look.theme, switches_.look.color_map, true, true});
    renderer_.draw_flight(aimed, camera_, viewport);
    draw_magnified_rest(aimed, viewport);
  } else {
    renderer_.draw_flight(simulation_.view(), camera_, viewport);
    draw_magnified_rest(simulation_.view(), viewport);
  }
  split_.draw_flight(camera_, viewport);
  flight_timer_.end();
  settle();
  drawing_.host_draw_ms = draw_air_ms_ + milliseconds_since(start);
  drawing_.gpu_draw_ms = air_timer_.newest_ms() + flight_timer_.newest_ms();
  // A GPU works on after the calls return.
  times_[Phase::draw] = context_.info().software ? drawing_.host_draw_ms
                                                 : std::fmax(drawing_.gpu_draw_ms, drawing_.host_draw_ms);
}

void Stage::draw_gui(const Viewport& viewport) {
  if (!options_.record_panel) keep_last_seconds(viewport);
  {
    ScopedPhase timing(times_, Phase::panel);
    panel_timer_.begin();
    gui_.draw(viewport.framebuffer, viewport.size);
    panel_timer_.end();
    settle();
  }
  drawing_.host_panel_ms = times_[Phase::panel];
  drawing_.gpu_panel_ms = panel_timer_.newest_ms();
}

void Stage::take_frame(const Viewport& viewport) {
  if (options_.record_panel) keep_last_seconds(viewport);
  ScopedPhase timing(times_, Phase::encode);
  if (FilmScene* film = recorder_.scene()) {
    film->set_split(split_.scene());  // it may have ended in this frame
    film->draw_rest(simulation_.view(), recorder_.has_overlay() ? &overlay_ : nullptr, title_, gui_);
    settle();
  }
  recorder_.take({viewport.framebuffer, viewport.size}, simulation_, large_picture_scene(), pair_.is_whole());
}

void Stage::present(const Viewport& viewport) {
  ScopedPhase timing(times_, Phase::present);
  if (context_.window() != nullptr && viewport.framebuffer != 0) {
    // Mesa notices a new window size when a viewport is set, not on a copy.
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, viewport.size.width, viewport.size.height);
    const auto [width, height] = viewport.size;
    glBlitNamedFramebuffer(viewport.framebuffer, 0, 0, 0, width, height, 0, 0, width, height,
                           GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  context_.present();
}

// A rasteriser on the CPU starts when something waits for it. Waiting here books its time to the right phase.
void Stage::settle() const {
  if (context_.info().software) glFinish();
}

}  // namespace pf
