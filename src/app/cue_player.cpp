#include "app/cue_player.hpp"

#include <utility>

namespace pf {

void CuePlayer::load(CueList list, int current) {
  list_ = std::move(list);
  current_ = last_ = current;
  asked_ = kNone;
  is_sent_ = false;
  begins_ = current != kNone;
  pause_is_due_ = begins_ && attended_ && current_cue()->paused;
}

void CuePlayer::replace(CueList list, int current) {
  load(std::move(list), current);
  begins_ = pause_is_due_ = false;
}

void CuePlayer::mark(int index) {
  current_ = index;
  if (index != kNone) last_ = index;
}

const Cue* CuePlayer::current_cue() const {
  return current_ == kNone ? nullptr : &list_.cues[static_cast<std::size_t>(current_)];
}

bool CuePlayer::ask(int index) {
  if (index < 0 || index >= size()) return false;
  asked_ = index;
  is_sent_ = false;
  return true;
}

bool CuePlayer::ask_next(int places) {
  const int from = asked_ != kNone ? asked_ : last_;
  return ask(from == kNone ? 0 : from + places);
}

void CuePlayer::add_commands(Commands& commands, const FrameView& view) {
  if (pause_is_due_ && !view.paused) commands.toggle_pause = true;
  pause_is_due_ = false;
  if (asked_ == kNone || is_sent_) return;
  commands.restart = list_.cues[static_cast<std::size_t>(asked_)].settings;
  commands.restart->threads = view.settings->threads;
  commands.restart->frame_rate_hz = view.settings->frame_rate_hz;
  num_scenes_ = view.num_scenes;
  is_sent_ = true;
}

bool CuePlayer::follow(const FrameView& view) {
  if (std::exchange(begins_, false)) return true;
  if (asked_ == kNone || !is_sent_) return false;
  const bool has_begun = view.num_scenes != num_scenes_;
  if (!has_begun && view.waits_for_step) return false;
  const int asked = std::exchange(asked_, kNone);
  if (!has_begun) return false;
  mark(asked);
  pause_is_due_ = attended_ && current_cue()->paused;
  return true;
}

}  // namespace pf
