// Frames of a film, taken at once and written on a thread of their own.
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

// A frame and what keeps its memory: it may be used again once the last keeper is gone.
struct HeldFrame {
  std::span<const std::uint8_t> rgba;  // height * width * 4 bytes, bottom row first (as GL reads it)
  std::shared_ptr<const void> keeper;
};

// Where frames go: an encoder, single files, one file as they are.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  // rgba: as in HeldFrame. Throws UserError or DeviceError.
  virtual void add_frame(std::span<const std::uint8_t> rgba) = 0;
  virtual void finish() = 0;             // throws as add_frame
  virtual std::string name() const = 0;  // for the report: "libx264", "png", ...
};

// Frames as they are, top row first, RGBA with 8 bits each: nothing is encoded, for measuring and for other
// programs. Throws UserError if the file cannot be opened, DeviceError if it cannot be written.
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

  // capacity: frames that are held at most, the one being written included.
  FilmWriter(std::unique_ptr<FrameSink> sink, std::size_t capacity);
  ~FilmWriter();  // as close, and waits
  FilmWriter(const FilmWriter&) = delete;
  FilmWriter& operator=(const FilmWriter&) = delete;

  // Holds a frame that is to stand num_times in the film until it is written; nothing is copied. Whether it
  // was taken: not if there is no room and nobody waits for it, or if the sink has failed.
  bool add(HeldFrame frame, int num_times, WhenFull when_full);
  void close();       // no frame follows; those taken are still written
  bool done() const;  // closed and all written, or failed: nothing is waited for any more

  // Frames that the sink has taken, repeats included.
  std::int64_t num_written() const;
  // Frames that were taken here but not by the sink, once it has failed.
  std::int64_t num_lost() const;
  // Time that the sink took for them, on the writer's own thread.
  double write_ms() const;
  // Why the sink stopped, one line; empty while it has not.
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
  mutable std::mutex mutex_;  // of all below but thread_
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
