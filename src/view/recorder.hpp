// What leaves the screen: films, begun and ended at any frame, each with a log beside it; pictures.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/input_log.hpp"
#include "app/options.hpp"
#include "view/film.hpp"
#include "view/film_scene.hpp"

namespace pf {

// The picture in the window, or that in memory of a run without one.
struct SeenPicture {
  GLuint framebuffer = 0;
  SizePx size;
};

class Recorder {
 public:
  using Announce = std::function<void(const std::string&)>;

  // announce: told what a person should know; null: nobody. log: what a film has beside it.
  Recorder(const Options& options, bool has_window, Announce announce, InputLog& log);

  // Size of the picture that is seen, from the frame in hand on. Before all else.
  void set_seen(SizePx seen) { seen_ = seen; }
  // Begins the film of --record. Throws UserError and DeviceError.
  void begin(Simulation& simulation);
  // Ends the film in hand, or begins another with a name that is free. Never throws: a film that cannot be
  // begun is a notice.
  void toggle(Simulation& simulation);
  // The frame in hand becomes a PNG with a name of its own.
  void ask_picture() { picture_asked_ = true; }

  // How the frame in hand must be drawn: the film wants the picture that is seen, in memory; or one that is
  // drawn for it.
  bool wants_seen() const;
  FilmScene* scene();  // null: none is wanted
  bool has_overlay() const { return options_.record_overlay; }
  bool is_recording() const { return running_.has_value(); }

  // Takes the frame. seen: in memory if wants_seen().
  void take(const SeenPicture& seen, Simulation& simulation);
  // Ends the film and waits until all films are written; writes the picture of --picture or --still.
  void finish(Simulation& simulation);

  // One line to show in the window, or empty: what is being recorded, or what has just become of it.
  std::string notice() const;
  bool failed() const;  // a film could not be written to its end
  // The last film, null if there is none: file, log, frames, dropped, duplicated, surplus, encoder, width,
  // height, rate_hz, write_ms_per_frame (of encoder or sink, on their thread), failure (null: none), earlier:
  // the films before it.
  nlohmann::json report() const;

 private:
  struct Running {
    std::unique_ptr<Film> film;
    std::filesystem::path log;
    bool failure_told = false;
  };

  SizePx film_size() const;
  bool draws_itself() const;
  void start(const std::filesystem::path& file, Simulation& simulation);
  void end(Simulation& simulation);
  void follow(Simulation& simulation);
  void tell(const std::string& line);
  void keep(const SeenPicture& seen, const Simulation& simulation);
  void write_picture(const std::filesystem::path& file, const SeenPicture& picture,
                     const Simulation& simulation) const;
  std::filesystem::path free_film_name(const Simulation& simulation) const;

  const Options& options_;
  bool has_window_;
  Announce announce_;
  InputLog& log_;
  std::optional<Running> running_;
  std::vector<Running> ending_;
  std::vector<std::pair<FilmFigures, std::filesystem::path>> ended_;  // with the log of each
  bool failed_ = false;
  bool picture_asked_ = false;
  SizePx seen_;
  std::unique_ptr<FilmScene> scene_;
  ColorTarget kept_;  // for --picture and --still
  std::string last_news_;
  Clock::time_point news_since_;
};

}  // namespace pf
