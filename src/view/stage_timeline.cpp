// The timeline, and what is dropped on the window.
#include <algorithm>

#include "app/dropped_file.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// With the overlay; in a film only if that has the panel.
float Stage::timeline_height_px() const {
  const bool has_place = context_.window() != nullptr || options_.record_panel;
  const bool is_shown = has_place && static_cast<OverlayMode>(switches_.overlay_mode) != OverlayMode::off;
  return is_shown ? TimelineBar::height_px(scale_) : 0.0F;
}

void Stage::follow_timeline(Commands& commands) {
  if (timeline_height_px() == 0.0F) return;
  OverlayPlace place = place_of_overlay();
  place.bottom_px -= overlay_.used_height_px(shown_overlay(), scale_);
  const TimelineWish wish =
      timeline_.edit(simulation_.view(), place, switches_.look.theme, panel_.controls());
  commands.hold = commands.hold || wish.holds;
  if (wish.seek_s) commands.seek_s = wish.seek_s;
}

void Stage::take_dropped(const std::vector<std::string>& files, Commands& commands) {
  if (files.empty()) return;
  const DropAnswer answer = answer_drop({files.begin(), files.end()});
  if (answer.line.empty()) notice_.show("", Clock::now());  // the answer to an earlier one
  if (!answer.scene.empty()) {
    commands.scene = answer.scene;
    switches_.fit_camera = true;
  }
  if (!answer.cues.empty()) load_cues(answer.cues);
  constexpr double kReadAndTyped_s = 10.0;
  if (!answer.line.empty()) notice_.show(answer.line, Clock::now(), kReadAndTyped_s);
}

}  // namespace pf
