#include "view/last_seconds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>
#include <thread>

#include "app/encoder.hpp"
#include "core/error.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

constexpr std::size_t kMaxHeldPictures = 1;  // a frame is copied at once

double seconds_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

std::vector<int> times_shown(const std::deque<ClipFrame>& frames, double rate_hz) {
  std::vector<int> times;
  std::int64_t num_shown = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const double until_s = seconds_between(frames.front().shown_at, frames[i].shown_at);
    const std::int64_t due = std::llround(until_s * rate_hz);
    times.push_back(static_cast<int>(std::max<std::int64_t>(due - num_shown, 0)));
    num_shown += times.back();
  }
  if (!frames.empty()) times.push_back(1);
  return times;
}

SizePx clip_size(SizePx source) {
  const double scale = std::min({1.0, static_cast<double>(LastSeconds::kMaxWidth_px) / source.width,
                                 static_cast<double>(LastSeconds::kMaxHeight_px) / source.height});
  const auto even = [&](int side) { return std::max(static_cast<int>(side * scale) & ~1, 2); };
  return {even(source.width), even(source.height)};
}

void LastSeconds::take(GLuint framebuffer, const ViewRegion& source) {
  const Clock::time_point now = Clock::now();
  if (!is_on_ || (next_ && now < *next_) || source.width_px < 1.0 || source.height_px < 1.0) return;
  const auto period =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / kRate_hz));
  next_ = std::max(next_.value_or(now) + period, now);
  if (!reader_) {
    size_ = clip_size({static_cast<int>(source.width_px), static_cast<int>(source.height_px)});
    reduced_.resize(size_.width, size_.height);
    reader_.emplace(size_, kMaxHeldPictures, [this](const HeldFrame& frame) { keep(frame); });
  }
  blit_fitting(framebuffer, source, reduced_);
  reading_.push_back(now);
  reader_->read(reduced_.framebuffer());
}

void LastSeconds::give_up() {
  is_on_ = false;
  reader_.reset();
  reading_.clear();
  frames_.clear();
}

void LastSeconds::keep(const HeldFrame& frame) {
  frames_.push_back({reading_.front(), std::make_shared<const std::vector<std::uint8_t>>(frame.rgba.begin(),
                                                                                         frame.rgba.end())});
  reading_.pop_front();
  while (seconds_between(frames_.front().shown_at, frames_.back().shown_at) > seconds_) frames_.pop_front();
}

void LastSeconds::write(const std::filesystem::path& file) {
  if (reader_) reader_->finish();
  if (frames_.empty()) throw UserError("F10: no picture is kept yet; press it again in a second");
  auto sink = std::make_unique<Encoder>(file, size_.width, size_.height, kRate_hz);
  file_ = file;
  writer_ = std::make_unique<FilmWriter>(std::move(sink), frames_.size() + 1);
  const std::vector<int> times = times_shown(frames_, kRate_hz);
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const auto& rgba = frames_[i].rgba;
    if (times[i] > 0) writer_->add({*rgba, rgba}, times[i], FilmWriter::WhenFull::wait);
  }
  writer_->close();
}

std::string LastSeconds::take_news() {
  if (!writer_ || !writer_->done()) return "";
  const std::string failure = writer_->failure();
  const double length_s = static_cast<double>(writer_->num_written()) / kRate_hz;
  writer_.reset();
  failed_ |= !failure.empty();
  if (!failure.empty()) return failure;
  std::error_code error;
  const auto bytes = static_cast<double>(std::filesystem::file_size(file_, error));
  return fmt::format("the last {:.1f} s: {} ({}x{}{})", length_s, in_quotes(file_.string()), size_.width,
                     size_.height, error ? "" : fmt::format(", {:.1f} MB", 1e-6 * bytes));
}

void LastSeconds::finish() {
  while (writer_ && !writer_->done()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
}

}  // namespace pf
