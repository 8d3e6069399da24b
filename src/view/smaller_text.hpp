// A window of ImGui with smaller text and narrower margins than the rest.
#pragma once

#include <imgui.h>

namespace pf {

// To be made before ImGui::Begin, with begin_text and end_text within the window. factor: at most 1.
class SmallerText {
 public:
  explicit SmallerText(float factor) : factor_(factor) {
    const ImGuiStyle& style = ImGui::GetStyle();
    const auto smaller = [factor](ImVec2 size) { return ImVec2(factor * size.x, factor * size.y); };
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, smaller(style.WindowPadding));
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, smaller(style.FramePadding));
    ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, smaller(style.CellPadding));
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, smaller(style.ItemSpacing));
    ImGui::PushStyleVar(ImGuiStyleVar_ItemInnerSpacing, smaller(style.ItemInnerSpacing));
    ImGui::PushStyleVar(ImGuiStyleVar_GrabMinSize, factor * style.GrabMinSize);
    ImGui::PushStyleVar(ImGuiStyleVar_ScrollbarSize, factor * style.ScrollbarSize);
  }
  ~SmallerText() { ImGui::PopStyleVar(7); }
  SmallerText(const SmallerText&) = delete;
  SmallerText& operator=(const SmallerText&) = delete;

  void begin_text() const {
#if IMGUI_VERSION_NUM >= 19200
    ImGui::PushFont(nullptr, factor_ * ImGui::GetStyle().FontSizeBase);
#else
    ImGui::SetWindowFontScale(factor_);
#endif
  }
  void end_text() const {
#if IMGUI_VERSION_NUM >= 19200
    ImGui::PopFont();
#endif
  }

 private:
  float factor_;
};

}  // namespace pf
