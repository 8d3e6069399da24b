// Films and pictures of the run. A film begins and ends at any frame and has a log beside it.
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
#include "view/large_picture.hpp"

namespace pf {

// The picture in the window; without a window, the one in memory.
struct SeenPicture {
  GLuint framebuffer = 0;
  SizePx size;
};

class Recorder {
 public:
  using Announce = std::function<void(const std::string&)>;

  // announce: receives messages for the person; may be null. log: written beside each film.
  Recorder(const Options& options, bool has_window, Announce announce, InputLog& log);

  // Size of the picture that is seen, from the current frame on. To be called first.
  void set_seen(SizePx seen) { seen_ = seen; }
  // Begins the film of --record. Throws UserError and DeviceError.
  void begin(Simulation& simulation);
  // Ends the current film, or begins another under a free name. Never throws: a film that cannot begin
  // becomes a notice.
  void toggle(Simulation& simulation);
  // Writes the current frame as a PNG under a free name, or its paths as SVG. Never throws.
  void request_picture();
  void request_paths() { paths_requested_ = true; }

  // Tells how to draw the current frame: wants_seen() if the seen picture must be in memory; scene() if the
  // film has a picture of its own.
  bool wants_seen() const;
  FilmScene* scene();  // null: none
  bool has_overlay() const { return options_.record_overlay; }
  bool is_recording() const { return running_.has_value(); }

  // Takes the frame. seen: in memory if wants_seen(). large: for a picture larger than that. is_whole: it
  // ends a frame of every flight.
  void take(const SeenPicture& seen, Simulation& simulation, const PictureScene& large, bool is_whole);
  // Ends the film and waits until all films are written; writes the picture of --picture or --still. A
  // picture that cannot be written is told.
  void finish(Simulation& simulation, const PictureScene& scene);

  // Lines for the window: the current film with its time, and news of films and pictures. Empty: none.
  std::string film_line() const;
  std::string news() const;
  bool failed() const;  // a film broke off, or a picture could not be written
  // The last film, null without one: file, log, frames, dropped, duplicated, surplus, encoder, width,
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
  // ending: png or svg.
  void take_requested(std::string_view ending, const SeenPicture& picture, const Simulation& simulation,
                      const PictureScene& scene);
  void keep(const SeenPicture& seen, const Simulation& simulation, const PictureScene& large);
  bool draws_pictures() const;
  Pixels draw_picture(const PictureScene& scene) const;
  // --picture, of the first flight, or --still.
  void write_last(const std::filesystem::path& file, bool is_first_flight, const Simulation& simulation,
                  const PictureScene& scene) const;
  PngTexts texts_of(const Simulation& simulation, double simulated_s) const;
  void write_picture(const std::filesystem::path& file, const Pixels& picture,
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
  bool picture_requested_ = false;
  bool paths_requested_ = false;
  SizePx seen_;
  std::unique_ptr<FilmScene> scene_;
  ColorTarget kept_;     // for --picture: of the first flight
  PngTexts kept_texts_;  // of what is kept for --picture
  double kept_s_ = 0.0;  // simulated time of kept_
  ColorTarget last_;     // for --still
  Pixels kept_large_;    // if pictures have a size of their own
  std::string kept_svg_;
  std::string last_news_;
  Clock::time_point news_since_;
};

}  // namespace pf
