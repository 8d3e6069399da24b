#include "view/cue_section.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "view/overlay_paint.hpp"

namespace pf {
namespace {

std::string label_of(const Cue& cue, int index) {
  const std::string& name = cue.title.empty() ? cue.settings.name : cue.title;
  return fmt::format("{}  {}", index + 1, name);
}

std::string tooltip_of(const Cue& cue, int index) {
  std::string text = cue.subtitle.empty() ? cue.title : cue.subtitle;
  text += fmt::format("\nScene {}{}", cue.settings.name, cue.paused ? ", begins paused" : "");
  if (index < 9) text += fmt::format("\nKey {}", index + 1);
  return text;
}

void fill(std::array<char, 256>& field, const std::string& text) {
  field.fill('\0');
  std::copy_n(text.begin(), std::min(text.size(), field.size() - 1), field.begin());
}

}  // namespace

void CueSection::edit(SettingRows& rows, const CuePlayer& cues, CueRequest& request) {
  if (cues.list().file != shown_file_) {
    shown_file_ = cues.list().file.string();
    fill(file_, shown_file_);
  }
  list(rows, cues, request);
  file_rows(rows, request);
}

void CueSection::list(SettingRows& rows, const CuePlayer& cues, CueRequest& request) {
  if (cues.size() == 0) {
    ImGui::TextDisabled("No cues: give a file, or start with --cues");
    return;
  }
  for (int i = 0; i < cues.size(); ++i) {
    const Cue& cue = cues.list().cues[static_cast<std::size_t>(i)];
    const bool is_current = i == cues.current();
    const std::string label = label_of(cue, i);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float indent = ImGui::GetFontSize();
    ImGui::PushID(i);
    if (ImGui::Selectable("##cue", is_current)) request.go_to = i;
    ImGui::PopID();
    rows.end_row(fmt::format("Cue {}{}", i + 1, is_current ? " current" : "").c_str(), tooltip_of(cue, i));
    ImDrawList* paint = ImGui::GetWindowDrawList();
    const ImU32 accent = ImGui::GetColorU32(ImGuiCol_CheckMark);
    if (is_current)
      paint->AddCircleFilled(ImVec2(at.x + 0.35F * indent, at.y + 0.5F * indent), 0.22F * indent, accent);
    const float room = ImGui::GetContentRegionAvail().x - indent;
    paint->AddText(ImVec2(at.x + indent, at.y), ImGui::GetColorU32(ImGuiCol_Text),
                   fitting(label, room).c_str());
  }
}

void CueSection::file_rows(SettingRows& rows, CueRequest& request) {
  const float button = ImGui::GetFontSize() * 4.5F;
  ImGui::SetNextItemWidth(-button);
  ImGui::InputTextWithHint("##cue file", "NAME.toml", file_.data(), file_.size());
  rows.end_row("Cue file", "a list of cues");
  ImGui::SameLine();
  ImGui::BeginDisabled(file_[0] == '\0');
  if (rows.button("Load", -1.0F, "read the list and go to its first cue; an error in it changes nothing"))
    request.load = file_.data();
  ImGui::EndDisabled();
  ImGui::SetNextItemWidth(-button);
  ImGui::InputTextWithHint("##cue title", "title", title_.data(), title_.size());
  rows.end_row("Cue title", "of the cue to add");
  ImGui::SameLine();
  ImGui::BeginDisabled(file_[0] == '\0');
  if (rows.button(
          "Add", -1.0F,
          "append the present settings, camera and pause to the file as a cue; it begins its flight from "
          "the start"))
    request.save_to = file_.data();
  ImGui::EndDisabled();
  if (!request.save_to.empty()) request.title = title_.data();
}

}  // namespace pf
