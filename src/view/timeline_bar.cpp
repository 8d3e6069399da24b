#include "view/timeline_bar.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "view/overlay_paint.hpp"
#include "view/px_rect.hpp"

namespace pf {
namespace {

constexpr float kTextRoom_px = 92.0F;  // layout pixels, at either end
constexpr float kHits_px = 13.0F;      // height of the most hits
constexpr float kTrack_px = 5.0F;

// The bar in screen pixels.
struct Track {
  const FlightHistory& history;
  OverlayPlace place;
  const OverlayColors& colors;
  ImDrawList* list;
  double begin_s, span_s;
  float left, right, middle;

  float x_of(double time_s) const {
    const double share = std::clamp((time_s - begin_s) / span_s, 0.0, 1.0);
    return left + static_cast<float>(share) * (right - left);
  }
  double time_of(float x) const {
    return begin_s + static_cast<double>((x - left) / (right - left)) * span_s;
  }
  double latest_s() const { return history.time_at(history.latest()); }
  double now_s() const { return history.time_at(history.position()); }
  float px(float layout_px) const { return layout_px * place.scale; }
};

Track track_of(const FrameView& frame, const OverlayPlace& place, Theme theme) {
  const FlightHistory& history = *frame.history;
  const float bottom = place.bottom_px;
  const double begin_s = history.time_at(0);
  // Beside a narrow scene the bar is short rather than a time cut.
  const float text = text_width(fmt::format("to {:.3f} s", history.time_at(history.latest())));
  const float room = std::max(std::min(kTextRoom_px * place.scale, 0.25F * place.width_px),
                              std::min(text + 16.0F * place.scale, 0.4F * place.width_px));
  const double flown_s = history.time_at(history.latest()) - begin_s;
  return {history,
          place,
          overlay_colors(theme),
          ImGui::GetWindowDrawList(),
          begin_s,
          timeline_span_s(flown_s, history.has_ended()),
          place.left_px + room,
          place.left_px + place.width_px - room,
          bottom - 11.0F * place.scale};
}

// Hits of the ball in each column of pixels, relative to the column with the most. Of a very long flight a
// sample of the frames is counted.
void paint_hits(const Track& track) {
  constexpr std::size_t kMaxFrames = 20'000;
  const float width = std::max(track.px(2.0F), 2.0F);
  const auto num = static_cast<std::size_t>(std::max((track.right - track.left) / width, 1.0F));
  std::vector<double> hits(num, 0.0);
  const std::vector<FlownFrame>& frames = track.history.frames();
  const std::size_t stride = 1 + frames.size() / kMaxFrames;
  for (std::size_t i = 0; i < frames.size(); i += stride) {
    const float share = (track.x_of(frames[i].time_s) - track.left) / (track.right - track.left);
    hits[std::min(static_cast<std::size_t>(share * static_cast<float>(num)), num - 1)] +=
        static_cast<double>(frames[i].num_ball_hits);
  }
  const double largest = *std::max_element(hits.begin(), hits.end());
  const float foot = track.middle - track.px(0.5F * kTrack_px + 1.0F);
  for (std::size_t i = 0; i < num && largest > 0.0; ++i) {
    if (hits[i] == 0.0) continue;
    const float x = track.left + static_cast<float>(i) * width;
    const auto height = static_cast<float>(hits[i] / largest) * track.px(kHits_px);
    track.list->AddRectFilled(ImVec2(x, foot - std::max(height, 1.0F)), ImVec2(x + width - 1.0F, foot),
                              track.colors.dim);
  }
}

void paint_track(const Track& track) {
  const float half = track.px(0.5F * kTrack_px);
  const auto fill = [&](double from_s, double to_s, ImU32 color) {
    track.list->AddRectFilled(ImVec2(track.x_of(from_s), track.middle - half),
                              ImVec2(track.x_of(to_s), track.middle + half), color, half);
  };
  fill(track.begin_s, track.begin_s + track.span_s, track.colors.plot);
  fill(track.begin_s, track.latest_s(), track.colors.edge);
  fill(track.begin_s, track.now_s(), track.colors.accent);
}

// Kept checkpoints below the bar, changes of settings on it, and where the ball left.
void paint_checkpoints(const Track& track, const FrameView& frame) {
  const float half = track.px(0.5F * kTrack_px);
  for (const double kept_s : frame.kept_s) {
    const float x = track.x_of(kept_s);
    track.list->AddRectFilled(ImVec2(x - track.px(0.75F), track.middle + half + track.px(1.0F)),
                              ImVec2(x + track.px(0.75F), track.middle + half + track.px(5.0F)),
                              track.colors.text);
  }
  for (const SettingsChange& change : track.history.changes()) {
    const ImVec2 at(track.x_of(track.history.time_at(change.frame)), track.middle);
    track.list->AddNgonFilled(at, track.px(5.5F), track.colors.ground, 4);
    track.list->AddNgonFilled(at, track.px(4.0F), track.colors.warning, 4);
  }
  if (!track.history.has_ended()) return;
  const float x = track.x_of(track.latest_s());
  track.list->AddRectFilled(ImVec2(x - track.px(1.0F), track.middle - track.px(9.0F)),
                            ImVec2(x + track.px(1.0F), track.middle + half), track.colors.text);
}

// Marks the ends of the flights that this one is compared with.
void paint_compared(const Track& track, const FrameView& frame, Theme theme) {
  for (const FlightRecord& old : *frame.old_flights) {
    if (old.launch != frame.flight_record->launch || old.time_s() > track.begin_s + track.span_s) continue;
    const float x = track.x_of(old.time_s());
    const ImU32 color = packed(flight_color(theme, old));
    track.list->AddLine(ImVec2(x, track.middle - track.px(9.0F)), ImVec2(x, track.middle + track.px(3.0F)),
                        color, track.px(2.0F));
    track.list->AddText(ImGui::GetFont(), reduced(0.8F) * ImGui::GetFontSize(),
                        ImVec2(x + track.px(2.0F), track.middle - track.px(17.0F)), color,
                        fmt::format("{}", old.number).c_str());
  }
}

void paint_head(const Track& track, const FrameView& frame) {
  const ImVec2 now(track.x_of(track.now_s()), track.middle);
  track.list->AddCircleFilled(now, track.px(7.0F), track.colors.ground);
  track.list->AddCircleFilled(now, track.px(5.5F), track.colors.accent);
  if (!frame.sought_s) return;
  track.list->AddCircle(ImVec2(track.x_of(*frame.sought_s), track.middle), track.px(6.0F), track.colors.text,
                        0, track.px(1.5F));
}

// At either end, in smaller letters where the room is narrow. Returns the place of the present time.
PxRect paint_times(const Track& track, const FrameView& frame) {
  const std::string now = fmt::format("{:.3f} s", track.now_s());
  const std::string end = frame.sought_s            ? fmt::format("to {:.3f} s", *frame.sought_s)
                          : track.history.is_past() ? fmt::format("of {:.3f} s", track.latest_s())
                                                    : "";
  const float room = track.left - track.place.left_px - track.px(11.0F);
  const auto paint = [&](float x, float size, ImU32 color, const std::string& text) {
    const float height = size * ImGui::GetFontSize();
    const float y = track.middle - 0.6F * height;
    track.list->AddText(ImGui::GetFont(), height, ImVec2(x, y), color, text.c_str());
    return PxRect{x, y, x + text_width(text, size), y + height};
  };
  paint(track.right + track.px(10.0F), fitting_size(end, room), track.colors.dim, end);
  const float size = fitting_size(now, room);
  return paint(track.left - track.px(10.0F) - text_width(now, size), size, track.colors.text, now);
}

void explain(const Track& track, const FrameView& frame) {
  const double time_s = std::clamp(track.time_of(ImGui::GetIO().MousePos.x), track.begin_s, track.latest_s());
  std::string text = fmt::format("{:.3f} s of the flight; drag to go there", time_s);
  if (frame.kept_s.empty()) text = "no moment of this flight is kept yet: let it run, or give fewer parcels";
  for (const SettingsChange& change : track.history.changes()) {
    const float away = track.x_of(track.history.time_at(change.frame)) - ImGui::GetIO().MousePos.x;
    if (std::fabs(away) < track.px(6.0F)) text += "\nhere: " + change.what;
  }
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding,
                      ImVec2(track.px(8.0F), track.px(8.0F)));  // the bar has none
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(std::min(40.0F * ImGui::GetFontSize(), 0.9F * ImGui::GetIO().DisplaySize.x));
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
  ImGui::PopStyleVar();
}

}  // namespace

