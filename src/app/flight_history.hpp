// The current flight frame by frame, up to the latest time reached: what flies a part of it again, and what
// the timeline shows.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/settings.hpp"

namespace pf {

struct FlownFrame {
  double time_s = 0.0;          // simulated since the launch, at the frame's end
  std::uint32_t num_steps = 0;  // fewer than planned if an input ended the frame
  std::uint64_t num_ball_hits = 0;
};

// Settings from a frame on.
struct SettingsChange {
  std::int64_t frame = 0;
  Settings settings;
  std::string what;  // one line
};

class FlightHistory {
 public:
  // Starts the history at a launch, or when the air is spawned anew. time_s: since the launch.
  void begin(double time_s);
  // Goes on by a frame. In the past it is one that is known.
  void pass_frame(const FlownFrame& frame);
  // Changes the settings here. Forgets all that came later.
  void change(const Settings& from, const Settings& to);
  void go_to(std::int64_t frame, std::size_t num_changes);
  // The flight ends with the latest frame: the ball has left.
  void end() { has_ended_ = true; }
  bool has_ended() const { return has_ended_; }
  // Forgets all frames and changes after the present ones.
  void drop_future();

  std::int64_t position() const { return position_; }  // number of frames since the beginning
  std::int64_t latest() const { return static_cast<std::int64_t>(frames_.size()); }
  // There are frames, or changes, that were flown and come again.
  bool is_past() const { return position_ < latest() || num_changes_ < changes_.size(); }
  // Steps of the next frame, if it was flown already.
  const FlownFrame* next_frame() const;
  // The next change of the settings that is due here; null: none.
  const SettingsChange* next_change() const;
  void pass_change() { ++num_changes_; }
  // The settings after all changes that come from here to a later frame, that frame's own among them.
  const Settings& settings_at(std::int64_t frame, const Settings& here) const;
  std::size_t num_changes() const { return num_changes_; }

  double time_at(std::int64_t frame) const;
  // The last frame that ends by then.
  std::int64_t frame_at(double time_s) const;
  const std::vector<FlownFrame>& frames() const { return frames_; }
  const std::vector<SettingsChange>& changes() const { return changes_; }

 private:
  double begin_s_ = 0.0;
  bool has_ended_ = false;
  std::int64_t position_ = 0;
  std::size_t num_changes_ = 0;  // passed
  std::vector<FlownFrame> frames_;
  std::vector<SettingsChange> changes_;  // in the order in which they were made
};

}  // namespace pf
