#include "view/split_picture.hpp"

#include "view/aim.hpp"
#include "view/film_scene.hpp"
#include "view/overlay_paint.hpp"

namespace pf {
namespace {

SizePx size_of(const ViewRegion& region) {
  return {static_cast<int>(region.width_px), static_cast<int>(region.height_px)};
}

const FrameView& second_view(const SplitScene& scene) { return scene.pair->second()->view(); }

Look second_look(const SplitScene& scene) {
  Look look = scene.look;
  look.flight = split_colors(look.theme, *scene.pair).second;
  return look;
}

// A chip with a flight's name.
constexpr float kNameGap_px = 8.0F;  // from the corner of a half

float name_height_px(float scale) { return ImGui::GetFontSize() + 6.0F * scale; }

float name_width_px(const std::string& text, float scale) { return text_width(text) + 28.0F * scale; }

void paint_name(ImVec2 at, const std::string& text, const Rgb& color, Theme theme, float scale) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const ImVec2 high(at.x + name_width_px(text, scale), at.y + name_height_px(scale));
  list->AddRectFilled(at, high, overlay_colors(theme).ground, 4.0F * scale);
  const float y = 0.5F * (at.y + high.y);
  list->AddLine(ImVec2(at.x + 6.0F * scale, y), ImVec2(at.x + 18.0F * scale, y), packed(color), 3.0F * scale);
  list->AddText(ImVec2(at.x + 23.0F * scale, at.y + 3.0F * scale), overlay_colors(theme).text, text.c_str());
}

}  // namespace

float SplitPicture::covered_at_top_px(const SplitScene& scene, const OverlayPlace& place,
                                      float height_px) const {
  const ViewRegion& card = layout_.card;
  const double middle_px = place.left_px + 0.5 * place.width_px;
  const bool is_there = card.bottom_px + card.height_px > height_px - 1.0 && card.left_px < middle_px &&
                        card.left_px + card.width_px > middle_px;
  const bool has_names = scene.mode == SplitMode::halves;
  const float names_px = has_names ? kNameGap_px * place.scale + name_height_px(place.scale) : 0.0F;
  return names_px + (is_there ? static_cast<float>(card.height_px) : 0.0F);
}

ViewRegion SplitPicture::lay_out(const SplitScene& scene, const ViewRegion& free, float scale) {
  const World& world = scene.pair->view().physics->world;
  const LegendSize card = card_.fit(free.width_px, scale);
  layout_ = scene.mode == SplitMode::halves ? lay_out_halves(free, card, world, scene.share, scale)
                                            : lay_out_one(free, card, world, scale);
  return layout_.first;
}

Camera SplitPicture::second_camera(const Camera& first, const World& world, float scale) const {
  return camera_like(first, layout_.first, layout_.second, world, scale);
}

// In pixels of the half.
Camera SplitPicture::half_camera(const SplitScene& scene, const Camera& camera, float scale) const {
  Camera half = second_camera(camera, second_view(scene).physics->world, scale);
  half.anchor_px -= Vec2d{layout_.second_half.left_px, layout_.second_half.bottom_px};
  return half;
}

Viewport SplitPicture::half_viewport(float scale) const {
  return {half_.framebuffer(), half_.texture(), size_of(layout_.second_half), scale};
}

void SplitPicture::draw_air(const SplitScene& scene, const Camera& camera, const Viewport& viewport) {
  if (scene.mode != SplitMode::halves || size_of(layout_.second_half).width <= 0) return;
  if (!renderer_) renderer_.emplace();
  const SizePx size = size_of(layout_.second_half);
  half_.resize(size.width, size.height);
  renderer_->set_look(second_look(scene));
  renderer_->draw_air(second_view(scene), &scene.parcels, half_camera(scene, camera, viewport.scale),
                      half_viewport(viewport.scale));
}

