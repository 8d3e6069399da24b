// The GPU's time between begin and end, read some frames later so that nothing waits.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "view/gl.hpp"

namespace pf {

// Takes two time stamps. A rasteriser on the CPU (llvmpipe) works tile by tile and stamps each tile, and the
// last stamp counts: there the first stamp is flushed before the drawing.
class GpuTimer {
 public:
  explicit GpuTimer(bool software) : flushes_(software) {
    glCreateQueries(GL_TIMESTAMP, static_cast<GLsizei>(begins_.size()), begins_.data());
    glCreateQueries(GL_TIMESTAMP, static_cast<GLsizei>(ends_.size()), ends_.data());
  }
  ~GpuTimer() {
    glDeleteQueries(static_cast<GLsizei>(begins_.size()), begins_.data());
    glDeleteQueries(static_cast<GLsizei>(ends_.size()), ends_.data());
  }
  GpuTimer(const GpuTimer&) = delete;
  GpuTimer& operator=(const GpuTimer&) = delete;

  void begin() {
    if (flushes_) glFlush();
    glQueryCounter(begins_[num_begun_ % kNumKept], GL_TIMESTAMP);
    if (flushes_) glFlush();
  }
  void end() {
    glQueryCounter(ends_[num_begun_ % kNumKept], GL_TIMESTAMP);
    ++num_begun_;
  }

  // Milliseconds of the newest measurement that has come back; NaN before the first.
  double newest_ms() {
    while (num_read_ < num_begun_) {
      const std::size_t place = num_read_ % kNumKept;
      GLint ready = GL_TRUE;
      // Waits for a measurement whose place is needed next.
      if (num_begun_ - num_read_ < kNumKept)
        glGetQueryObjectiv(ends_[place], GL_QUERY_RESULT_AVAILABLE, &ready);
      if (ready == GL_FALSE) break;
      GLuint64 begin_ns = 0;
      GLuint64 end_ns = 0;
      glGetQueryObjectui64v(begins_[place], GL_QUERY_RESULT, &begin_ns);
      glGetQueryObjectui64v(ends_[place], GL_QUERY_RESULT, &end_ns);
      newest_ms_ = end_ns > begin_ns ? 1e-6 * static_cast<double>(end_ns - begin_ns) : 0.0;
      ++num_read_;
    }
    return newest_ms_;
  }

 private:
  static constexpr std::size_t kNumKept = 4;
  bool flushes_;
  std::array<GLuint, kNumKept> begins_{};
  std::array<GLuint, kNumKept> ends_{};
  std::size_t num_begun_ = 0;
  std::size_t num_read_ = 0;
  double newest_ms_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace pf
