// Goes through a list of cues: which one is current, which one is asked for, and the commands that lead
// there. A cue restarts the simulation with its settings, so that a log of the run replays it.
#pragma once

#include <cstdint>

#include "app/simulation.hpp"
#include "scene/cue_list.hpp"

namespace pf {

class CuePlayer {
 public:
  static constexpr int kNone = -1;

  // attended: there is somebody to go on from a paused cue. Without, no cue is paused.
  explicit CuePlayer(bool attended) : attended_(attended) {}

  // Replaces the list. current: the cue that is already running, or kNone.
  void load(CueList list, int current);
  // The same list with other cues; nothing begins.
  void replace(CueList list, int current);
  const CueList& list() const { return list_; }
  int size() const { return static_cast<int>(list_.cues.size()); }
  int current() const { return current_; }
  const Cue* current_cue() const;
  // Marks a cue as current, or none, without going there.
  void mark(int index);

  // Asks for a cue, or for one so many places further than the last that was current; before any, the first.
  // False if there is no such cue.
  bool ask(int index);
  bool ask_next(int places);
  bool is_asked() const { return asked_ != kNone; }

  // Adds what the cue needs to the commands of this frame.
  void add_commands(Commands& commands, const FrameView& view);
  // After the commands: whether a cue has begun in this frame. One that was refused is forgotten.
  bool follow(const FrameView& view);

 private:
  bool attended_;
  CueList list_;
  int current_ = kNone;
  int last_ = kNone;  // that was current
  int asked_ = kNone;
  std::int64_t num_scenes_ = 0;  // when it was asked for
  bool is_sent_ = false;         // to the simulation
  bool begins_ = false;          // the first cue of a run begins without a command
  bool pause_is_due_ = false;    // in the frame after the restart, which would end a pause
};

}  // namespace pf
