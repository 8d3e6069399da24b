// The last seconds of the scene, written by a key.
#include <fmt/format.h>

#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "view/stage_loop.hpp"

namespace pf {
namespace {

constexpr double kRead_s = 6.0;  // a line is shown

}  // namespace

// The scene without panel, overlay and bar, or all of the window.
void Stage::keep_last_seconds(const Viewport& viewport) {
  if (context_.window() == nullptr || !last_seconds_.is_on()) return;
  ScopedPhase timing(times_, Phase::encode);
  ViewRegion seen = {0.0, 0.0, static_cast<double>(size_.width), static_cast<double>(size_.height)};
  if (!options_.record_panel) {
    seen.left_px = place_of_overlay().left_px;
    seen.bottom_px = overlay_.used_height_px(shown_overlay(), scale_) + timeline_height_px();
    seen.width_px -= seen.left_px;
    seen.height_px -= seen.bottom_px;
  }
  try {
    last_seconds_.take(viewport.framebuffer, seen);
  } catch (const std::exception& error) {  // GL or memory: the run goes on
    last_seconds_.give_up();
    const std::string line = fmt::format("The last seconds are no longer kept: {}", reason_of(error));
    if (hooks_.announce) hooks_.announce(line);
    notice_.show(line, Clock::now(), kRead_s);
  }
}

// A film or a clip that cannot begin is a line on the screen; the run goes on.
void Stage::write_last_seconds() {
  const Clock::time_point now = Clock::now();
  if (!last_seconds_.is_on()) {
    last_seconds_.switch_on();
    return notice_.show(
        fmt::format("From now on the last {} s are kept; F10 again writes them", options_.clip_s), now,
        kRead_s);
  }
  if (last_seconds_.is_writing()) return notice_.show("The last seconds are still being written", now);
  const std::string base = fmt::format("{}_t{:.4f}s.{}", file_part(simulation_.settings().name),
                                       simulation_.view().simulated_s, options_.clip_format);
  try {
    last_seconds_.write(free_name(base));
  } catch (const std::exception& error) {
    notice_.show(reason_of(error), now, kRead_s);
  }
}

void Stage::follow_last_seconds(const InputFrame& input) {
  if (input.take_clip) write_last_seconds();
  const std::string news = last_seconds_.take_news();
  if (news.empty()) return;
  if (hooks_.announce) hooks_.announce(news);
  notice_.show(news, Clock::now(), kRead_s);
}

void Stage::finish_last_seconds() {
  last_seconds_.finish();
  const std::string news = last_seconds_.take_news();
  if (!news.empty() && hooks_.announce) hooks_.announce(news);
}

}  // namespace pf
