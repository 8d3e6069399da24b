#include "view/panel.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace pf {
namespace {

constexpr double kDegree = kPi / 180.0;

const Field& field_of(const char* path) { return find_field(path, "panel"); }

// Meaning, unit and allowed range of a setting, as the scene file has them.
std::string help_text(const Field& field) {
  std::string text = field.doc;
  if (!field.unit.empty()) text += fmt::format("\nUnit: {}", field.unit);
  if (field.min < field.max) text += fmt::format("\nAllowed: {:g} to {:g}", field.min, field.max);
  return text + fmt::format("\n{}", field.path());
}

void tooltip(const std::string& text) {
  if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(ImGui::GetFontSize() * 22.0F);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

float label_width() { return ImGui::GetFontSize() * 7.6F; }

}  // namespace

Commands Panel::edit(const FrameView& frame, ViewSwitches& switches, float scale) {
  Commands commands;
  controls_.clear();
  if (!switches.show_panel) return commands;
  edited_ = *frame.settings;
  changed_ = false;
  ImGui::SetNextWindowPos(ImVec2(0.0F, 0.0F));
  ImGui::SetNextWindowSize(ImVec2(width_px(scale), ImGui::GetIO().DisplaySize.y));
  ImGui::Begin("panel", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings);
  ImGui::TextColored(ImVec4(0.949F, 0.831F, 0.247F, 1.0F), "Pickleball Flight");
  ImGui::SameLine();
  ImGui::TextDisabled("%s", edited_.name.c_str());
  edit_buttons(frame, commands);
  ImGui::Separator();
  edit_main();
  if (header("Ball", true)) edit_ball();
  if (header("Air", true)) edit_air();
  if (header("Method", true)) edit_method();
  if (header("View", false)) edit_view(switches);
  ImGui::End();
  if (changed_) commands.settings = edited_;
  return commands;
}

void Panel::edit_buttons(const FrameView& frame, Commands& commands) {
  const float space = ImGui::GetStyle().ItemSpacing.x;
  const float width = (ImGui::GetContentRegionAvail().x - 3.0F * space) / 4.0F;
  commands.toggle_pause = button(frame.paused ? "Run" : "Pause", width, "Space");
  controls_.note("Pause");  // one place for both labels
  ImGui::SameLine();
  ImGui::BeginDisabled(!frame.paused);
  commands.single_step = button("Step", width, "S: one frame, while paused");
  ImGui::EndDisabled();
  ImGui::SameLine();
  commands.reset = button("Reset", width, "R: back to the start of the scene, same seed");
  ImGui::SameLine();
  commands.launch = button("Launch", width, "L: the ball back to its start, the air as it is");
}

void Panel::edit_main() {
  edit_num_parcels();
  slider("Ball spin", "ball.spin_radps", -200.0, 200.0, "%.1f rad/s");
  slider("Restitution", "air.restitution", 0.0, 1.0, "%.3f");
  edit_launch();
  slider("Time scale", "run.time_scale", 0.001, 1.0, "%.3f", ImGuiSliderFlags_Logarithmic);
  ImGui::Spacing();
}

// The number to type and a logarithmic slider, side by side.
void Panel::edit_num_parcels() {
  if (!holds_num_parcels_) num_parcels_ = edited_.num_parcels;
  ImGui::BeginDisabled(edited_.air != Air::parcels);
  const Field& field = field_of("air.num_parcels");
  const std::string help = help_text(field) + "\nTakes effect when you let go, or with Enter.";
  begin_row("Parcels N", "air.num_parcels");
  ImGui::SetNextItemWidth(ImGui::GetFontSize() * 6.2F);
  ImGui::InputScalar("##N typed", ImGuiDataType_S64, &num_parcels_, nullptr, nullptr, "%lld");
  controls_.note("Parcels N typed");
  bool done = ImGui::IsItemDeactivatedAfterEdit();
  holds_num_parcels_ = ImGui::IsItemActive();
  tooltip(help);
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1.0F);
  const std::int64_t low = 1;
  ImGui::SliderScalar(
      "##N", ImGuiDataType_S64, &num_parcels_, &low, &max_parcels_, "",
      ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_NoRoundToFormat | ImGuiSliderFlags_NoInput);
  controls_.note("Parcels N");
  done = done || ImGui::IsItemDeactivatedAfterEdit();
  holds_num_parcels_ = holds_num_parcels_ || ImGui::IsItemActive();
  tooltip(help);
  ImGui::EndDisabled();
  if (!done) return;
  num_parcels_ = std::clamp<std::int64_t>(num_parcels_, 1, static_cast<std::int64_t>(field.max));
  changed_ = changed_ || num_parcels_ != edited_.num_parcels;
  edited_.num_parcels = num_parcels_;
}

// Speed and direction stand for the two components that the scene has.
void Panel::edit_launch() {
  double speed_mps = std::hypot(edited_.ball_vx_mps, edited_.ball_vy_mps);
  if (speed_mps > 0.0) launch_angle_deg_ = std::atan2(edited_.ball_vy_mps, edited_.ball_vx_mps) / kDegree;
  const double limits[4] = {0.0, 60.0, -180.0, 180.0};
  begin_row("Launch speed", "ball.vx_mps");
  bool edited =
      ImGui::SliderScalar("##speed", ImGuiDataType_Double, &speed_mps, &limits[0], &limits[1], "%.2f m/s");
  controls_.note("Launch speed");
  tooltip("speed of the ball at the next launch (L)\nUnit: m/s\nball.vx_mps, ball.vy_mps");
  begin_row("Launch angle", "ball.vy_mps");
  edited |= ImGui::SliderScalar("##angle", ImGuiDataType_Double, &launch_angle_deg_, &limits[2], &limits[3],
                                "%.1f deg");
  controls_.note("Launch angle");
  tooltip("direction of the next launch (L), counter-clockwise from the court's long side\nUnit: degrees");
  if (!edited) return;
  edited_.ball_vx_mps = speed_mps * std::cos(launch_angle_deg_ * kDegree);
  edited_.ball_vy_mps = speed_mps * std::sin(launch_angle_deg_ * kDegree);
  changed_ = true;
}

