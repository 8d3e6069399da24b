#include "view/film.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/encoder.hpp"
#include "app/frame_names.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"
#include "view/png_frames.hpp"

namespace pf {
namespace {

constexpr std::size_t kMaxHeld = 8;  // frames not yet written; 66 MB at 1080p

// yuv420p halves both sides of the picture.
SizePx even(SizePx size) { return {size.width & ~1, size.height & ~1}; }

}  // namespace

Film::Film(const FilmRequest& request, const std::function<void(const std::string&)>& announce)
    : real_time_(request.real_time) {
  figures_.file = request.file;
  figures_.size = even(request.size);
  figures_.rate_hz = request.rate_hz;
  std::unique_ptr<FrameSink> sink = make_sink(request, announce);
  figures_.encoder = sink->name();
  reader_.emplace(figures_.size, kMaxHeld, [this](HeldFrame frame) { hand_on(std::move(frame)); });
  writer_ = std::make_unique<FilmWriter>(std::move(sink), kMaxHeld);
}

std::unique_ptr<FrameSink> Film::make_sink(const FilmRequest& request,
                                           const std::function<void(const std::string&)>& announce) {
  const SizePx size = figures_.size;
  const bool is_raw = ending_of(request.file) == ".rgb" || request.file == kNullDevice;
  if (is_raw) return std::make_unique<RawFrames>(request.file, size.width);
  const bool wants_frames = is_frame_pattern(request.file);
  if (!wants_frames && ffmpeg_available())
    return std::make_unique<Encoder>(request.file, size.width, size.height, request.rate_hz);
  if (!wants_frames) figures_.file = frames_instead_of(request.file);
  if (!wants_frames && announce) {
    announce(fmt::format(
        "--record: no ffmpeg on the PATH to write {} with; its frames go to {} instead (a film of them: "
        "ffmpeg -framerate {} -i FRAMES FILM; to install it on Debian or Ubuntu: apt install ffmpeg)",
        in_quotes(request.file.string()), in_quotes(figures_.file.string()), request.rate_hz));
  }
  return std::make_unique<PngFrames>(figures_.file, size);
}

// Number of frames of the film that the current frame becomes.
int Film::times_due() {
  if (!real_time_) return 1;
  const Clock::time_point now = Clock::now();
  if (!start_) start_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - *start_).count();
  return static_cast<int>(static_cast<std::int64_t>(elapsed_s * figures_.rate_hz) + 1 - num_due_);
}

void Film::try_to(const std::function<void()>& action) {
  if (!failure_.empty()) return;
  try {
    action();
  } catch (const std::exception& error) {
    failure_ = reason_of(error);
  }
}

void Film::add_frame(GLuint framebuffer, SizePx size) {
  try_to([&] { read(framebuffer, size); });
}

void Film::read(GLuint framebuffer, SizePx size) {
  const int times = times_due();
  if (times <= 0) {
    ++figures_.num_surplus;
    return;
  }
  num_due_ += times;
  repeats_.push_back(times);
  if (even(size) == figures_.size) {
    reader_->read(framebuffer);
    return;
  }
  scaled_.resize(figures_.size.width, figures_.size.height);
  const ViewRegion whole = {0.0, 0.0, static_cast<double>(size.width), static_cast<double>(size.height)};
  blit_fitting(framebuffer, whole, scaled_);
  reader_->read(scaled_.framebuffer());
}

// In simulation time the run waits for the encoder. In real time it does not: the next frame that finds room
// also replaces those that found none, so that the film keeps the clock's pace.
void Film::hand_on(HeldFrame frame) {
  const int times = repeats_.front();
  repeats_.pop_front();
  using WhenFull = FilmWriter::WhenFull;
  if (writer_->add(std::move(frame), times, real_time_ ? WhenFull::refuse : WhenFull::wait)) {
    figures_.num_duplicated += times - 1;
    return;
  }
  ++figures_.num_dropped;
  num_due_ -= times;
}

void Film::close() {
  try_to([&] { reader_->finish(); });
  writer_->close();
}

FilmFigures Film::figures() const {
  FilmFigures figures = figures_;
  figures.num_frames = writer_->num_written();
  figures.num_dropped += writer_->num_lost();
  figures.write_ms = writer_->write_ms();
  figures.failure = failure();
  return figures;
}

}  // namespace pf