double timeline_span_s(double flown_s, bool has_ended) {
  constexpr double kShortest_s = 0.01;
  constexpr double kGrowth = 1.25;
  if (has_ended && flown_s > 0.0) return flown_s;
  const double steps = std::ceil(std::log(std::max(flown_s / kShortest_s, 1.0)) / std::log(kGrowth) - 1e-9);
  return kShortest_s * std::pow(kGrowth, steps);
}

TimelineWish TimelineBar::drag(const FrameView& frame, std::int64_t to_frame) {
  TimelineWish wish = {std::nullopt, true};
  const std::int64_t before = dragged_to_.value_or(frame.history->position());
  if (to_frame != before || (!dragged_to_ && frame.sought_s)) wish.seek_s = frame.history->time_at(to_frame);
  dragged_to_ = to_frame;
  return wish;
}

TimelineWish TimelineBar::edit(const FrameView& frame, const OverlayPlace& place, Theme theme,
                               ControlMap& controls) {
  TimelineWish wish;
  const float height = height_px(place.scale);
  ImGui::SetNextWindowPos(ImVec2(place.left_px, place.bottom_px - height));
  ImGui::SetNextWindowSize(ImVec2(place.width_px, height));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0F, 0.0F));
  ImGui::PushStyleColor(ImGuiCol_WindowBg, overlay_colors(theme).ground);
  ImGui::Begin("timeline", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoBringToFrontOnFocus);
  const Track track = track_of(frame, place, theme);
  ImGui::InvisibleButton("bar", ImVec2(place.width_px, height));
  const bool can_seek = !frame.kept_s.empty();
  wish.holds = can_seek && ImGui::IsItemActive();
  if (ImGui::IsItemHovered() && !wish.holds) explain(track, frame);
  if (wish.holds) {
    const double wanted_s = track.time_of(ImGui::GetIO().MousePos.x);
    wish =
        drag(frame, wanted_s >= track.latest_s() ? track.history.latest() : track.history.frame_at(wanted_s));
  } else {
    dragged_to_.reset();
  }
  paint_hits(track);
  paint_track(track);
  paint_checkpoints(track, frame);
  if (frame.old_flights != nullptr) paint_compared(track, frame, theme);
  paint_head(track, frame);
  const PxRect time = paint_times(track, frame);
  ImGui::End();
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  const float head = track.x_of(track.now_s());
  controls.note("Timeline",
                {track.left, track.middle - 2.0F, track.x_of(track.latest_s()), track.middle + 2.0F});
  controls.note("Timeline head", {head - 2.0F, track.middle - 2.0F, head + 2.0F, track.middle + 2.0F});
  if (frame.paused || track.history.is_past())
    controls.note(fmt::format("Time {:.4f} s", track.now_s()), {time.x0, time.y0, time.x1, time.y1});
  return wish;
}

}  // namespace pf
