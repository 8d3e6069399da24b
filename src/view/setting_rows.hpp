// Rows of the panel that edit one setting each: label, widget, tooltip. Help, unit and allowed range come
// from the table of settings.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/settings.hpp"
#include "view/gui.hpp"

namespace pf {

// A slider's ends; typing (control and click) reaches the field's own.
struct SliderLook {
  double low = 0.0;
  double high = 1.0;
  const char* format = "%.3f";
  bool logarithmic = false;
  const char* at_zero = nullptr;  // shown in place of the number 0
  bool on_release = false;        // applied on release: the change spawns the air again, or costs as much
};

// A number that may be typed, ends included.
struct NumberRange {
  double low = 0.0;
  double high = 0.0;
  const char* unit = "";
  bool whole = false;  // others are refused
};

// The reason why a typed number is refused, with the range: "7 is not within 0 to 1"; or as not
// whole. Empty: it is not.
std::string refusal_of(double value, const NumberRange& range);

class SettingRows {
 public:
  using Paths = std::initializer_list<const char*>;  // of settings, as in a scene file

  // scene: what a control goes back to; null: not known yet.
  void begin_frame(const Settings& shown, const Settings* scene);

  Settings& edited() { return edited_; }
  bool changed() const { return changed_; }
  void mark_changed() { changed_ = true; }
  ControlMap& controls() { return controls_; }
  const ControlMap& controls() const { return controls_; }

  void slider(const char* label, const char* path, const SliderLook& look);
  // Several in one row: label and path of each.
  void checkboxes(std::initializer_list<std::pair<const char*, const char*>> boxes);
  void combo(const char* label, const char* path);
  // A choice that is no setting. id: ImGui's; current and the result are indices of names.
  int menu(const char* label, const std::string& help, const char* id, const std::vector<std::string>& names,
           int current, Paths paths = {});

  // Any setting but a text, by its key; a number is typed and counts when finished.
  void edit_field(const Field& field);

  // Shows no tooltips: something else lies over the picture.
  void hush(bool is_quiet) { is_quiet_ = is_quiet; }
  // Room for labels, in heights of the font.
  void set_label_room(float heights) { label_room_ = heights; }
  // For rows of another kind: label at the left with its tooltip, the next widget takes the rest. paths: the
  // settings of the row. The tooltips have the scene's value; a dot marks another one, and a click on the dot
  // or a double or right click on the label goes back.
  void begin_row(const char* label, const std::string& help, Paths paths = {});
  void end_row(const char* label, const std::string& help, Paths paths = {});
  // Returns the number to apply from the last widget, which shows value; none while it is held, typed in or
  // unchanged. A number out of range is refused: show_refusal(label) shows why below the row, over what comes
  // there, for some seconds, so that no row moves under the pointer.
  std::optional<double> take_finished(const char* label, double value, bool moved, bool on_release,
                                      const NumberRange& range);
  // Returns the value being edited, else the given one.
  double held_or(const char* label, double value) const { return held_label_ == label ? held_value_ : value; }
  void show_refusal(const char* label);
  bool button(const char* label, float width_px, const char* help);
  bool header(const char* label, bool open);

 private:
  // A slider of a whole or of a floating-point number. True if the value moved.
  static bool move(const Field& field, const SliderLook& look, double& value);
  bool differs(Paths paths) const;
  void show_help(const std::string& help, Paths paths) const;
  void offer_scene_value(const char* label, Paths paths, bool is_label);

  static constexpr float kLabelRoom = 9.8F;

  float label_room_ = kLabelRoom;
  Settings edited_;
  const Settings* scene_ = nullptr;
  bool changed_ = false;
  bool is_quiet_ = false;
  std::string held_label_;  // of a control whose value is not applied yet
  double held_value_ = 0.0;
  bool types_comma_ = false;   // in this frame
  bool has_comma_ = false;     // the number in hand, as typed
  std::string refused_label_;  // of the control whose number was refused last
  std::string refusal_;
  double refused_until_s_ = 0.0;  // ImGui's time
  ControlMap controls_;
};

// Meaning, unit and allowed values of a setting.
const std::string& help_of(const char* path);

// Shows a tooltip of the last widget to the right of its window, so that it covers no control; not while a
// control is in use.
void tooltip(const std::string& text);

}  // namespace pf