void SplitPicture::draw_flight(const SplitScene& scene, const Camera& camera, const Viewport& viewport) {
  if (!renderer_) renderer_.emplace();
  renderer_->set_look(second_look(scene));
  if (scene.mode != SplitMode::halves) {
    renderer_->draw_flight(second_view(scene), camera, viewport);
    return;
  }
  if (half_.texture() == 0) return;
  renderer_->draw_flight(second_view(scene), half_camera(scene, camera, viewport.scale),
                         half_viewport(viewport.scale));
  const auto [width, height] = size_of(layout_.second_half);
  const auto left = static_cast<int>(layout_.second_half.left_px);
  const auto bottom = static_cast<int>(layout_.second_half.bottom_px);
  glBlitNamedFramebuffer(half_.framebuffer(), viewport.framebuffer, 0, 0, width, height, left, bottom,
                         left + width, bottom + height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void SplitPicture::describe(const SplitScene& scene, const Camera& camera, float height_px, float scale) {
  if (scene.mode == SplitMode::halves) paint_divider(scene, height_px, scale);
  paint_names(scene, camera, height_px, scale);
  card_.write(*scene.pair, scale);
  const auto left = static_cast<float>(layout_.card.left_px);
  const auto top = height_px - static_cast<float>(layout_.card.bottom_px + layout_.card.height_px);
  card_.paint(ImVec2(left, top), split_colors(scene.look.theme, *scene.pair), scene.look.theme, scale);
}

void SplitPicture::paint_divider(const SplitScene& scene, float height_px, float scale) const {
  const ViewRegion& line = layout_.divider;
  const OverlayColors& colors = overlay_colors(scene.look.theme);
  const ImVec2 low(static_cast<float>(line.left_px),
                   height_px - static_cast<float>(line.bottom_px + line.height_px));
  const ImVec2 high(static_cast<float>(line.left_px + line.width_px),
                    height_px - static_cast<float>(line.bottom_px));
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled(low, high, scene.is_grabbed ? colors.accent : colors.edge);
  // A grip in the middle.
  const ImVec2 middle(0.5F * (low.x + high.x), 0.5F * (low.y + high.y));
  const float along = 18.0F * scale;
  const float across = 4.0F * scale;
  const ImVec2 reach = layout_.stacked ? ImVec2(along, across) : ImVec2(across, along);
  list->AddRectFilled(ImVec2(middle.x - reach.x, middle.y - reach.y),
                      ImVec2(middle.x + reach.x, middle.y + reach.y),
                      scene.is_grabbed ? colors.accent : colors.dim, across);
}

// In the upper left corner of each half, or beside the balls.
void SplitPicture::paint_names(const SplitScene& scene, const Camera& camera, float height_px,
                               float scale) const {
  const SplitNames names = split_names(*scene.pair->view().settings, scene.pair->difference());
  const Theme theme = scene.look.theme;
  const SplitColors colors = split_colors(theme, *scene.pair);
  const float gap = kNameGap_px * scale;
  if (scene.mode == SplitMode::halves) {
    const auto corner = [&](const ViewRegion& region) {
      return ImVec2(static_cast<float>(region.left_px) + gap,
                    height_px - static_cast<float>(region.bottom_px + region.height_px) + gap);
    };
    const auto name = [&](const ViewRegion& region, const std::string& text, const Rgb& color) {
      const float room = static_cast<float>(region.width_px) - 2.0F * gap - name_width_px("", scale);
      paint_name(corner(region), fitting(text, room), color, theme, scale);
    };
    name(layout_.first, "1  " + names.first, colors.first);
    name(layout_.second_half, "2  " + names.second, colors.second);
    return;
  }
  const FrameView first = scene.pair->view();
  if (!first.physics->ball.exists) return;
  const auto radius =
      static_cast<float>(ring_radius_px(first.physics->ball.radius_m / camera.metres_per_px, scale));
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const ImVec2 one = on_screen(first.ball.position_m, camera, height_px);
  const ImVec2 two = on_screen(second_view(scene).ball.position_m, camera, height_px);
  const bool first_is_above = one.y <= two.y;
  const float line = ImGui::GetFontSize() + 10.0F * scale;
  const auto mark = [&](ImVec2 at, bool above, const std::string& text, const Rgb& color) {
    list->AddCircle(at, radius, packed(color), 0, 2.0F * scale);
    const float y = above ? at.y - radius - line : at.y + radius + 0.3F * line;
    const float right = static_cast<float>(layout_.first.left_px + layout_.first.width_px);
    const float left = std::max(std::min(at.x + 0.5F * radius, right - name_width_px(text, scale)),
                                static_cast<float>(layout_.first.left_px));
    paint_name(ImVec2(left, y), text, color, theme, scale);
  };
  mark(one, first_is_above, "1  " + names.first, colors.first);
  mark(two, !first_is_above, "2  " + names.second, colors.second);
}

}  // namespace pf
