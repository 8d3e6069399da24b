#include "view/panel.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "app/options.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"
#include "view/slide.hpp"
#include "view/smaller_text.hpp"

namespace pf {
namespace {

constexpr double kDegree = kPi / 180.0;

// A menu of names; the choice is an index.
template <class Index>
void choose(const char* id, const std::vector<std::string>& names, Index& chosen, const char* label,
            ControlMap& controls) {
  const auto current = static_cast<std::size_t>(chosen);
  const bool open = ImGui::BeginCombo(id, names[current].c_str());
  controls.note(label);
  if (!open) return;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (ImGui::Selectable(names[i].c_str(), i == current)) chosen = static_cast<Index>(i);
    controls.note(std::string(label) + "." + names[i]);
  }
  ImGui::EndCombo();
}

}  // namespace

Panel::Panel(std::int64_t max_parcels, std::string draw_target, std::string gl_device)
    : max_parcels_(max_parcels),
      draw_target_(std::move(draw_target)),
      gl_device_(std::move(gl_device)),
      num_threads_(std::max(1U, std::thread::hardware_concurrency())) {}

Commands Panel::edit(const FrameView& frame, ViewSwitches& switches, float scale) {
  Commands commands;
  rows_.begin_frame(frame.asked ? *frame.asked : *frame.settings, scene_settings_);
  rows_.hush(switches.show_keys);
  shows_accuracy_ = false;
  if (!switches.show_panel) return commands;
  ImGui::SetNextWindowPos(ImVec2(0.0F, 0.0F));
  ImGui::SetNextWindowSize(ImVec2(width_px(scale), ImGui::GetIO().DisplaySize.y));
  const SmallerText smaller(std::min(1.0F, max_scale_ / scale));
  ImGui::Begin("panel", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings);
  smaller.begin_text();
  scene_menu_.edit(rows_, frame, commands);
  edit_buttons(frame, commands);
  ImGui::Separator();
  edit_main(frame);
  if (cues_ != nullptr && cues_->size() > 0 && rows_.header("Cues", true))
    cue_section_.edit(rows_, *cues_, cue_request_);
  if (rows_.header("Ball", true)) edit_ball(frame);
  if (rows_.header("Air", true)) edit_air(frame);
  if (rows_.header("Method", true)) edit_method(frame);
  shows_accuracy_ = rows_.header("Accuracy", false);
  if (shows_accuracy_) accuracy_.edit(rows_, frame, readout_, switches.look.theme);
  if (rows_.header("View", true)) edit_view(frame, switches);
  if (rows_.header("Presenting", false)) edit_show(frame, switches, commands);
  if (rows_.header("Two methods at once", false)) split_.edit(rows_, frame, switches.split);
  if (rows_.header("All settings", false)) edit_all();
  smaller.end_text();
  ImGui::End();
  if (rows_.changed()) commands.settings = rows_.edited();
  if (!commands.scene.empty()) switches.fit_camera = true;
  return commands;
}

void Panel::edit_buttons(const FrameView& frame, Commands& commands) {
  const float space = ImGui::GetStyle().ItemSpacing.x;
  const float width = (ImGui::GetContentRegionAvail().x - 3.0F * space) / 4.0F;
  commands.toggle_pause = rows_.button(frame.paused ? "Run" : "Pause", width, "Space");
  rows_.controls().note("Pause");  // one label for tests
  ImGui::SameLine();
  ImGui::BeginDisabled(!frame.paused);
  commands.single_step = rows_.button("Step", width, "S: one frame, while paused");
  ImGui::EndDisabled();
  ImGui::SameLine();
  commands.reset = rows_.button("Reset", width, "R: back to the start of the scene, same seed");
  ImGui::SameLine();
  ImGui::BeginDisabled(!frame.settings->ball_present);
  commands.launch = rows_.button("Launch", width, "L: launches the ball again, in the same air");
  ImGui::EndDisabled();
}

void Panel::edit_main(const FrameView& frame) {
  edit_num_parcels();
  ImGui::BeginDisabled(!frame.settings->ball_present);
  rows_.slider("Ball spin", "ball.spin_radps", {.low = -200.0, .high = 200.0, .format = "%.1f rad/s"});
  ImGui::EndDisabled();
  rows_.slider("Restitution", "air.restitution", {});
  ImGui::BeginDisabled(!frame.settings->ball_present);
  edit_launch();
  ImGui::EndDisabled();
  ImGui::BeginDisabled(paces_by_substeps(rows_.edited()));
  rows_.slider("Time scale", "run.time_scale", {.low = 0.001, .logarithmic = true});
  ImGui::EndDisabled();
}

