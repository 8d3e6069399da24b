#include "view/key_card.hpp"

#include <imgui.h>

#include <span>

#include "app/key_table.hpp"

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

}  // namespace

void show_key_card(const OverlayPlace& place, ControlMap& controls) {
  // Beside the panel if there is room. Large text in a small window scrolls.
  const float right = place.left_px + place.width_px;
  const float left = place.width_px > 38.0F * ImGui::GetFontSize() ? place.left_px : 0.0F;
  ImGui::SetNextWindowPos(ImVec2(0.5F * (left + right), 0.5F * place.bottom_px), ImGuiCond_Always,
                          ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowSizeConstraints(ImVec2(0.0F, 0.0F), ImVec2(right - left, place.bottom_px));
  ImGui::Begin("keys", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_HorizontalScrollbar);
  if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
    show_rows("Mouse", kMouseRows);
    show_rows("Keys", kKeyRows);
    ImGui::EndTable();
  }
  const ImVec2 low = ImGui::GetWindowPos();
  const ImVec2 size = ImGui::GetWindowSize();
  controls.note("Key card", {low.x, low.y, low.x + size.x, low.y + size.y});
  ImGui::End();
}

}  // namespace pf
