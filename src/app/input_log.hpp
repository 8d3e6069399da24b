// The log of a run: its settings, and every input that changed something, with the number of its frame. The
// same inputs at the same frames give the same states, to the last bit and on every backend, so a log is a
// whole flight in a few lines; it holds hashes of the state to prove that.
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

// What a log says about one frame. Frames count from 0.
struct LoggedFrame {
  std::int64_t number = 0;
  std::optional<Settings> restart;   // these settings from their start: another scene, or another backend
  std::vector<std::string> edits;    // "section.key = value" of each setting that changed
  std::vector<std::string> presses;  // names of Commands that are on or off (command_switches)
  std::optional<BallLaunch> fly;
  Comparison compare = Comparison::none;
  double time_scale_factor = 1.0;
  std::string hash;  // of the state after the frame; empty: not taken
};

struct RunLog {
  std::string version;  // of the program that wrote it
  std::string backend;
  Settings settings;  // at the start, parcels counted for that backend
  std::vector<LoggedFrame> frames;
};

// Sets what each "section.key = value" says. Throws UserError that begins with where.
void apply_edits(const std::vector<std::string>& edits, Settings& settings, const std::string& where);

// Throws UserError with file and line for what is not a log.
RunLog read_log(const std::filesystem::path& file);

// The Commands that are on or off, by the names that a log has for them.
struct CommandSwitch {
  const char* name;
  bool Commands::*member;
};
std::vector<CommandSwitch> command_switches();

// Writes logs of the run at hand: to any number of files, begun and ended at any frame. What is in a file is
// complete after each frame, so that it serves if the program dies.
class InputLog {
 public:
  static constexpr int kFramesPerHash = 60;  // about one a second

  // Before the first frame.
  explicit InputLog(const Simulation& simulation, const std::string& backend);

  // Around each frame of the simulation.
  void begin_frame(const Commands& commands, const Simulation& simulation);
  void end_frame(Simulation& simulation);

  // Starts a file with all that has happened so far. Throws UserError if it cannot be written.
  void open(const std::filesystem::path& file);
  // Ends it with the present state.
  void close(const std::filesystem::path& file, Simulation& simulation);
  void close_all(Simulation& simulation);
  // Once for a file that can be written no more (a full disk): what to tell the person, else empty.
  std::string take_failure();

 private:
  struct File {
    std::filesystem::path path;
    std::ofstream stream;
  };

  void note(const LoggedFrame& frame);
  void write(File& file, const std::string& text);

  std::string text_;  // of the file that would hold everything so far
  std::list<File> files_;
  std::string failure_;
  std::int64_t num_frames_ = 0;
  std::int64_t last_hashed_ = -1;  // frame whose state stands in text_
  // Of the frame in hand.
  LoggedFrame frame_;
  Settings settings_before_;
  std::optional<Settings> asked_;
  std::int64_t num_scenes_before_ = 0;
  int num_fallbacks_before_ = 0;
};

}  // namespace pf
