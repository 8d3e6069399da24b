// The log of a run: its settings, and every input that changed something, with the number of its frame. The
// same inputs at the same frames give the same states, bit for bit and on every backend. A log therefore
// holds a whole flight in a few lines. Hashes of the state in it allow a check.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "app/simulation.hpp"

namespace pf {

class FlightPair;

// The part of a frame's input that concerns a second flight.
struct SecondInFrame {
  std::optional<std::vector<std::string>> split;  // Commands::split
  std::optional<std::uint32_t> max_steps;         // of its frame, which inputs have ended; none: all
  std::string hash;                               // of its state after the frame; empty: none
};

// Entry of a log for one frame. Several entries may have the same number. Frames count from 0.
struct LoggedFrame {
  std::int64_t number = 0;
  std::optional<Settings> restart;   // start anew with these settings: another scene, or another backend
  std::vector<std::string> edits;    // "section.key = value" of each setting that changed
  std::vector<std::string> presses;  // names of Commands that are on or off (command_switches)
  std::optional<BallLaunch> fly;
  Comparison compare = Comparison::none;
  std::optional<Method> method;  // after Comparison::next_method, which skips what a backend cannot fly
  double time_scale_factor = 1.0;
  std::optional<double> seek_s;            // Commands::seek_s
  std::optional<std::uint32_t> max_steps;  // of the frame, which inputs have ended; none: all
  std::string hash;                        // of the state after the frame; empty: none
  SecondInFrame second;
};

// Returns false if the file exists and is not a log: writing one would destroy it.
bool may_become_log(const std::filesystem::path& file);

struct RunLog {
  std::string version;  // of the program that wrote it
  std::string backend;
  Settings settings;           // at the start, with the number of parcels for that backend
  std::filesystem::path from;  // checkpoint or dump that the run went on from; empty: none
  std::optional<std::int64_t> from_frame;
  std::string from_hash;  // state hash there
  std::vector<LoggedFrame> frames;
};

// A setting as "section.key = value".
std::string edit_text(const Field& field, const Settings& settings);
// Applies each of these. Throws UserError that begins with where.
void apply_edits(const std::vector<std::string>& edits, Settings& settings, const std::string& where);

// Returns its keys as lines of a log.
std::string second_text(const SecondInFrame& second);
// Throws UserError that begins with where.
void check_split(const std::vector<std::string>& split, const std::string& where);

constexpr std::uintmax_t kMaxLogBytes = 64U << 20;  // two weeks of frames without input

// Throws UserError with file and line if the file is not a log.
RunLog read_log(const std::filesystem::path& file);

// The on/off members of Commands, with their names in a log.
struct CommandSwitch {
  const char* name;
  bool Commands::*member;
};
std::vector<CommandSwitch> command_switches();

// The state hash, as logs have it.
std::string hash_of(Simulation& simulation);

// In the order of Comparison.
const std::vector<std::string>& comparison_names();

// Writes the log to any number of files, which may be opened and closed at any frame. A file is complete
// after each frame, so that it is usable if the program dies.
class InputLog {
 public:
  static constexpr int kFramesPerHash = 60;  // about one a second

  // Before the first frame. from: the file, or the frame of it, that the run goes on from; empty: none.
  InputLog(Simulation& simulation, const std::string& backend, const std::filesystem::path& from = {},
           std::optional<std::int64_t> from_frame = {});

  // The pair whose first flight the log is of; initially null: there is no second one.
  void set_pair(FlightPair* pair) { pair_ = pair; }

  // Call before and after each picture, with the commands that the simulation admitted. Pictures that go on
  // with the steps of a frame belong to that frame.
  void begin_frame(const Commands& commands, Simulation& simulation);
  void end_frame(Simulation& simulation);

  // Starts a file with the whole log so far. Throws UserError if it cannot be written.
  void open(const std::filesystem::path& file);
  // Ends a file with the hash of the current state.
  void close(const std::filesystem::path& path, Simulation& simulation);
  void close_all(Simulation& simulation);
  // Returns, once, a message for the user if a file can no longer be written (full disk); otherwise "".
  std::string take_failure();
  // A file could not be written to its end.
  bool failed() const { return failed_; }

 private:
  struct File {
    std::filesystem::path path;
    std::ofstream stream;
    std::uintmax_t num_bytes = 0;  // of whole entries
  };

  void note_inputs(const Simulation& simulation);
  void note_second();
  std::string second_hash() const;
  void complete_frame(Simulation& simulation);
  void end_early(Simulation& simulation);
  void note(const LoggedFrame& frame);
  void write(File& file, const std::string& text);

  std::string text_;  // the whole log so far
  std::list<File> files_;
  std::string failure_;
  bool failed_ = false;
  std::int64_t num_frames_ = 0;
  std::int64_t last_hashed_ = -1;  // last frame with a hash in text_
  bool is_hash_due_ = false;
  bool is_second_hash_due_ = false;
  FlightPair* pair_ = nullptr;
  // State of the current frame.
  bool is_open_ = false;  // its steps were not all done in its last picture
  bool is_seek_ = false;  // a jump in time, which may take several pictures
  LoggedFrame frame_;
  Settings settings_before_;
  std::optional<Settings> asked_;
  std::int64_t num_scenes_before_ = 0;
  int num_fallbacks_before_ = 0;
};

}  // namespace pf
