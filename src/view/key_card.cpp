#include "view/key_card.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include "app/key_table.hpp"
#include "view/smaller_text.hpp"

namespace pf {
namespace {

void show_rows(const char* head, std::span<const KeyRow> rows) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextDisabled("%s", head);
  for (const KeyRow& row : rows) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextColored(ImGui::GetStyleColorVec4(ImGuiCol_CheckMark), "%s", row.keys);
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(row.does);
  }
}

// The card with text of the usual size.
ImVec2 natural_size() {
  constexpr float kScrollbarRoom = 2.0F;
  constexpr auto kNumRows = std::size(kMouseRows) + std::size(kKeyRows) + 2;  // with two heads
  float keys = 0.0F, does = 0.0F;
  const auto measure = [&](std::span<const KeyRow> rows) {
    for (const KeyRow& row : rows) {
      keys = std::max(keys, ImGui::CalcTextSize(row.keys).x);
      does = std::max(does, ImGui::CalcTextSize(row.does).x);
    }
  };
  measure(kMouseRows);
  measure(kKeyRows);
  const ImGuiStyle& style = ImGui::GetStyle();
  const float row = ImGui::GetTextLineHeight() + 2.0F * style.CellPadding.y;
  return {keys + does + 4.0F * style.CellPadding.x + 2.0F * style.WindowPadding.x + kScrollbarRoom,
          row * static_cast<float>(kNumRows) + 2.0F * style.WindowPadding.y + kScrollbarRoom};
}

// Returns the largest text size near and up to `factor` at which a dash stays visible, or `factor`. The
// dash's rows in the font are enlarged or reduced as they are; where letters are made for each size, none is
// lost.
float legible(float factor) {
#if IMGUI_VERSION_NUM < 19200
  const ImFontGlyph* dash = ImGui::GetFont()->FindGlyph('-');
  const float scale = ImGui::GetFontSize() / ImGui::GetFont()->FontSize;
  const auto has_row = [&](float size) {
    return std::round(size * scale * dash->Y0) < std::round(size * scale * dash->Y1);
  };
  for (float size = factor; size > 0.85F * factor; size -= 0.01F)
    if (has_row(size)) return size;
#endif
  return factor;
}

}  // namespace

void show_key_card(const OverlayPlace& place, ControlMap& controls) {
  // Smallest share of the usual text size; below it the card scrolls. Large text may shrink further.
  const float smallest = std::min(0.45F, 0.6F / place.scale);
  constexpr float kMinBesideThePanel = 0.7F;  // smaller covers the panel instead
  // Beside the panel if there is room, with smaller text where the window is small.
  const ImVec2 natural = natural_size();
  const float right = place.left_px + place.width_px;
  const float left = place.width_px > kMinBesideThePanel * natural.x ? place.left_px : 0.0F;
  const float fitting = std::min((right - left) / natural.x, place.bottom_px / natural.y);
  const SmallerText text(legible(std::clamp(fitting, smallest, 1.0F)));
  ImGui::SetNextWindowPos(ImVec2(0.5F * (left + right), 0.5F * place.bottom_px), ImGuiCond_Always,
                          ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowSizeConstraints(ImVec2(0.0F, 0.0F), ImVec2(right - left, place.bottom_px));
  ImGui::Begin("keys", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_HorizontalScrollbar);
  text.begin_text();
  if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
    show_rows("Mouse", kMouseRows);
    show_rows("Keys", kKeyRows);
    ImGui::EndTable();
  }
  text.end_text();
  const ImVec2 low = ImGui::GetWindowPos();
  const ImVec2 size = ImGui::GetWindowSize();
  controls.note("Key card", {low.x, low.y, low.x + size.x, low.y + size.y});
  ImGui::End();
}

}  // namespace pf