// A field to type the number, and a logarithmic slider.
void Panel::edit_num_parcels() {
  Settings& edited = rows_.edited();
  const NumberRange range = {1.0, find_field("air.num_parcels", "panel").max, "", true};
  auto num = static_cast<std::int64_t>(rows_.held_or("Parcels N", static_cast<double>(edited.num_parcels)));
  double typed = rows_.held_or("Parcels N typed", static_cast<double>(num));
  ImGui::BeginDisabled(edited.air != Air::parcels);
  const std::string help = fmt::format(
      "number of parcels\nAllowed: 1 to {}\nair.num_parcels\nTakes effect when you let go, or with Enter.",
      limit_text(range.high));
  rows_.begin_row("Parcels N", help, {"air.num_parcels"});
  ImGui::SetNextItemWidth(ImGui::GetFontSize() * 6.2F);
  bool moved = ImGui::InputDouble("##N typed", &typed, 0.0, 0.0, "%.0f", ImGuiInputTextFlags_CharsScientific);
  auto number = rows_.take_finished("Parcels N typed", typed, moved, true, range);
  rows_.end_row("Parcels N typed", help, {"air.num_parcels"});
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1.0F);
  const std::int64_t low = 1;
  moved = ImGui::SliderScalar(
      "##N", ImGuiDataType_S64, &num, &low, &max_parcels_, "",
      ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_NoRoundToFormat | ImGuiSliderFlags_NoInput);
  if (const auto slid = rows_.take_finished("Parcels N", static_cast<double>(num), moved, true, range))
    number = slid;
  rows_.end_row("Parcels N", help, {"air.num_parcels"});
  ImGui::EndDisabled();
  rows_.show_refusal("Parcels N typed");
  if (!number || static_cast<std::int64_t>(*number) == edited.num_parcels) return;
  edited.num_parcels = static_cast<std::int64_t>(*number);
  rows_.mark_changed();
}

// Speed and direction, for the scene's two components of velocity.
void Panel::edit_launch() {
  Settings& edited = rows_.edited();
  const double speed_mps = std::hypot(edited.ball_vx_mps, edited.ball_vy_mps);
  if (speed_mps > 0.0) launch_angle_deg_ = std::atan2(edited.ball_vy_mps, edited.ball_vx_mps) / kDegree;
  const std::string help =
      fmt::format("speed and angle (degrees, counter-clockwise) of the next launch:\n{}\n{}",
                  help_of("ball.vx_mps"), help_of("ball.vy_mps"));
  const double max_mps = find_field("ball.vx_mps", "panel").max;
  const auto speed =
      launch_row("Launch speed", help, speed_mps, {0.0, 60.0, "%.2f m/s"}, {0.0, max_mps, "m/s"});
  const auto angle = launch_row("Launch angle", help, launch_angle_deg_, {-180.0, 180.0, "%.1f deg"},
                                {-360.0, 360.0, "degrees"});
  if (!speed && !angle) return;
  launch_angle_deg_ = angle.value_or(launch_angle_deg_);
  edited.ball_vx_mps = speed.value_or(speed_mps) * std::cos(launch_angle_deg_ * kDegree);
  edited.ball_vy_mps = speed.value_or(speed_mps) * std::sin(launch_angle_deg_ * kDegree);
  rows_.mark_changed();
}

// The number to apply, if any.
std::optional<double> Panel::launch_row(const char* label, const std::string& help, double value,
                                        const SliderLook& look, const NumberRange& range) {
  rows_.begin_row(label, help, {"ball.vx_mps", "ball.vy_mps"});
  value = rows_.held_or(label, value);
  const std::string id = std::string("##") + label;
  const bool moved = slide<double>(id.c_str(), value, {look.low, look.high}, look.format);
  const auto number = rows_.take_finished(label, value, moved, false, range);
  rows_.end_row(label, help, {"ball.vx_mps", "ball.vy_mps"});
  rows_.show_refusal(label);
  return number;
}

void Panel::edit_ball(const FrameView& frame) {
  ImGui::BeginDisabled(!frame.settings->ball_present);
  rows_.slider("Friction", "ball.friction", {});
  rows_.slider("Magnus k", "ball.k_magnus", {.high = 0.005, .format = "%.5f kg"});
  rows_.checkboxes({{"Magnus", "ball.magnus"}, {"Held", "ball.held"}, {"Relaunch", "run.relaunch"}});
  ImGui::EndDisabled();
}

