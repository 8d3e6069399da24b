#include "view/scene_menu.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "core/error.hpp"
#include "scene/scene_file.hpp"
#include "view/overlay_paint.hpp"

namespace pf {
namespace {

std::vector<SceneText> scene_texts() {
  std::vector<SceneText> texts;
  for (const SceneEntry& scene : list_scenes()) {
    texts.push_back({scene.name, ""});
    try {
      texts.back().description = load_scene_file(scene.file).description;
    } catch (const UserError& error) {
      texts.back().description = error.what();
    }
  }
  return texts;
}

// The name, and below it what the scene shows. True if it is chosen.
bool scene_item(SettingRows& rows, const SceneText& scene, bool is_current) {
  const float line = ImGui::GetTextLineHeight();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float room = ImGui::GetContentRegionAvail().x;
  const bool chosen =
      ImGui::Selectable(("##" + scene.name).c_str(), is_current, 0, ImVec2(0.0F, 2.2F * line));
  rows.controls().note("Scene." + scene.name);
  const std::string shown = fitting(scene.description, room);
  if (shown != scene.description) tooltip(scene.description);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddText(at, ImGui::GetColorU32(ImGuiCol_Text), scene.name.c_str());
  list->AddText(ImVec2(at.x, at.y + 1.05F * line), ImGui::GetColorU32(ImGuiCol_TextDisabled), shown.c_str());
  return chosen;
}

}  // namespace

void SceneMenu::edit(SettingRows& rows, const FrameView& frame, Commands& commands) {
  const std::string& current = frame.settings->name;
  ImGui::AlignTextToFramePadding();
  ImGui::TextColored(ImGui::GetStyleColorVec4(ImGuiCol_CheckMark), "Pickleball Flight");
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1.0F);
  // As wide as the longest description, if the window is.
  const float width = std::min(46.0F * ImGui::GetFontSize(), 0.9F * ImGui::GetIO().DisplaySize.x);
  ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0.0F), ImVec2(width, ImGui::GetIO().DisplaySize.y));
  const bool open = ImGui::BeginCombo("##scene", current.c_str(), ImGuiComboFlags_HeightLargest);
  rows.end_row("Scene",
               fmt::format("{}\nAnother scene replaces all settings, also those of the command line, "
                           "and starts from its beginning.",
                           frame.settings->description));
  if (!open) return;
  if (ImGui::IsWindowAppearing()) scenes_ = scene_texts();
  for (const SceneText& scene : scenes_) {
    if (scene_item(rows, scene, scene.name == current)) commands.scene = scene.name;
  }
  ImGui::EndCombo();
}

}  // namespace pf
