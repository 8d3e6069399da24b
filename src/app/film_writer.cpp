#include "app/film_writer.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cerrno>
#include <cstring>

#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "core/timing.hpp"

namespace pf {

RawFrames::RawFrames(const std::filesystem::path& file, int width_px)
    : name_(file.string()),
      row_bytes_(4 * static_cast<std::size_t>(width_px)),
      stream_(std::fopen(file.c_str(), "wbe")) {
  constexpr std::size_t kBuffer = 1U << 20;  // collects many rows, which are written from last to first
  if (stream_) std::setvbuf(stream_.get(), nullptr, _IOFBF, kBuffer);
  if (stream_) return;
  throw UserError(fmt::format("--record: {} cannot be written: {}; choose another file", in_quotes(name_),
                              std::strerror(errno)));
}

void RawFrames::check(bool good) const {
  if (good) return;
  const int error = errno;
  remove_if_empty(name_);
  throw DeviceError(fmt::format("film {}: {}", in_quotes(name_), std::strerror(error)));
}

void RawFrames::add_frame(std::span<const std::uint8_t> rgba) {
  for (std::size_t end = rgba.size(); end > 0; end -= row_bytes_)
    check(std::fwrite(&rgba[end - row_bytes_], row_bytes_, 1, stream_.get()) == 1);
}

void RawFrames::finish() {
  if (stream_) check(std::fclose(stream_.release()) == 0);
}

FilmWriter::FilmWriter(std::unique_ptr<FrameSink> sink, std::size_t capacity)
    : sink_(std::move(sink)), capacity_(capacity), thread_([this] { work(); }) {}

FilmWriter::~FilmWriter() { close(); }

bool FilmWriter::add(HeldFrame frame, int num_times, WhenFull when_full) {
  std::unique_lock lock(mutex_);
  assert(!closed_ && num_times > 0);
  const auto has_room = [this] { return num_held_ < capacity_; };
  if (when_full == WhenFull::wait) changed_.wait(lock, [&] { return has_room() || !failure_.empty(); });
  if (!has_room() || !failure_.empty()) return false;
  waiting_.push_back({std::move(frame), num_times});
  ++num_held_;
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
      entry.frame = {};  // frees its memory before another frame is accepted
      lock.lock();
      --num_held_;
      changed_.notify_all();
    }
    lock.unlock();
    sink_->finish();
  } catch (const std::exception& error) {  // sink failed, or out of memory: the film ends, the run continues
    failure = reason_of(error);
  }
  const std::lock_guard lock(mutex_);
  failure_ = failure;
  waiting_.clear();
  done_ = true;
  changed_.notify_all();
}

void FilmWriter::write(const Entry& entry) {
  for (int k = 0; k < entry.num_times; ++k) {
    const Clock::time_point start = Clock::now();
    sink_->add_frame(entry.frame.rgba);
    const double ms = milliseconds_since(start);
    const std::lock_guard lock(mutex_);
    write_ms_ += ms;
    ++num_written_;
  }
}

double FilmWriter::write_ms() const {
  const std::lock_guard lock(mutex_);
  return write_ms_;
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
