// Title and sub-title of a cue, at the lower left of the picture if that is not where the ball starts, large
// and calm: they fade in, stay and go.
#pragma once

#include <optional>
#include <string>

#include "core/vec2.hpp"
#include "scene/cue_list.hpp"
#include "view/gui.hpp"
#include "view/overlay.hpp"
#include "view/px_rect.hpp"

namespace pf {

enum class TitleCorner { lower_left, lower_right, upper_left };

// The first corner of the place where a rectangle of a size keeps clear of another; lower_left if none does.
TitleCorner title_corner(Vec2f size_px, const OverlayPlace& place, const PxRect& keep_clear);

class CueTitle {
 public:
  void begin(const Cue& cue);
  void clear() { title_.clear(), subtitle_.clear(); }
  // Advances the time shown, by the window's clock or by a film's.
  void advance(double seconds) { shown_s_ += seconds; }

  // 0 to 1. 0: there is nothing to show.
  float opacity() const;
  const std::string& title() const { return title_; }

  // Describes it to ImGui, in the first corner of the place where it covers nothing of `keep_clear`: lower
  // left, lower right, upper left. It stays in the corner where it was first shown. Returns its rectangle,
  // an empty one if there is nothing to show.
  PxRect show(const OverlayPlace& place, Theme theme, const PxRect& keep_clear);

 private:
  std::string title_, subtitle_;
  double title_s_ = 0.0;  // 0: it stays
  double shown_s_ = 0.0;
  std::optional<TitleCorner> corner_;
};

}  // namespace pf
