#include "view/slide.hpp"

#include <fmt/printf.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace pf {
namespace {

// The text in the half of the last widget without the knob.
void write_beside(const std::string& text, double share) {
  const ImVec2 low = ImGui::GetItemRectMin();
  const ImVec2 high = ImGui::GetItemRectMax();
  const ImVec2 padding = ImGui::GetStyle().FramePadding;
  const float width = ImGui::CalcTextSize(text.c_str()).x;
  const float x = share > 0.5 ? low.x + padding.x : std::max(high.x - padding.x - width, low.x);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->PushClipRect(low, high, true);
  list->AddText(ImVec2(x, low.y + padding.y), ImGui::GetColorU32(ImGuiCol_Text), text.c_str());
  list->PopClipRect();
}

}  // namespace

double knob_share(double value, double low, double high, bool logarithmic) {
  if (logarithmic) {
    low = std::max(low, 1e-4 * high);
    value = std::log(std::max(value, low) / low);
    high = std::log(high / low);
    low = 0.0;
  }
  return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
}

template <class Number>
bool slide(const char* id, Number& value, const std::array<Number, 2>& ends, const char* format, int flags) {
  static std::string typed;  // the slider that shows a field to type in
  constexpr ImGuiDataType kType = std::is_same_v<Number, double> ? ImGuiDataType_Double : ImGuiDataType_S64;
  const bool was_typed = typed == id;
  if (!was_typed) ImGui::PushStyleColor(ImGuiCol_Text, 0);  // the number is written below
  const bool moved = ImGui::SliderScalar(id, kType, &value, &ends[0], &ends[1], format, flags);
  if (!was_typed) ImGui::PopStyleColor();
  const bool is_typed = ImGui::IsItemActive() && ImGui::GetIO().WantTextInput;
  if (is_typed) typed = id;
  if (!is_typed && was_typed) typed.clear();
  if (is_typed || was_typed) return moved;
  const bool logarithmic = (flags & ImGuiSliderFlags_Logarithmic) != 0;
  write_beside(fmt::sprintf(format, value),
               knob_share(static_cast<double>(value), static_cast<double>(ends[0]),
                          static_cast<double>(ends[1]), logarithmic));
  return moved;
}

template bool slide(const char*, double&, const std::array<double, 2>&, const char*, int);
template bool slide(const char*, std::int64_t&, const std::array<std::int64_t, 2>&, const char*, int);

}  // namespace pf
