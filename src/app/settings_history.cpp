#include "app/settings_history.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace pf {
namespace {

const char* effect_text(ChangeEffect effect) {
  switch (effect) {
    case ChangeEffect::new_air:
      return "; the air is spawned anew";
    case ChangeEffect::new_flight:
      return "; the flight starts again";
    default:
      return "";
  }
}

std::string line(const char* what, const Settings& from, const Settings& to, ChangeEffect effect) {
  if (effect == ChangeEffect::new_scene)
    return fmt::format("{}: scene {}; the flight starts again", what, to.name);
  return fmt::format("{}: {}{}", what, change_text(from, to), effect_text(effect));
}

}  // namespace

std::string change_text(const Settings& from, const Settings& to) {
  constexpr std::size_t kMaxNamed = 3;
  std::vector<std::string> names;
  std::string last;
  for (const Field& field : fields()) {
    if (is_same(field, from, to)) continue;
    names.push_back(field.path());
    last = short_value_text(field, to);
  }
  if (names.size() == 1) return fmt::format("{} is {}", names[0], last);
  if (names.size() <= kMaxNamed) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} settings", names.size());
}

void SettingsHistory::follow(const FrameView& view, int num_fallbacks, std::int64_t gesture, int cue) {
  const bool has_lost = num_fallbacks != std::exchange(num_fallbacks_, num_fallbacks);
  if (!known_ || has_lost) {  // the parcels that a failed device had may not fit now
    changes_.clear();
    num_done_ = 0;
    step_ = 0;
    known_ = *view.settings;
    scene_ = scene_.value_or(*known_);
    scene_->num_parcels = known_->num_parcels;
  }
  const Change change = change_to(view, gesture, cue);
  const bool is_jump = view.num_recalls != std::exchange(num_recalls_, view.num_recalls);
  if (is_jump && change.effect != ChangeEffect::new_scene) {  // back to settings that the flight had
    known_ = *view.settings;
    return;
  }
  if (!take_step(view, change)) {
    scene_ = change.scene_after;
    if (!(change.before == change.after)) note(change);
  }
  known_ = *view.settings;
  cue_ = cue;
}

// Returns what this frame changed, possibly nothing.
SettingsHistory::Change SettingsHistory::change_to(const FrameView& view, std::int64_t gesture, int cue) {
  const bool is_new_scene = view.num_scenes != std::exchange(num_scenes_, view.num_scenes);
  const bool is_new_flight = view.num_flights != std::exchange(num_flights_, view.num_flights);
  Change change{*known_, *view.settings, ChangeEffect::settings_alone, gesture, cue_, cue, *scene_, *scene_};
  if (is_new_scene) change.scene_after = *view.settings;
  if (differ(*known_, *view.settings, &Effects::parcels)) change.effect = ChangeEffect::new_air;
  if (is_new_flight) change.effect = ChangeEffect::new_flight;
  if (is_new_scene) change.effect = ChangeEffect::new_scene;
  return change;
}

// Returns whether the change is the one that a pending undo or redo asked for. This ends the pending step; so
// does a refusal.
bool SettingsHistory::take_step(const FrameView& view, const Change& now) {
  if (step_ == 0 || (now.before == now.after && view.waits_for_step)) return false;
  const bool is_undo = std::exchange(step_, 0) < 0;
  const Change& change = changes_[is_undo ? num_done_ - 1 : num_done_];
  if (!(now.after == expected_)) return false;
  num_done_ = is_undo ? num_done_ - 1 : num_done_ + 1;
  scene_ = is_undo ? change.scene_before : change.scene_after;
  if (change.effect == ChangeEffect::new_scene) arrived_cue_ = is_undo ? change.cue_before : change.cue_after;
  return true;
}

void SettingsHistory::note(const Change& change) {
  changes_.resize(num_done_);
  Change* last = changes_.empty() ? nullptr : &changes_.back();
  if (last != nullptr && last->gesture == change.gesture) {
    last->after = change.after;
    last->effect = std::max(last->effect, change.effect);
    last->cue_after = change.cue_after;
    last->scene_after = change.scene_after;
    if (last->before == last->after) changes_.pop_back();
  } else {
    changes_.push_back(change);
  }
  if (changes_.size() > kMaxChanges) changes_.erase(changes_.begin());
  num_done_ = changes_.size();
}

// A flight that a change ended cannot come back: it starts again with the settings that it had.
void SettingsHistory::add_commands(Commands& commands, const Settings& wanted, ChangeEffect effect) {
  if (effect == ChangeEffect::new_scene) {
    commands.restart = wanted;
    return;
  }
  commands.settings = wanted;
  commands.reset = commands.reset || effect == ChangeEffect::new_flight;
}

// Takes `change` back, or makes it again: what differs in it, since the flight may be at a moment with other
// settings. step: -1 or 1.
std::string SettingsHistory::go(int step, const Change& change, const FrameView& view, Commands& commands) {
  const Settings &from = step < 0 ? change.after : change.before,
                 &to = step < 0 ? change.before : change.after;
  expected_ = change.effect == ChangeEffect::new_scene ? to : *view.settings;
  for (const Field& field : fields()) {
    if (!is_same(field, from, to)) copy_field(field, to, expected_);
  }
  if (change.effect == ChangeEffect::settings_alone && expected_ == *view.settings)
    return fmt::format("At this moment of the flight it is so: {}", change_text(from, to));
  add_commands(commands, expected_, change.effect);
  step_ = step;
  return line(step < 0 ? "Undone" : "Redone", from, to, change.effect);
}

std::string SettingsHistory::undo(Commands& commands, const FrameView& view) {
  if (step_ < 0) return "";     // one is on its way
  if (view.asked != nullptr) {  // a change that still waits is the last one
    commands.settings = *view.settings;
    return line("Undone", *view.asked, *view.settings, ChangeEffect::settings_alone);
  }
  if (step_ != 0) return "";
  if (num_done_ == 0) return "Nothing to undo";
  return go(-1, changes_[num_done_ - 1], view, commands);
}

std::string SettingsHistory::redo(Commands& commands, const FrameView& view) {
  if (view.asked != nullptr || step_ != 0) return "";
  if (num_redoable() == 0) return "Nothing to redo";
  return go(1, changes_[num_done_], view, commands);
}

}  // namespace pf
