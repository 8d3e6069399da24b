// The files of states that a run writes: its dump and its checkpoints.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "app/options.hpp"
#include "app/simulation.hpp"
#include "data/state_writer.hpp"

namespace pf {

// The part of a checkpoint that concerns the run around the simulation.
struct RunClock {
  Measures initial;
  std::int64_t num_frames = 0;
  std::int64_t frames_after_flight = 0;
};

// Throws UserError if the checkpoint, or the index of the dump, would replace what somebody else wrote.
void check_replaced(const DataOptions& options);

class RunFiles {
 public:
  using Announce = std::function<void(const std::string&)>;

  // may_drop: frames of a dump, and checkpoints but the last, are dropped if the writer is behind; otherwise
  // the run waits. announce: told of failures and losses, in one line each; may be empty.
  RunFiles(const DataOptions& options, bool may_drop, Announce announce);

  // Before the first frame and after each picture: writes what is due.
  void follow(const Simulation& simulation, const RunClock& clock);
  // Writes the last checkpoint and waits for all files.
  void finish(Simulation& simulation, const RunClock& clock);

  // A file could not be written.
  bool failed() const;
  // Keys dump, checkpoint, each null or {file, written, dropped, write_ms, wait_ms, save_ms,
  // bytes, failure, further_files}.
  nlohmann::json report() const;

 private:
  struct Target {
    std::string name;
    std::filesystem::path file;
    double every_s = 0.0;
    std::unique_ptr<StateWriter> writer;
    StateWriter::WhenFull when_full = StateWriter::WhenFull::wait;
    double last_interval = -1.0;
    std::uint64_t last_step = UINT64_MAX;
    std::string told{};    // failure that was announced
    bool is_kept = false;  // the file stays as it is
  };

  void note_beginning(const FrameView& view);
  bool is_due(const Target& target, const FrameView& view) const;
  void write(Target& target, const Simulation& simulation, const RunClock& clock);
  void keep_checkpoint(const Simulation& simulation);
  void tell_failure(Target& target, const char* outlook);
  std::shared_ptr<RunState> free_state();

  Announce announce_;
  std::vector<Target> targets_;
  std::vector<std::shared_ptr<RunState>> states_;  // used again once nobody else holds them
  std::shared_ptr<const RunState> last_;
  std::int64_t seen_scenes_ = 0;
  std::uint64_t seen_steps_ = 0;
  int seen_fallbacks_ = 0;
  double save_ms_ = 0.0;
};

}  // namespace pf
