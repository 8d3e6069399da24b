#include "view/setting_rows.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "view/slide.hpp"

namespace pf {
namespace {

const Field& field_of(const char* path) { return find_field(path, "panel"); }

double number_of(const Field& field, const Settings& settings) {
  if (const auto* whole = std::get_if<std::int64_t Settings::*>(&field.member))
    return static_cast<double>(settings.**whole);
  return settings.*std::get<double Settings::*>(field.member);
}

void set_number(const Field& field, double value, Settings& settings) {
  if (const auto* whole = std::get_if<std::int64_t Settings::*>(&field.member)) {
    settings.** whole = static_cast<std::int64_t>(value);
  } else {
    settings.*std::get<double Settings::*>(field.member) = value;
  }
}

constexpr double kRefusalShown_s = 8.0;

NumberRange range_of(const Field& field) { return {field.min, field.max, field.unit.c_str()}; }

}  // namespace

std::string refusal_of(double value, const NumberRange& range) {
  if (range.whole && value != std::round(value))
    return fmt::format("{} is not a whole number; nothing changed", value);
  if (value >= range.low && value <= range.high) return "";
  return fmt::format("{:.12g} is not within {} to {}{}{}; nothing changed", value, limit_text(range.low),
                     limit_text(range.high), *range.unit != '\0' ? " " : "", range.unit);
}

const std::string& help_of(const char* path) {
  static std::unordered_map<const Field*, std::string> made;
  const Field& field = field_of(path);
  std::string& text = made[&field];
  if (!text.empty()) return text;
  text = field.doc;
  if (!field.unit.empty()) text += fmt::format("\nUnit: {}", field.unit);
  if (field.min < field.max) text += fmt::format("\nAllowed: {}", range_text(field));
  if (const auto* choice = std::get_if<Choice>(&field.member))
    text += fmt::format("\nAllowed: {}", fmt::join(choice->names, ", "));
  text += fmt::format("\n{}", field.path());
  return text;
}

void tooltip(const std::string& text) {
  if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled) || ImGui::IsAnyItemActive()) return;
  const float font = ImGui::GetFontSize();
  const float wrap = 22.0F * font;
  const ImVec2 padding = ImGui::GetStyle().WindowPadding;
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, wrap);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float right = ImGui::GetWindowPos().x + ImGui::GetWindowWidth() + 0.5F * font;
  ImGui::SetNextWindowPos(
      ImVec2(std::max(std::min(right, screen.x - size.x - 2.0F * padding.x), 0.0F),
             std::max(std::min(ImGui::GetItemRectMin().y, screen.y - size.y - 2.0F * padding.y), 0.0F)));
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(wrap);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

void SettingRows::begin_frame(const Settings& shown, const Settings* scene) {
  controls_.clear();
  label_room_ = kLabelRoom;
  edited_ = shown;
  scene_ = scene;
  changed_ = false;
  const ImVector<ImWchar>& letters = ImGui::GetIO().InputQueueCharacters;
  types_comma_ = std::find(letters.begin(), letters.end(), ImWchar{','}) != letters.end();
}

void SettingRows::begin_row(const char* label, const std::string& help, Paths paths) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(label);
  show_help(help, paths);
  offer_scene_value(label, paths, true);
  ImGui::SameLine(label_room_ * ImGui::GetFontSize());
  ImGui::SetNextItemWidth(-1.0F);
}

void SettingRows::end_row(const char* label, const std::string& help, Paths paths) {
  controls_.note(label);
  show_help(help, paths);
}

bool SettingRows::differs(Paths paths) const {
  return scene_ != nullptr && std::any_of(paths.begin(), paths.end(), [&](const char* path) {
           return !is_same(field_of(path), edited_, *scene_);
         });
}

