// Rows of the panel that edit one setting each: label, widget, tooltip. Text, unit and range come from the
// table of settings.
#pragma once

#include <initializer_list>
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
  bool on_release = false;  // applied when the person lets go: what spawns the air anew, or costs as much
};

class SettingRows {
 public:
  void begin_frame(const Settings& shown);

  Settings& edited() { return edited_; }
  bool changed() const { return changed_; }
  void mark_changed() { changed_ = true; }
  ControlMap& controls() { return controls_; }
  const ControlMap& controls() const { return controls_; }

  void slider(const char* label, const char* path, const SliderLook& look);
  // Beside each other in one row: label and path of each.
  void checkboxes(std::initializer_list<std::pair<const char*, const char*>> boxes);
  void combo(const char* label, const char* path);
  // Names to choose from that are no setting; id as ImGui wants it, present and result: places in names.
  int menu(const char* label, const std::string& help, const char* id, const std::vector<std::string>& names,
           int present);

  // Any setting but a text, by its key; a number is typed and counts when finished.
  void any(const Field& field);

  // For rows of another kind: label at the left with its tooltip, the next widget takes the rest.
  void begin_row(const char* label, const std::string& help);
  void end_row(const char* label, const std::string& help);
  bool button(const char* label, float width_px, const char* help);
  bool header(const char* label, bool open);

 private:
  // What a whole-number or a floating-point slider has in common. Returns whether the value moved.
  static bool move(const Field& field, const SliderLook& look, double& value);

  Settings edited_;
  bool changed_ = false;
  std::string held_path_;  // the slider in hand whose value is not applied yet, and that value
  double held_value_ = 0.0;
  ControlMap controls_;
};

// Meaning, unit and allowed values of a setting, as the scene file has them.
const std::string& help_of(const char* path);

// For the widget made last.
void tooltip(const std::string& text);

}  // namespace pf
