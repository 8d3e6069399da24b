#include "view/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kNewsShown_s = 6.0;

// A name is free if no file that belongs to it exists.
bool is_free(const fs::path& film) {
  std::error_code ignored;
  if (is_frame_pattern(film)) {
    const fs::path folder = film.parent_path();
    const bool has_frames = folder.empty() ? fs::exists(frame_file(film, 0), ignored)
                                           : fs::exists(folder, ignored) && !fs::is_empty(folder, ignored);
    return !has_frames && !fs::exists(log_beside(film), ignored);
  }
  return !fs::exists(fs::symlink_status(film, ignored)) && !fs::exists(log_beside(film), ignored) &&
         !fs::exists(frames_instead_of(film).parent_path(), ignored);
}

json film_report(const FilmFigures& film, const fs::path& log) {
  return {{"file", film.file.string()},
          {"log", log.empty() ? json(nullptr) : json(log.string())},
          {"frames", film.num_frames},
          {"dropped", film.num_dropped},
          {"duplicated", film.num_duplicated},
          {"surplus", film.num_surplus},
          {"encoder", film.encoder},
          {"width", film.size.width},
          {"height", film.size.height},
          {"rate_hz", film.rate_hz},
          {"write_ms_per_frame",
           film.num_frames > 0 ? json(film.write_ms / static_cast<double>(film.num_frames)) : json(nullptr)},
          {"failure", film.failure.empty() ? json(nullptr) : json(film.failure)}};
}

std::string count_text(const FilmFigures& film) {
  return fmt::format("{} frame{}, {} dropped, {} doubled", film.num_frames, film.num_frames == 1 ? "" : "s",
                     film.num_dropped, film.num_duplicated);
}

}  // namespace

Recorder::Recorder(const Options& options, bool has_window, Announce announce, InputLog& log)
    : options_(options), has_window_(has_window), announce_(std::move(announce)), log_(log) {}

void Recorder::tell(const std::string& line) {
  if (announce_) announce_(line);
  last_news_ = line;
  news_since_ = Clock::now();
}

SizePx Recorder::film_size() const {
  if (running_) return running_->film->size();
  const bool chosen = options_.record_width_px > 0;
  return chosen ? SizePx{options_.record_width_px, options_.record_height_px} : seen_;
}

// A window shows panel and overlay as switched there, the film as the options say. Without a window the
// picture is the film, unless its size differs. The panel cannot be drawn twice.
bool Recorder::draws_itself() const {
  if (options_.record_panel) return false;
  const SizePx film = film_size();
  return has_window_ || (film.width & ~1) != (seen_.width & ~1) || (film.height & ~1) != (seen_.height & ~1);
}

fs::path Recorder::free_film_name(const Simulation& simulation) const {
  const fs::path base =
      options_.record.empty() ? fs::path(file_part(simulation.settings().name) + ".mp4") : options_.record;
  int number = 1;
  while (!is_free(numbered(base, number))) ++number;
  return numbered(base, number);
}

void Recorder::begin(Simulation& simulation) {
  if (!options_.record.empty()) start(options_.record, simulation);
}

void Recorder::start(const fs::path& file, Simulation& simulation) {
  const FilmRequest request = {file, film_size(), simulation.settings().frame_rate_hz,
                               options_.record_real_time};
  std::error_code ignored;
  const bool was_there = fs::exists(file, ignored);
  auto film = std::make_unique<Film>(request, announce_);
  // `bench` records to /dev/null, which has no place for a log beside it.
  const fs::path log = film->file() == kNullDevice ? fs::path() : log_beside(film->file());
  try {
    if (!log.empty()) log_.open(log);
  } catch (const UserError&) {
    const fs::path film_file = film->file();
    film.reset();
    if (was_there)
      remove_if_empty(film_file);
    else if (fs::is_regular_file(film_file, ignored))
      fs::remove(film_file, ignored);
    throw;
  }
  running_.emplace(Running{std::move(film), log, false});
  try {
    scene();  // here, where its lack ends the film alone, and not while the frame is drawn
  } catch (...) {
    end(simulation);  // follow() removes it
    throw;
  }
}

void Recorder::request_picture() {
  picture_requested_ = true;
  try {
    scene();
  } catch (const std::exception& error) {  // memory or GL: the run goes on
    picture_requested_ = false;
    tell(reason_of(error));
  }
}

void Recorder::toggle(Simulation& simulation) {
  if (running_) {
    end(simulation);
    return;
  }
  try {
    start(free_film_name(simulation), simulation);
    const FilmFigures film = running_->film->figures();
    tell(fmt::format("recording {} ({}x{}, {})", in_quotes(film.file.string()), film.size.width,
                     film.size.height, film.encoder));
  } catch (const std::exception& error) {  // a file, ffmpeg or memory: the run goes on
    tell(reason_of(error));
  }
}

