// Time that the GPU spent between begin and end, read some frames later so that nothing waits.
#pragma once

#include <array>
#include <cstddef>

#include "view/gl.hpp"

namespace pf {

class GpuTimer {
 public:
  GpuTimer() { glCreateQueries(GL_TIME_ELAPSED, static_cast<GLsizei>(queries_.size()), queries_.data()); }
  ~GpuTimer() { glDeleteQueries(static_cast<GLsizei>(queries_.size()), queries_.data()); }
  GpuTimer(const GpuTimer&) = delete;
  GpuTimer& operator=(const GpuTimer&) = delete;

  void begin() { glBeginQuery(GL_TIME_ELAPSED, queries_[num_begun_ % queries_.size()]); }
  void end() {
    glEndQuery(GL_TIME_ELAPSED);
    ++num_begun_;
  }

  // Milliseconds of the newest measurement that has come back; 0 before the first.
  double newest_ms() {
    while (num_read_ < num_begun_) {
      const GLuint query = queries_[num_read_ % queries_.size()];
      GLint ready = GL_FALSE;
      // One that would be begun again next is waited for.
      if (num_begun_ - num_read_ < queries_.size())
        glGetQueryObjectiv(query, GL_QUERY_RESULT_AVAILABLE, &ready);
      else
        ready = GL_TRUE;
      if (ready == GL_FALSE) break;
      GLuint64 elapsed_ns = 0;
      glGetQueryObjectui64v(query, GL_QUERY_RESULT, &elapsed_ns);
      newest_ms_ = 1e-6 * static_cast<double>(elapsed_ns);
      ++num_read_;
    }
    return newest_ms_;
  }

 private:
  std::array<GLuint, 4> queries_{};
  std::size_t num_begun_ = 0;
  std::size_t num_read_ = 0;
  double newest_ms_ = 0.0;
};

}  // namespace pf
