#include "view/slide.hpp"

#include <fmt/printf.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>

namespace pf {
namespace {

// As ImGui draws it: at least as wide as the style says, and as wide as a value of a whole number.
template <class Number>
float knob_width(float slider_px, const std::array<Number, 2>& ends) {
  const float min_px = ImGui::GetStyle().GrabMinSize;
  if constexpr (std::is_same_v<Number, double>) {
    return min_px;
  } else {
    return std::max(min_px, slider_px / static_cast<float>(ends[1] - ends[0] + 1));
  }
}

// The text beside the knob of the last widget: without its unit, then smaller, where the room is short.
void write_beside(std::string text, double share, float knob_px) {
  const ImVec2 low = ImGui::GetItemRectMin();
  const ImVec2 high = ImGui::GetItemRectMax();
  const ImVec2 padding = ImGui::GetStyle().FramePadding;
  const BesideKnob room = beside_knob(low.x, high.x, knob_px, share, 0.5F * padding.x);
  const float room_px = room.x1 - room.x0;
  if (ImGui::CalcTextSize(text.c_str()).x > room_px) text = without_unit(text);
  const float full = ImGui::CalcTextSize(text.c_str()).x;
  const float size = full > room_px ? std::max(room_px / full, 0.6F) : 1.0F;
  const float x = share > 0.5 ? room.x0 : std::max(room.x1 - size * full, room.x0);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->PushClipRect(ImVec2(room.x0, low.y), ImVec2(room.x1, high.y), true);
  const float y = low.y + padding.y + 0.5F * (1.0F - size) * ImGui::GetFontSize();
  list->AddText(ImGui::GetFont(), size * ImGui::GetFontSize(), ImVec2(x, y),
                ImGui::GetColorU32(ImGuiCol_Text), text.c_str());
  list->PopClipRect();
}

}  // namespace

BesideKnob beside_knob(float low, float high, float knob_px, double share, float padding_px) {
  constexpr float kGrabPadding = 2.0F;  // ImGui's, at either end
  const float way = high - low - 2.0F * kGrabPadding - knob_px;
  const float knob = low + kGrabPadding + static_cast<float>(share) * way;
  if (share > 0.5) return {low + padding_px, knob - padding_px};
  return {knob + knob_px + padding_px, high - padding_px};
}

std::string without_unit(const std::string& text) {
  const std::size_t space = text.find(' ');
  const bool is_number = !text.empty() && text.find_first_of("0123456789") < space;
  return is_number ? text.substr(0, space) : text;
}

double last_decimal(const char* format) {
  const std::string text = format;
  const std::size_t point = text.find("%.");
  const bool is_given = point != std::string::npos && point + 2 < text.size();
  return std::pow(0.1, is_given ? text[point + 2] - '0' : 3);
}

std::string number_text(const char* format, double value) {
  const std::string text = fmt::sprintf(format, value);
  if (std::strchr(format, '%') == nullptr) return text;
  constexpr double kRounded = 0.005;
  const std::size_t digit = text.find_first_of("-0123456789");
  const std::size_t end = text.find(' ', digit);
  if (digit != 0 || std::fabs(std::strtod(text.c_str(), nullptr) - value) <= kRounded * std::fabs(value))
    return text;
  return fmt::format("{:.3g}{}", value, end == std::string::npos ? "" : text.substr(end));
}

double knob_share(double value, double low, double high, bool logarithmic, double nearly_zero) {
  if (logarithmic) {
    low = std::max(low, nearly_zero);
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
  std::string text;
  if constexpr (std::is_same_v<Number, double>)
    text = number_text(format, value);
  else
    text = fmt::sprintf(format, value);
  write_beside(std::move(text),
               knob_share(static_cast<double>(value), static_cast<double>(ends[0]),
                          static_cast<double>(ends[1]), logarithmic, last_decimal(format)),
               knob_width(ImGui::GetItemRectSize().x, ends));
  return moved;
}

template bool slide(const char*, double&, const std::array<double, 2>&, const char*, int);
template bool slide(const char*, std::int64_t&, const std::array<std::int64_t, 2>&, const char*, int);

}  // namespace pf
