// The command line as plain data.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/accuracy.hpp"
#include "app/input_log.hpp"
#include "app/run_state.hpp"
#include "scene/cue_list.hpp"
#include "scene/settings.hpp"

namespace pf {

enum class Command { run, bench, scenes, lab };

// Names of choices for the picture, in the order of the view's enumerations.
inline const std::vector<std::string> kThemeNames = {"dark", "light"};
inline const std::vector<std::string> kColorMapNames = {"viridis", "cividis", "grey"};
inline const std::vector<std::string> kOverlayNames = {"full", "compact", "off"};
inline const std::vector<std::string> kSplitViewNames = {"off", "two halves", "one picture"};
inline const std::vector<std::string> kClipFormats = {"gif", "webp"};
constexpr int kMaxClip_s = 15;
constexpr double kMinUiScale = 0.75;
constexpr double kMaxUiScale = 3.0;

// `lab STUDY`
struct LabOptions {
  std::string study;
  std::filesystem::path json;   // --json FILE, of validate
  std::filesystem::path out;    // --out DIR; default lab-STUDY
  std::string scene = "court";  // --scene, for the study of terms
  bool quick = false;
  bool resume = false;
  bool force = false;
};

// Files of states (option_data.hpp).
struct DataOptions {
  std::filesystem::path dump;  // --dump FILE.h5 or FILE.xyz; empty: none
  double dump_every_s = 0.0;   // simulated; 0: every frame
  std::vector<std::string> dump_fields;
  int dump_compression = 0;
  std::filesystem::path checkpoint;  // --checkpoint FILE; empty: none
  double checkpoint_every_s = 0.0;   // simulated; 0: at the end only
  std::filesystem::path from;        // --from FILE; empty: none
  std::optional<std::int64_t> from_frame;
  std::vector<std::string> from_edits;    // "section.key = value" of the command line
  std::shared_ptr<const RunState> start;  // read from `from`
};

struct Options {
  Command command = Command::run;
  Settings settings;                     // scene, then --set, then the flags
  std::optional<CueList> cues;           // --cues NAME; settings are then those of the first one
  AccuracyWish accuracy;                 // --accuracy, --of
  std::optional<AccuracyChoice> chosen;  // what --accuracy chose; set after the options are read
  bool show_path = false;                // -t
  bool cuda = false;                     // --cuda
  bool cuda_no_fallback = false;         // --cuda-no-fallback
  int domains = 0;                       // --domains K; 0: one for each process
  std::string domain_link = "auto";      // --domain-link auto|host|direct
  bool headless = false;
  bool show_panel = true;
  std::filesystem::path record;   // --record FILE.mp4, .mkv, .rgb or FOLDER/%05d.png; empty: none
  bool record_real_time = false;  // --record-time real|simulation
  int record_width_px = 0;        // --record-size WxH; 0: the window's
  int record_height_px = 0;
  bool record_panel = false;      // --record-panel
  bool record_overlay = true;     // --record-overlay on|off
  std::filesystem::path log;      // --log FILE.toml: inputs; a film always has a log
  std::optional<RunLog> replay;   // FILE.toml: log to replay
  std::optional<double> still_s;  // --still T FILE.png: simulated time
  std::filesystem::path still;
  std::filesystem::path report;      // --report FILE.json
  std::filesystem::path picture;     // --picture FILE.png: the last frame
  std::string draw_target = "auto";  // --draw-target auto|interop|staged|host|images
  std::filesystem::path panel_map;   // --panel-map FILE: positions of controls, for tests and scripts
  int picture_width_px = 0;          // --picture-size WxH; 0: the window's
  int picture_height_px = 0;
  bool picture_transparent = false;   // --picture-transparent
  int picture_tile_px = 0;            // --picture-tile N: largest side of a tile; 0: what GL draws at once
  bool follow = false;                // --follow: the camera keeps to the ball
  std::string magnifier;              // --magnifier; empty: as the scene says
  bool paused = false;                // --paused: the window waits for the space bar
  bool seconds_given = false;         // the command line sets run.seconds, which then ends a window, too
  bool vsync = true;                  // --no-vsync
  bool full_screen = false;           // --full-screen
  bool ghosts = false;                // --ghosts
  std::string theme = "dark";         // --theme
  std::string color_map = "viridis";  // --color-map
  std::string overlay = "full";       // --overlay
  double ui_scale = 1.0;              // --ui-scale: size of text and overlay, kMinUiScale to kMaxUiScale
  std::filesystem::path overlay_csv;  // --overlay-csv FILE: figures of the overlay, one line per frame
  std::filesystem::path profile_csv;  // --profile-csv FILE: the profile, one line per bin and frame
  std::filesystem::path save_scene;   // --save-scene FILE.toml: the settings before the run
  int clip_s = 5;                     // --clip N: length of what F10 writes
  bool keep_clip = false;  // it is kept from the start; else where a GPU draws, or from the first F10
  std::string clip_format = "gif";  // --clip-format
  int width_px = 1280;              // --size WxH
  int height_px = 720;
  int warmup_frames = 0;  // excluded from the means in the report
  // --split, --split-view: in what a second flight differs (empty: there is none), one of kSplitViewNames
  std::vector<std::string> split;
  std::string split_view = kSplitViewNames[1];
  // bench
  int bench_steps = 200;
  int bench_warmup = 20;
  int bench_repeats = 5;
  int bench_frames = 0;              // --frames N: time whole frames instead of steps
  bool bench_panel = false;          // --panel: include the panel
  bool bench_flight = false;         // --flight: time the frames of a whole flight instead
  std::filesystem::path bench_json;  // --json FILE
  bool sweep = false;                // --sweep: time whole frames over N instead
  std::int64_t sweep_max = 1'000'000;
  LabOptions lab;
  DataOptions data;
};

// The cues of --cues; empty: there is none.
std::span<const Cue> cues_of(const Options& options);

// Why a run with these options cannot have a second flight; empty: it can.
std::string obstacle_to_split(const Options& options);

struct ParseResult {
  std::optional<Options> options;  // none: print text and exit with exit_code
  std::string text;
  int exit_code = 0;
};

// Throws UserError for invalid input. Checks, before any work, that output files are writable.
ParseResult parse_options(int argc, const char* const* argv);

}  // namespace pf
