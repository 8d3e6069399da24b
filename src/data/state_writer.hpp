// Queue of a run's states, written to a file on a thread of its own.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "app/run_state.hpp"

namespace pf {

// Destination of states: a dump or a checkpoint.
class StateSink {
 public:
  virtual ~StateSink() = default;
  // Throws UserError or DeviceError.
  virtual void write(const RunState& state) = 0;
  virtual void finish() = 0;  // throws as write
  virtual std::uint64_t num_bytes() const = 0;
  // Each state is a file of its own: one that fails keeps no later one from being written.
  virtual bool begins_anew() const { return false; }
  // Begun after the first one.
  virtual std::vector<std::filesystem::path> further_files() const { return {}; }
};

class StateWriter {
 public:
  enum class WhenFull { wait, drop };

  // capacity: largest number of held states, including the one being written.
  StateWriter(std::unique_ptr<StateSink> sink, std::size_t capacity);
  ~StateWriter();  // finishes
  StateWriter(const StateWriter&) = delete;
  StateWriter& operator=(const StateWriter&) = delete;

  // Returns whether there is room for a state; `wait` waits for it. Counts a drop if there is none. Returns
  // false if the sink has failed, unless it begins anew.
  bool has_room(WhenFull when_full);
  void add(std::shared_ptr<const RunState> state);
  // The state fails for this reason, and with it the sink, unless that begins anew.
  void fail(const std::string& reason);
  // Writes what is held and ends the file.
  void finish();

  struct Counts {
    std::int64_t num_written = 0, num_dropped = 0;
    double write_ms = 0.0;  // on the writer's own thread
    double wait_ms = 0.0;   // that the run has waited for it
    std::uint64_t num_bytes = 0;
  };
  Counts counts() const;
  // Reason why the sink failed, or the last state of one that begins anew, one line; empty if it has not.
  std::string failure() const;
  // Further files of the sink so far.
  std::vector<std::filesystem::path> further_files() const;

 private:
  void work();
  bool has_ended() const { return !failure_.empty() && !sink_->begins_anew(); }
  template <class Action>
  void try_to(const Action& action);

  std::unique_ptr<StateSink> sink_;
  std::size_t capacity_;
  mutable std::mutex mutex_;  // guards all members below except thread_
  std::condition_variable changed_;
  std::deque<std::shared_ptr<const RunState>> waiting_;
  std::size_t num_held_ = 0;
  Counts counts_;
  std::string failure_;
  std::vector<std::filesystem::path> further_files_;
  bool closed_ = false;
  std::jthread thread_;
};

}  // namespace pf
