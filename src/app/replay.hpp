// Replays a logged flight: applies the inputs at their frames, and compares states with those of the log.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "app/input_log.hpp"

namespace pf {

class Replay {
 public:
  explicit Replay(RunLog log) : log_(std::move(log)) {}

  // All frames of the log were replayed.
  bool ended() const { return num_frames_ >= num_frames(); }
  std::int64_t num_frames() const;
  // Throws UserError if the run goes on from another state than the log's run did: its file was replaced.
  void check_start(Simulation& simulation) const;
  // Commands of the next frame.
  Commands commands(const Settings& current) const;
  // Compares the state after that frame with the log's, if it has one. second: null if there is none.
  void end_frame(Simulation& simulation, Simulation* second = nullptr);

  bool diverged() const { return !found_.empty(); }
  // One line: equal states, or the first frame with a different one.
  std::string summary() const;
  // Keys: frames (of the log), flown, checks (compared hashes), same (all were equal), first_divergence: null
  // or {frame, expected, found, last_same_frame (null: none)}.
  nlohmann::json report() const;

 private:
  void compare(const std::string& expected, Simulation* flight);

  RunLog log_;
  std::size_t next_ = 0;  // in log_.frames
  std::int64_t num_frames_ = 0;
  std::int64_t num_checks_ = 0;
  std::int64_t last_same_ = -1;
  // The first divergence.
  std::int64_t frame_ = 0;
  std::string expected_, found_;
};

}  // namespace pf
