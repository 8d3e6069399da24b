// All keys and mouse gestures on one card over the picture.
#pragma once

#include "view/gui.hpp"
#include "view/overlay.hpp"

namespace pf {

// Describes it to ImGui, in the middle of the place. controls: gets its rectangle.
void show_key_card(const OverlayPlace& place, ControlMap& controls);

}  // namespace pf
