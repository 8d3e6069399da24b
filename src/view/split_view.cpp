#include "view/split_view.hpp"

#include <algorithm>
#include <utility>

#include "app/options.hpp"

namespace pf {

void SplitView::follow(const InputFrame& input, SplitSwitches& switches, Commands& commands) {
  if (input.next_split)
    switches.mode =
        static_cast<SplitMode>((static_cast<std::size_t>(switches.mode) + 1) % kSplitViewNames.size());
  scene_.mode = switches.mode;
  scene_.is_grabbed = scene_.is_grabbed && switches.mode == SplitMode::halves;
  const bool was_on = asked_.mode != SplitMode::off;
  const bool wants_on = switches.mode != SplitMode::off;
  if (was_on != wants_on) {
    commands.split = wants_on ? switches.difference : Difference{};
  } else if (wants_on && switches.difference != asked_.difference) {
    commands.split = switches.difference;
  }
  is_waiting_ = is_waiting_ || commands.split.has_value();
  asked_ = switches;
}

void SplitView::adopt(SplitSwitches& switches) {
  if (is_waiting_ && !pair_.is_whole()) return;
  is_waiting_ = false;
  if (!is_on()) switches.mode = SplitMode::off;
  if (is_on() && switches.mode == SplitMode::off) switches.mode = begun_mode_;
  if (pair_.num_begun() != num_begun_ && is_on()) switches.difference = pair_.difference();
  num_begun_ = pair_.num_begun();
  scene_.mode = switches.mode;
  asked_ = switches;
  if (!is_on()) target_.reset();
}

void SplitView::take_mouse(InputFrame& input, const Camera& camera, Gui& gui, float scale) {
  if (!is_on() || scene_.mode != SplitMode::halves) return;
  take_divider(input, gui, scale);
  const bool is_over = contains(picture_.layout().second_half, input.pointer_px);
  if (!input.drags_left && input.drag_px.x == 0.0 && input.drag_px.y == 0.0) in_second_ = is_over;
  if (input.pressed_left) in_second_ = is_over;
  if (!in_second_) return;
  const Camera second = picture_.second_camera(camera, pair_.view().physics->world, scale);
  const Vec2d world_m = second.to_world(input.pointer_px);
  input.pointer_px = camera.to_px(world_m);
  input.drag_px = input.drag_px * (second.metres_per_px / camera.metres_per_px);
}

void SplitView::take_divider(InputFrame& input, Gui& gui, float scale) {
  constexpr double kReach_px = 5.0;
  const bool is_over =
      !gui.wants_mouse() && contains(picture_.layout().divider, input.pointer_px, kReach_px * scale);
  if (input.pressed_left && is_over) scene_.is_grabbed = true;
  if (is_over || scene_.is_grabbed) gui.show_hand();
  if (!scene_.is_grabbed) return;
  scene_.share = share_at(input.pointer_px, picture_.layout());
  scene_.is_grabbed = input.drags_left && !input.released;
  input.pressed_left = input.drags_left = input.released = false;
  input.drag_px = {};
}

DrawTarget* SplitView::target() {
  if (!is_on()) return nullptr;
  Backend& backend = pair_.second()->backend();
  if (!target_ || backend.name() != target_backend_) target_ = make_(backend);
  target_backend_ = backend.name();
  return target_.get();
}

ViewRegion SplitView::lay_out(const ViewRegion& free, const Look& look, float scale) {
  scene_.pair = &pair_;
  scene_.look = look;
  return picture_.lay_out(scene_, free, scale);
}

void SplitView::draw_air(const Look& look, const Camera& camera, const Viewport& viewport) {
  if (!is_on()) return;
  scene_.pair = &pair_;
  scene_.look = look;
  scene_.parcels = target_ ? target_->buffers(pair_.second()->backend().images()) : ParcelBuffers{};
  picture_.draw_air(scene_, camera, viewport);
}

void SplitView::air_is_drawn() {
  if (is_on() && target_) target_->frame_drawn();
}

void SplitView::draw_flight(const Camera& camera, const Viewport& viewport) {
  if (is_on()) picture_.draw_flight(scene_, camera, viewport);
}

void SplitView::describe(const Camera& camera, float height_px, float scale) {
  if (is_on()) picture_.describe(scene_, camera, height_px, scale);
}

float SplitView::covered_at_top_px(const OverlayPlace& place, float height_px) const {
  return is_on() ? picture_.covered_at_top_px(scene_, place, height_px) : 0.0F;
}

void SplitView::note(ControlMap& controls, float height_px) const {
  if (!is_on()) return;
  const SplitLayout& layout = picture_.layout();
  const auto note_region = [&](const char* name, const ViewRegion& region) {
    const auto left = static_cast<float>(region.left_px);
    const auto top = height_px - static_cast<float>(region.bottom_px + region.height_px);
    controls.note(name, {left, top, left + static_cast<float>(region.width_px),
                         top + static_cast<float>(region.height_px)});
  };
  note_region("Split card", layout.card);
  if (scene_.mode != SplitMode::halves) return;
  note_region("First half", layout.first);
  note_region("Second half", layout.second_half);
  note_region("Divider", layout.divider);
}

}  // namespace pf