void Panel::edit_air(const FrameView& frame) {
  rows_.combo("Air", "air.kind");
  rows_.combo("Boundary", "world.boundary");
  const Settings& edited = rows_.edited();
  ImGui::BeginDisabled(edited.air != Air::parcels);
  rows_.checkboxes({{"Contacts", "air.contacts"}});
  rows_.slider("Parcel speed", "air.parcel_speed_mps",
               {.high = 10.0, .format = "%.2f m/s", .on_release = true});
  // With a given radius the area fraction has no effect, unless the box is made from both.
  const bool is_free = edited.parcel_radius_m == 0.0 || edited.box_follows_parcels;
  ImGui::BeginDisabled(!is_free);
  const std::string derived = is_free ? "" : fmt::format("{:.3g}", area_fraction_of(*frame.physics));
  rows_.slider("Area fraction", "air.area_fraction",
               {.low = 0.001, .high = 0.7, .format = is_free ? "%.3f" : derived.c_str(), .on_release = true});
  ImGui::EndDisabled();
  ImGui::EndDisabled();
}

void Panel::edit_method(const FrameView& frame) {
  const Settings& edited = rows_.edited();
  rows_.combo("Method", "run.method");
  rows_.combo("Neighbours", "run.neighbors");
  ImGui::BeginDisabled(edited.dt_s > 0.0);
  rows_.slider("Displacement / step", "run.displacement_per_step",
               {.low = 0.01, .format = "%.3f diam.", .logarithmic = true});
  ImGui::EndDisabled();
  rows_.slider("Time step", "run.dt_s",
               {.high = 0.1, .format = "%.6f s", .logarithmic = true, .at_zero = "automatic"});
  ImGui::BeginDisabled(edited.method != Method::exact || edited.restitution == 1.0 ||
                       edited.contact_clock_s > 0.0);
  rows_.slider("Contact clock", "run.contact_clock",
               {.high = 0.1, .format = "%.5f free times", .logarithmic = true, .at_zero = "off"});
  ImGui::EndDisabled();
  rows_.slider("Substeps", "run.substeps", {.high = 64.0, .format = "%lld", .at_zero = "as time scale asks"});
  const bool on_cpu = frame.backend == "cpu";
  const std::string all = on_cpu ? fmt::format("all {}", num_threads_) : "not used";
  ImGui::BeginDisabled(!on_cpu);
  rows_.slider("Threads", "run.threads",
               {.high = static_cast<double>(num_threads_),
                .format = "%lld",
                .at_zero = all.c_str(),
                .on_release = true});
  ImGui::EndDisabled();
}

void Panel::edit_view(const FrameView& frame, ViewSwitches& switches) {
  ImGui::Checkbox("Ball's path (T)", &switches.show_path);
  rows_.end_row("Path", "the ball's path");
  ImGui::SameLine();
  const float half = 0.5F * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
  if (rows_.button("Fit (F)", half, "the whole world in the picture; drag pans, the wheel zooms"))
    switches.fit_camera = true;
  ImGui::SameLine();
  if (rows_.button("Keys (F1)", half, "all keys and mouse gestures on a card; Esc closes it"))
    switches.show_keys = !switches.show_keys;
  const bool has_ball = frame.physics->ball.exists;
  ImGui::BeginDisabled(!has_ball);
  ImGui::Checkbox("Follow ball (Z)", &switches.follow_ball);
  ImGui::EndDisabled();
  rows_.end_row("Follow ball",
                "the camera keeps the ball in the middle; the wheel zooms, a drag or F ends it");
  ImGui::SameLine(ImGui::GetCursorPosX() + 0.5F * ImGui::GetContentRegionAvail().x);
  ImGui::BeginDisabled(!has_ball || switches.split.mode != SplitMode::off);
  if (ImGui::Checkbox("Magnifier (N)", &switches.has_magnifier))
    switches.magnifier = switches.has_magnifier ? MagnifierMode::on : MagnifierMode::off;
  ImGui::EndDisabled();
  rows_.end_row("Magnifier",
                "the ball in a picture of its own, by itself where it is small; the wheel over it magnifies");
  const std::string overlay_help =
      "times and figures at the lower edge (O)\nH hides this panel, Esc twice quits";
  rows_.begin_row("Overlay", overlay_help);
  ImGui::Combo("##overlay", &switches.overlay_mode, "full\0compact\0off\0");
  rows_.end_row("Overlay", overlay_help);
  const std::string target_help = fmt::format(
      "the way of the parcels to the renderer, and the reason: {}\nChosen at the start: --draw-target. {} "
      "draws",
      draw_target_, gl_device_);
  rows_.begin_row("Draw target", target_help);
  ImGui::TextDisabled("%s", draw_target_.c_str());
  rows_.end_row("Draw target", target_help);
}