void SettingRows::show_help(const std::string& help, Paths paths) const {
  if (is_quiet_) return;
  if (scene_ == nullptr || paths.size() == 0 || !ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
    return tooltip(help);
  std::vector<std::string> values;
  for (const char* path : paths) values.push_back(value_text(field_of(path), *scene_));
  tooltip(fmt::format(
      "{}\nThe scene has: {}{}", help, fmt::join(values, ", "),
      differs(paths) ? "; a click on the dot goes back to it, so does a double click on the label" : ""));
}

// For the last widget. Checkboxes take a double click for themselves.
void SettingRows::offer_scene_value(const char* label, Paths paths, bool is_label) {
  if (paths.size() == 0) return;
  if (is_label) controls_.note(std::string(label) + " label");
  if (!differs(paths)) return;
  const ImVec2 low = ImGui::GetItemRectMin();
  const ImVec2 high = ImGui::GetItemRectMax();
  const float font = ImGui::GetFontSize();
  const ImVec2 dot(low.x - 0.3F * font, 0.5F * (low.y + high.y));
  ImGui::GetWindowDrawList()->AddCircleFilled(dot, 0.18F * font, ImGui::GetColorU32(ImGuiCol_CheckMark));
  const ImVec2 dot_low(low.x - font, low.y);
  const ImVec2 dot_high(low.x, high.y);
  controls_.note(std::string(label) + " dot", {dot_low.x, dot_low.y, dot_high.x, dot_high.y});
  const bool on_dot = ImGui::IsWindowHovered() && ImGui::IsMouseHoveringRect(dot_low, dot_high);
  const bool on_item = ImGui::IsItemHovered();
  const bool asked = (on_dot && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) ||
                     (on_item && ImGui::IsMouseClicked(ImGuiMouseButton_Right)) ||
                     (on_item && is_label && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left));
  if (!asked) return;
  for (const char* path : paths) copy_field(field_of(path), *scene_, edited_);
  held_label_.clear();
  refused_label_.clear();
  changed_ = true;
}

bool SettingRows::move(const Field& field, const SliderLook& look, double& value) {
  const std::string id = "##" + field.path();
  const int flags = ImGuiSliderFlags_NoRoundToFormat | (look.logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
  const char* format = value == 0.0 && look.at_zero != nullptr ? look.at_zero : look.format;
  if (std::holds_alternative<double Settings::*>(field.member))
    return slide<double>(id.c_str(), value, {look.low, look.high}, format, flags);
  auto whole = static_cast<std::int64_t>(value);
  const bool moved = slide<std::int64_t>(
      id.c_str(), whole, {static_cast<std::int64_t>(look.low), static_cast<std::int64_t>(look.high)}, format,
      flags);
  value = static_cast<double>(whole);
  return moved;
}

void SettingRows::slider(const char* label, const char* path, const SliderLook& look) {
  const Field& field = field_of(path);
  const std::string help = help_of(path) + (look.on_release ? "\nTakes effect when you let go." : "");
  double value = held_or(label, number_of(field, edited_));
  begin_row(label, help, {path});
  const bool moved = move(field, look, value);
  const auto number = take_finished(label, value, moved, look.on_release, range_of(field));
  end_row(label, help, {path});
  show_refusal(label);
  if (!number) return;
  set_number(field, *number, edited_);
  changed_ = true;
}

std::optional<double> SettingRows::take_finished(const char* label, double value, bool moved, bool on_release,
                                                 const NumberRange& range) {
  // A typed number counts when it is finished: 1e9 on the way to 1e-9 must not.
  const bool waits = on_release || ImGui::GetIO().WantTextInput;
  const bool done = held_label_ == label || waits ? ImGui::IsItemDeactivatedAfterEdit() : moved;
  if (ImGui::IsItemActivated()) {
    refused_label_.clear();
    has_comma_ = false;
  }
  // ImGui leaves commas out: 1,5 would be 15.
  has_comma_ = has_comma_ || (types_comma_ && ImGui::IsItemActive());
  if (waits && ImGui::IsItemActive()) {
    held_label_ = label;
    held_value_ = value;
  } else if (held_label_ == label) {
    held_label_.clear();
  }
  if (!done) return std::nullopt;
  refusal_ = has_comma_ ? "a number has a point, not a comma; nothing changed" : refusal_of(value, range);
  refused_label_ = refusal_.empty() ? "" : label;
  refused_until_s_ = ImGui::GetTime() + kRefusalShown_s;
  return refusal_.empty() ? std::optional(value) : std::nullopt;
}

void SettingRows::show_refusal(const char* label) {
  if (refused_label_ != label || ImGui::GetTime() > refused_until_s_ || !ImGui::IsItemVisible()) return;
  const ImGuiStyle& style = ImGui::GetStyle();
  const float left = ImGui::GetWindowPos().x + style.WindowPadding.x;
  const float width = ImGui::GetWindowWidth() - style.ScrollbarSize - 2.0F * style.WindowPadding.x;
  const float wrap = width - 2.0F * style.FramePadding.x;
  const ImVec2 size = ImGui::CalcTextSize(refusal_.c_str(), nullptr, false, wrap);
  const float height = size.y + 2.0F * style.FramePadding.y;
  const float below = ImGui::GetItemRectMax().y + 1.0F;
  const bool fits = below + height <= ImGui::GetIO().DisplaySize.y;
  const ImVec2 low(left, fits ? below : ImGui::GetItemRectMin().y - 1.0F - height);
  const ImVec2 high(left + width, low.y + height);
  ImDrawList* list = ImGui::GetForegroundDrawList();
  ImVec4 ground = ImGui::GetStyleColorVec4(ImGuiCol_PopupBg);
  ground.w = 1.0F;
  list->AddRectFilled(low, high, ImGui::GetColorU32(ground), style.FrameRounding);
  list->AddRect(low, high, ImGui::GetColorU32(ImGuiCol_CheckMark), style.FrameRounding);
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(),
                ImVec2(low.x + style.FramePadding.x, low.y + style.FramePadding.y),
                ImGui::GetColorU32(ImGuiCol_Text), refusal_.c_str(), nullptr, wrap);
  controls_.note(std::string(label) + " refused", {low.x, low.y, high.x, high.y});
}

