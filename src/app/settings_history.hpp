// All changes of settings during a run, for undo and redo.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/simulation.hpp"

namespace pf {

// The effect of a change beyond the settings, the strongest last.
enum class ChangeEffect : std::uint8_t { settings_alone, new_air, new_flight, new_scene };

class SettingsHistory {
 public:
  static constexpr std::size_t kMaxChanges = 200;

  // After each frame's commands. gesture: the number of the press or key that they came from; the changes of
  // one gesture are one. cue: the current cue's place, which a change of scene comes back to.
  void follow(const FrameView& view, int num_fallbacks, std::int64_t gesture, int cue);

  // Adds the commands that undo or redo the last change. Returns a line that says so, or that there is
  // nothing; the line is the notice for the person.
  std::string undo(Commands& commands, const FrameView& view);
  std::string redo(Commands& commands, const FrameView& view);
  // The place of the cue that the last undo or redo led to, once it has taken effect.
  std::optional<int> take_cue() { return std::exchange(arrived_cue_, std::nullopt); }

  // The settings that the scene or cue began with; null before the first frame.
  const Settings* scene_settings() const { return scene_ ? &*scene_ : nullptr; }

  std::size_t num_undoable() const { return num_done_; }
  std::size_t num_redoable() const { return changes_.size() - num_done_; }

 private:
  struct Change {
    Settings before, after;
    ChangeEffect effect = ChangeEffect::settings_alone;
    std::int64_t gesture = 0;
    int cue_before = 0;
    int cue_after = 0;
    Settings scene_before, scene_after;  // as scene_settings()
  };

  Change change_to(const FrameView& view, std::int64_t gesture, int cue);
  bool take_step(const FrameView& view, const Change& now);
  void note(const Change& change);
  static void add_commands(Commands& commands, const Settings& wanted, ChangeEffect effect);
  std::string go(int step, const Change& change, const FrameView& view, Commands& commands);

  std::vector<Change> changes_;
  std::size_t num_done_ = 0;  // of changes_; those after it are taken back
  std::optional<Settings> known_, scene_;
  std::int64_t num_scenes_ = 0;
  std::int64_t num_flights_ = 0;
  std::int64_t num_recalls_ = 0;
  int num_fallbacks_ = 0;
  int cue_ = 0;
  int step_ = 0;       // -1: an undo, 1: a redo is on its way; 0: none
  Settings expected_;  // after it
  std::optional<int> arrived_cue_;
};

// The settings that differ, in words: "air.restitution is 0.9", or their names if there are several.
std::string change_text(const Settings& from, const Settings& to);

}  // namespace pf