// For a talk: comparing, jumping back, looks, saving.
void Panel::edit_show(const FrameView& frame, ViewSwitches& switches, Commands& commands) {
  const float space = ImGui::GetStyle().ItemSpacing.x;
  const float width = (ImGui::GetContentRegionAvail().x - 2.0F * space) / 3.0F;
  ImGui::BeginDisabled(!frame.settings->ball_present);
  if (rows_.button("Next method", width, "M: the same launch again with the next method; both paths stay"))
    commands.compare = Comparison::next_method;
  ImGui::SameLine();
  if (rows_.button("Half step", width,
                   "Shift+M: the same launch again with half the time step; once more: with the scene's"))
    commands.compare = Comparison::half_step;
  ImGui::EndDisabled();
  ImGui::SameLine();
  commands.back =
      rows_.button("Back", width, "B: back by a second of film, with the present settings; again: further");
  if (rows_.button("Measure terms", -1.0F,
                   "E: the cost of parcels, contacts, friction and Magnus per step, in the line above the "
                   "overlay. Small scenes measure it by themselves; in large ones the picture stops for a "
                   "moment."))
    switches.measure_terms = true;
  edit_look(switches);
  ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 4.5F);
  ImGui::InputTextWithHint("##file", "NAME.toml", scene_file_.data(), scene_file_.size());
  rows_.end_row("Scene file", "a new file; an existing one is not overwritten");
  ImGui::SameLine();
  ImGui::BeginDisabled(scene_file_[0] == '\0');
  if (rows_.button("Save", -1.0F, "write the current settings as a scene: --scene NAME.toml loads it"))
    commands.save_scene = scene_file_.data();
  ImGui::EndDisabled();
  if (cues_ != nullptr && cues_->size() == 0) cue_section_.edit(rows_, *cues_, cue_request_);
}

void Panel::edit_look(ViewSwitches& switches) {
  const float half = ImGui::GetCursorPosX() + 0.5F * ImGui::GetContentRegionAvail().x;
  // Ghosts are paths: switching them on shows paths.
  if (ImGui::Checkbox("Ghost paths (G)", &switches.look.ghosts) && switches.look.ghosts)
    switches.show_path = true;
  rows_.end_row("Ghosts", "the same launch in a vacuum and with drag in closed form, dashed");
  ImGui::SameLine(half);
  ImGui::Checkbox("Full screen (F11)", &switches.full_screen);
  rows_.end_row("Full screen", "F11");
  ImGui::Checkbox("Vertical sync (V)", &switches.vsync);
  rows_.end_row("Vsync", "frames wait for the screen; without it they come at the scene's frame rate");
  rows_.begin_row("Theme (D)", "colours of floor, panel and overlay");
  choose("##theme", kThemeNames, switches.look.theme, "Theme", rows_.controls());
  rows_.begin_row("Colours (C)",
                  "of the parcels' speed; lightness rises in each, also for colour-blind eyes");
  choose("##colours", kColorMapNames, switches.look.color_map, "Colours", rows_.controls());
  rows_.begin_row("Text size", "+ and -: text, panel and overlay. Takes effect when you let go.");
  double scale = rows_.held_or("Text size", switches.ui_scale);
  const bool moved = slide<double>("##scale", scale, {kMinUiScale, kMaxUiScale}, "%.2f");
  const auto number = rows_.take_finished("Text size", scale, moved, true, {kMinUiScale, kMaxUiScale});
  if (number) switches.ui_scale = *number;
  rows_.end_row("Text size", "+ and -");
  rows_.show_refusal("Text size");
}

// Every setting of the table, by its name in a scene file.
void Panel::edit_all() {
  ImGui::PushID("all");  // some settings also have a row above
  rows_.set_label_room(13.0F);
  std::string section;
  for (const Field& field : fields()) {
    if (std::holds_alternative<std::string Settings::*>(field.member)) continue;  // name and description
    if (field.section != section) ImGui::TextDisabled("[%s]", field.section.c_str());
    section = field.section;
    rows_.edit_field(field);
  }
  ImGui::PopID();
}

}  // namespace pf