void SettingRows::checkboxes(std::initializer_list<std::pair<const char*, const char*>> boxes) {
  const float width = ImGui::GetContentRegionAvail().x / static_cast<float>(boxes.size());
  const float left = ImGui::GetCursorPosX();
  float column = 0.0F;
  for (const auto& [label, path] : boxes) {
    if (column > 0.0F) ImGui::SameLine(left + column * width);
    if (ImGui::Checkbox(label, &(edited_.*std::get<bool Settings::*>(field_of(path).member))))
      changed_ = true;
    end_row(label, help_of(path), {path});
    offer_scene_value(label, {path}, false);
    column += 1.0F;
  }
}

int SettingRows::menu(const char* label, const std::string& help, const char* id,
                      const std::vector<std::string>& names, int current, Paths paths) {
  begin_row(label, help, paths);
  int chosen = current;
  const bool open = ImGui::BeginCombo(id, names[static_cast<std::size_t>(current)].c_str());
  end_row(label, help, paths);
  if (!open) return current;
  for (int i = 0; i < static_cast<int>(names.size()); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    if (ImGui::Selectable(name.c_str(), i == current)) chosen = i;
    controls_.note(std::string(label) + "." + name);
  }
  ImGui::EndCombo();
  return chosen;
}

void SettingRows::combo(const char* label, const char* path) {
  const Choice& choice = std::get<Choice>(field_of(path).member);
  const int current = choice.get(edited_);
  const std::string id = std::string("##") + path;
  const int chosen = menu(label, help_of(path), id.c_str(), choice.names, current, {path});
  if (chosen == current) return;
  choice.set(edited_, chosen);
  changed_ = true;
}

void SettingRows::edit_field(const Field& field) {
  const std::string path = field.path();
  if (std::holds_alternative<Choice>(field.member)) return combo(path.c_str(), path.c_str());
  if (std::holds_alternative<bool Settings::*>(field.member))
    return checkboxes({{path.c_str(), path.c_str()}});
  begin_row(field.key.c_str(), help_of(path.c_str()), {path.c_str()});
  const std::string id = "##all " + path;
  double value = held_or(path.c_str(), number_of(field, edited_));
  NumberRange range = range_of(field);
  range.whole = std::holds_alternative<std::int64_t Settings::*>(field.member);
  const bool moved = ImGui::InputDouble(id.c_str(), &value, 0.0, 0.0, range.whole ? "%.0f" : "%.8g",
                                        ImGuiInputTextFlags_CharsScientific);
  const auto number = take_finished(path.c_str(), value, moved, true, range);
  end_row(path.c_str(), help_of(path.c_str()), {path.c_str()});
  show_refusal(path.c_str());
  if (!number) return;
  set_number(field, *number, edited_);
  changed_ = true;
}

bool SettingRows::button(const char* label, float width_px, const char* help) {
  const bool pressed = ImGui::Button(label, ImVec2(width_px, 0.0F));
  end_row(label, help);
  return pressed;
}

bool SettingRows::header(const char* label, bool open) {
  const bool shown =
      ImGui::CollapsingHeader(label, open ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
  controls_.note(std::string(label) + " header");
  return shown;
}

}  // namespace pf
