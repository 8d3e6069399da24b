// Queue of a film's frames, written on a separate thread.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>

namespace pf {

// A frame with the owner of its memory. The memory may be reused once the last owner is gone.
struct HeldFrame {
  std::span<const std::uint8_t> rgba;  // height * width * 4 bytes, bottom row first (as GL reads it)
  std::shared_ptr<const void> keeper;
};

// Destination of frames: an encoder, single files, or one raw file.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  // rgba: as in HeldFrame. Throws UserError or DeviceError.
  virtual void add_frame(std::span<const std::uint8_t> rgba) = 0;
  virtual void finish() = 0;             // throws as add_frame
  virtual std::string name() const = 0;  // for the report: "libx264", "png", ...
};

// Raw frames, top row first, RGBA with 8 bits each, for measurements and other programs. Throws UserError if
// the file cannot be opened, and DeviceError if it cannot be written.
class RawFrames final : public FrameSink {
 public:
  RawFrames(const std::filesystem::path& file, int width_px);
  void add_frame(std::span<const std::uint8_t> rgba) override;
  void finish() override;
  std::string name() const override { return "raw"; }

 private:
  void check(bool good) const;

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string name_;
  std::size_t row_bytes_;
  std::unique_ptr<std::FILE, Close> stream_;
};

class FilmWriter {
 public:
  enum class WhenFull { wait, refuse };

  // capacity: maximum number of held frames, including the one being written.
  FilmWriter(std::unique_ptr<FrameSink> sink, std::size_t capacity);
  ~FilmWriter();  // closes and waits
  FilmWriter(const FilmWriter&) = delete;
  FilmWriter& operator=(const FilmWriter&) = delete;

  // Holds a frame, without a copy, until it is written num_times. Returns false if the sink has failed, or if
  // there is no room and when_full is refuse.
  bool add(HeldFrame frame, int num_times, WhenFull when_full);
  void close();       // no frame follows; held frames are still written
  bool done() const;  // closed and all written, or failed

  // Frames written by the sink, repeats included.
  std::int64_t num_written() const;
  // Accepted frames that were not written, once the sink has failed.
  std::int64_t num_lost() const;
  // Time of the sink's calls, on the writer's own thread.
  double write_ms() const;
  // Reason why the sink failed, one line; empty if it has not.
  std::string failure() const;

 private:
  struct Entry {
    HeldFrame frame;
    int num_times = 1;
  };

  void work();
  void write(const Entry& entry);

  std::unique_ptr<FrameSink> sink_;
  std::size_t capacity_;
  mutable std::mutex mutex_;  // guards all members below except thread_
  std::condition_variable changed_;
  std::deque<Entry> waiting_;
  std::size_t num_held_ = 0;  // waiting, or being written
  std::int64_t num_taken_ = 0;
  std::int64_t num_written_ = 0;
  double write_ms_ = 0.0;
  std::string failure_;
  bool closed_ = false;
  bool done_ = false;
  std::jthread thread_;
};

}  // namespace pf
