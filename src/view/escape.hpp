// Chooses what a press of Esc leaves: the nearest thing first, the program last and only when pressed twice.
#pragma once

namespace pf {

struct EscapeSituation {
  bool has_popup = false;  // a menu, a list or another popup is open
  bool aims = false;
  bool full_screen = false;
  bool asked = false;  // the line that asks for a second press is on the screen
};

enum class EscapeEffect { close_popup, stop_aiming, leave_full_screen, ask, quit };

constexpr EscapeEffect effect_of_escape(const EscapeSituation& now) {
  if (now.has_popup) return EscapeEffect::close_popup;
  if (now.aims) return EscapeEffect::stop_aiming;
  if (now.full_screen) return EscapeEffect::leave_full_screen;
  return now.asked ? EscapeEffect::quit : EscapeEffect::ask;
}

}  // namespace pf
