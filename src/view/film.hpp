// One film: reads frames back from GL and hands them to an encoder or to files.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "app/film_writer.hpp"
#include "core/timing.hpp"
#include "view/capture.hpp"

namespace pf {

struct FilmRequest {
  std::filesystem::path file;  // .mp4, .mkv, .rgb or FOLDER/%05d.png
  SizePx size;                 // odd sides lose a pixel
  double rate_hz = 60.0;
  bool real_time = false;  // a film frame per period of the clock; else one per drawn frame
};

struct FilmFigures {
  std::filesystem::path file;
  std::string encoder;
  SizePx size;
  double rate_hz = 0.0;
  std::int64_t num_frames = 0;      // taken by the encoder
  std::int64_t num_dropped = 0;     // drawn and due, but not taken: no room, or the encoder had ended
  std::int64_t num_duplicated = 0;  // real time: repeats, where no newer frame was drawn in time
  std::int64_t num_surplus = 0;     // real time: drawn before a new film frame was due
  double write_ms = 0.0;            // of the encoder or sink, for all frames, on its own thread
  std::string failure;              // reason for an early end; empty: none
};

class Film {
 public:
  // Without ffmpeg the frames go into a folder, and `announce` (if it is not null) gets the reason. Throws
  // UserError and DeviceError if the film cannot begin.
  Film(const FilmRequest& request, const std::function<void(const std::string&)>& announce);

  // Takes the frame in `framebuffer`. A frame of another size (the window was resized) is scaled into the
  // film. What fails, in GL or for lack of memory, ends the film alone: see failure().
  void add_frame(GLuint framebuffer, SizePx size);
  // Ends the film. Does not wait: writing goes on.
  void close();
  // True when all frames are written, or writing has failed.
  bool done() const { return writer_->done(); }
  std::string failure() const { return failure_.empty() ? writer_->failure() : failure_; }
  FilmFigures figures() const;
  const std::filesystem::path& file() const { return figures_.file; }
  SizePx size() const { return figures_.size; }

 private:
  std::unique_ptr<FrameSink> make_sink(const FilmRequest& request,
                                       const std::function<void(const std::string&)>& announce);
  int times_due();
  void read(GLuint framebuffer, SizePx size);
  void try_to(const std::function<void()>& action);
  void hand_on(HeldFrame frame);

  FilmFigures figures_;  // without those that the writer counts
  bool real_time_;
  std::string failure_;                // before the writer
  std::deque<int> repeats_;            // of the frames that are being read back
  std::optional<FrameReader> reader_;  // its memory outlives the writer, which reads it
  std::unique_ptr<FilmWriter> writer_;
  ColorTarget scaled_;
  // Real time.
  std::optional<Clock::time_point> start_;
  std::int64_t num_due_ = 0;  // film frames due by the clock and given
};

}  // namespace pf