void Panel::edit_ball() {
  slider("Friction", "ball.friction", 0.0, 1.0, "%.3f");
  checkbox("Magnus", "ball.magnus");
  slider("Magnus k", "ball.k_magnus", 0.0, 0.005, "%.5f kg");
  checkbox("Held", "ball.held");
  checkbox("Relaunch", "run.relaunch");
}

void Panel::edit_air() {
  combo("Air", "air.kind");
  combo("Boundary", "world.boundary");
  checkbox("Contacts", "air.contacts");
  slider("Parcel speed", "air.parcel_speed_mps", 0.0, 10.0, "%.2f m/s");
  if (!holds_area_fraction_) area_fraction_ = edited_.area_fraction;
  const double limits[2] = {0.001, field_of("air.area_fraction").max};
  begin_row("Area fraction", "air.area_fraction");
  ImGui::SliderScalar("##eta", ImGuiDataType_Double, &area_fraction_, &limits[0], &limits[1], "%.3f",
                      ImGuiSliderFlags_AlwaysClamp);
  controls_.note("Area fraction");
  holds_area_fraction_ = ImGui::IsItemActive();
  const bool done = ImGui::IsItemDeactivatedAfterEdit();
  tooltip(help_text(field_of("air.area_fraction")) + "\nTakes effect when you let go.");
  if (!done || area_fraction_ == edited_.area_fraction) return;
  edited_.area_fraction = area_fraction_;
  changed_ = true;
}

void Panel::edit_method() {
  combo("Method", "run.method");
  combo("Neighbours", "run.neighbors");
  slider("Move per step", "run.displacement_per_step", 0.01, 1.0, "%.3f diam.", ImGuiSliderFlags_Logarithmic);
  begin_row("Substeps", "run.substeps");
  const std::int64_t limits[2] = {0, 64};
  const bool edited = ImGui::SliderScalar("##substeps", ImGuiDataType_S64, &edited_.substeps, &limits[0],
                                          &limits[1], edited_.substeps == 0 ? "as time scale asks" : "%lld",
                                          ImGuiSliderFlags_AlwaysClamp);
  end_row("Substeps", "run.substeps", edited);
}

void Panel::edit_view(ViewSwitches& switches) {
  ImGui::Checkbox("Ball's path (T)", &switches.show_path);
  controls_.note("Path");
  begin_row("Overlay", "run.method");
  ImGui::Combo("##overlay", &switches.overlay_mode, "full\0compact\0off\0");
  controls_.note("Overlay");
  if (button("Fit (F)", -1.0F, "the whole world in the picture; drag pans, the wheel zooms"))
    switches.fit_camera = true;
  ImGui::TextDisabled("H hides this panel, O the overlay, Esc quits");
}

void Panel::begin_row(const char* label, const char* path) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(label);
  if (*label != '\0') tooltip(help_text(field_of(path)));
  ImGui::SameLine(label_width());
  ImGui::SetNextItemWidth(-1.0F);
}

void Panel::end_row(const char* label, const char* path, bool changed) {
  controls_.note(label);
  tooltip(help_text(field_of(path)));
  changed_ = changed_ || changed;
}

// A number of settings; low and high are the slider's ends, typing (control and click) reaches the field's
// own.
void Panel::slider(const char* label, const char* path, double low, double high, const char* format,
                   int flags) {
  const Field& field = field_of(path);
  double& value = edited_.*std::get<double Settings::*>(field.member);
  begin_row(label, path);
  const std::string id = std::string("##") + path;
  const bool changed = ImGui::SliderScalar(id.c_str(), ImGuiDataType_Double, &value, &low, &high, format,
                                           flags | ImGuiSliderFlags_NoRoundToFormat);
  if (changed) value = std::clamp(value, field.min, field.max);
  end_row(label, path, changed);
}

void Panel::checkbox(const char* label, const char* path) {
  const Field& field = field_of(path);
  begin_row(label, path);
  const std::string id = std::string("##") + path;
  end_row(label, path, ImGui::Checkbox(id.c_str(), &(edited_.*std::get<bool Settings::*>(field.member))));
}

void Panel::combo(const char* label, const char* path) {
  const Choice& choice = std::get<Choice>(field_of(path).member);
  const int present = choice.get(edited_);
  begin_row(label, path);
  const std::string id = std::string("##") + path;
  int chosen = present;
  const bool open = ImGui::BeginCombo(id.c_str(), choice.names[static_cast<std::size_t>(present)].c_str());
  end_row(label, path, false);
  if (!open) return;
  for (int i = 0; i < static_cast<int>(choice.names.size()); ++i) {
    const std::string& name = choice.names[static_cast<std::size_t>(i)];
    if (ImGui::Selectable(name.c_str(), i == present)) chosen = i;
    controls_.note(std::string(label) + "." + name);
  }
  ImGui::EndCombo();
  if (chosen == present) return;
  choice.set(edited_, chosen);
  changed_ = true;
}

bool Panel::button(const char* label, float width_px, const char* help) {
  const bool pressed = ImGui::Button(label, ImVec2(width_px, 0.0F));
  controls_.note(label);
  tooltip(help);
  return pressed;
}

bool Panel::header(const char* label, bool open) {
  const bool shown =
      ImGui::CollapsingHeader(label, open ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
  controls_.note(std::string(label) + " header");
  return shown;
}

}  // namespace pf