void Recorder::end(Simulation& simulation) {
  running_->film->close();
  if (!running_->log.empty()) log_.close(running_->log, simulation);
  ending_.push_back(std::move(*running_));
  running_.reset();
}

// Reports films that are written to their end, and the current one if it has failed.
void Recorder::follow(Simulation& simulation) {
  if (running_ && !running_->film->failure().empty()) {
    tell(fmt::format("recording stopped, the run continues: {}", running_->film->failure()));
    running_->failure_told = true;
    end(simulation);
  }
  for (auto it = ending_.begin(); it != ending_.end();) {
    if (!it->film->done()) {
      ++it;
      continue;
    }
    const FilmFigures film = it->film->figures();
    const bool is_empty = film.failure.empty() && film.num_frames == 0;
    failed_ = failed_ || !film.failure.empty() || (is_empty && !has_window_);
    if (is_empty) {
      tell(fmt::format("film {}: no frame was drawn, so there is none", in_quotes(film.file.string())));
      std::error_code ignored;
      if (fs::is_regular_file(film.file, ignored)) fs::remove(film.file, ignored);
      if (!it->log.empty()) fs::remove(it->log, ignored);
      it = ending_.erase(it);
      continue;
    }
    const std::string end = film.failure.empty() ? "" : "; it broke off";
    const std::string reason = end.empty() || it->failure_told ? "" : ": " + film.failure;
    // The encoder takes more frames than a full disk does.
    const char* at_most = end.empty() ? "" : "at most ";
    tell(fmt::format("film {}: {}{}{}{}", in_quotes(film.file.string()), at_most, count_text(film), end,
                     reason));
    ended_.emplace_back(film, it->log);
    it = ending_.erase(it);
  }
  const std::string lost_log = log_.take_failure();
  if (!lost_log.empty()) tell(lost_log);
}

bool Recorder::wants_seen() const {
  if (!has_window_ || !options_.picture.empty()) return true;
  return (running_ || picture_requested_) && options_.record_panel;
}

FilmScene* Recorder::scene() {
  const bool is_wanted = (running_ || picture_requested_) && draws_itself();
  if (!is_wanted) return nullptr;
  const SizePx size = film_size();
  if (!scene_ || !(scene_->size() == size)) scene_ = std::make_unique<FilmScene>(size);
  return scene_.get();
}

void Recorder::take(const SeenPicture& seen, Simulation& simulation, const PictureScene& large,
                    bool is_whole) {
  const FilmScene* drawn = scene();
  const SeenPicture picture = drawn != nullptr ? SeenPicture{drawn->framebuffer(), drawn->size()} : seen;
  // In simulated time a film has a frame for each of the simulation, not for each picture of one.
  const bool is_due = options_.record_real_time || is_whole;
  if (running_ && is_due) running_->film->add_frame(picture.framebuffer, picture.size);
  if (std::exchange(picture_requested_, false)) take_requested("png", picture, simulation, large);
  if (std::exchange(paths_requested_, false)) take_requested("svg", picture, simulation, large);
  if (!options_.picture.empty() || options_.still_s) keep(seen, simulation, large);
  follow(simulation);
}

void Recorder::finish(Simulation& simulation, const PictureScene& scene) {
  if (running_) end(simulation);
  follow(simulation);
  while (!ending_.empty()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    follow(simulation);
  }
  if (scene.parcels == nullptr) return;  // nothing was drawn
  for (const auto& [file, is_first_flight] : {std::pair(options_.picture, true), {options_.still, false}}) {
    if (file.empty()) continue;
    try {
      write_last(file, is_first_flight, simulation, scene);
    } catch (const std::exception& error) {  // a file, memory or GL: the other outputs are finished
      failed_ = true;
      tell(reason_of(error));
    }
  }
}

std::string Recorder::film_line() const {
  if (!running_) return "";
  const FilmFigures film = running_->film->figures();
  const auto time_s = static_cast<std::int64_t>(static_cast<double>(film.num_frames) / film.rate_hz);
  std::string line = fmt::format("{}:{:02}  {}", time_s / 60, time_s % 60, film.file.filename().string());
  if (film.num_dropped > 0) line += fmt::format(", {} dropped", film.num_dropped);
  if (film.num_duplicated > 0) line += fmt::format(", {} doubled", film.num_duplicated);
  return line;
}

std::string Recorder::news() const {
  return !last_news_.empty() && milliseconds_since(news_since_) < 1e3 * kNewsShown_s ? last_news_ : "";
}

bool Recorder::failed() const { return failed_; }

json Recorder::report() const {
  if (ended_.empty()) return nullptr;
  json earlier = json::array();
  for (auto it = ended_.begin(); it != ended_.end() - 1; ++it)
    earlier.push_back(film_report(it->first, it->second));
  json last = film_report(ended_.back().first, ended_.back().second);
  last["earlier"] = std::move(earlier);
  return last;
}

}  // namespace pf
