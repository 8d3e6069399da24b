#include "app/film_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>

#include "core/error.hpp"
#include "core/text.hpp"

namespace pf {

RawFrames::RawFrames(const std::filesystem::path& file, int width_px)
    : name_(file.string()),
      row_bytes_(4 * static_cast<std::size_t>(width_px)),
      stream_(std::fopen(file.c_str(), "wbe")) {
  if (stream_) return;
  throw UserError(fmt::format("--record: {} cannot be written: {}; choose another file", in_quotes(name_),
                              std::strerror(errno)));
}

void RawFrames::check(bool good) const {
  if (!good) throw DeviceError(fmt::format("film {}: {}", in_quotes(name_), std::strerror(errno)));
}

void RawFrames::add_frame(std::span<const std::uint8_t> rgba) {
  for (std::size_t end = rgba.size(); end > 0; end -= row_bytes_)
    check(std::fwrite(&rgba[end - row_bytes_], row_bytes_, 1, stream_.get()) == 1);
}

void RawFrames::finish() { check(std::fflush(stream_.get()) == 0); }

FilmWriter::FilmWriter(std::unique_ptr<FrameSink> sink, std::size_t frame_bytes, std::size_t capacity)
    : sink_(std::move(sink)), capacity_(capacity) {
  // Before the first frame, so that a film takes its memory at the start or not at all.
  spare_.assign(capacity, std::vector<std::uint8_t>(frame_bytes));
  thread_ = std::jthread([this] { work(); });
}

FilmWriter::~FilmWriter() { close(); }

bool FilmWriter::add(std::span<const std::uint8_t> rgba, int num_times, WhenFull when_full) {
  std::unique_lock lock(mutex_);
  assert(!closed_ && num_times > 0);
  if (when_full == WhenFull::wait)
    changed_.wait(lock, [this] { return !spare_.empty() || !failure_.empty(); });
  if (spare_.empty() || !failure_.empty()) return false;
  Entry entry{std::move(spare_.back()), num_times};
  spare_.pop_back();
  lock.unlock();
  assert(rgba.size() == entry.rgba.size());
  std::copy(rgba.begin(), rgba.end(), entry.rgba.begin());
  lock.lock();
  waiting_.push_back(std::move(entry));
  num_taken_ += num_times;
  changed_.notify_all();
  return true;
}

void FilmWriter::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

void FilmWriter::work() {
  std::string failure;
  try {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
      if (waiting_.empty()) break;
      Entry entry = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      write(entry);
      lock.lock();
      spare_.push_back(std::move(entry.rgba));
      changed_.notify_all();
    }
    lock.unlock();
    sink_->finish();
  } catch (const std::exception& error) {  // of the sink, or no memory: the film ends, the run does not
    failure = error.what();
  }
  const std::lock_guard lock(mutex_);
  failure_ = failure;
  done_ = true;
  changed_.notify_all();
}

void FilmWriter::write(const Entry& entry) {
  for (int k = 0; k < entry.num_times; ++k) {
    sink_->add_frame(entry.rgba);
    const std::lock_guard lock(mutex_);
    ++num_written_;
  }
}

bool FilmWriter::done() const {
  const std::lock_guard lock(mutex_);
  return done_;
}

std::int64_t FilmWriter::num_written() const {
  const std::lock_guard lock(mutex_);
  return num_written_;
}

std::int64_t FilmWriter::num_lost() const {
  const std::lock_guard lock(mutex_);
  return failure_.empty() ? 0 : num_taken_ - num_written_;
}

std::string FilmWriter::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace pf
