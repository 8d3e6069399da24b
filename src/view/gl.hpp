// GL 4.5 core through glad, and owners of GL names. Each needs the context that made it to be current.
#pragma once

#include <glad/gl.h>

#include <cstdint>
#include <string>
#include <utility>

#include "core/vec2.hpp"

namespace pf {

// A GL object name that is deleted with its owner; move-only; 0 means none.
template <void (*kDelete)(GLuint)>
class GlName {
 public:
  GlName() = default;
  explicit GlName(GLuint name) : name_(name) {}
  ~GlName() { reset(); }
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    if (this != &other) {
      reset();
      name_ = std::exchange(other.name_, 0);
    }
    return *this;
  }

  GLuint get() const { return name_; }
  explicit operator bool() const { return name_ != 0; }
  void reset() {
    if (name_ != 0) kDelete(name_);
    name_ = 0;
  }

 private:
  GLuint name_ = 0;
};

namespace detail {
inline void delete_buffer(GLuint name) { glDeleteBuffers(1, &name); }
inline void delete_vertex_array(GLuint name) { glDeleteVertexArrays(1, &name); }
inline void delete_texture(GLuint name) { glDeleteTextures(1, &name); }
inline void delete_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
inline void delete_program(GLuint name) { glDeleteProgram(name); }
}  // namespace detail

using GlBuffer = GlName<detail::delete_buffer>;
using GlVertexArray = GlName<detail::delete_vertex_array>;
using GlTexture = GlName<detail::delete_texture>;
using GlFramebuffer = GlName<detail::delete_framebuffer>;
using GlProgram = GlName<detail::delete_program>;

GlBuffer make_buffer();
GlVertexArray make_vertex_array();

// Compiles and links shaders/<name>.vert and shaders/<fragment or name>.frag. The folder is the first that
// has them: $PICKLEFLIGHT_SHADERS, then those of core/program_files.hpp. Throws DeviceError with the
// compiler's log.
GlProgram load_program(const std::string& name, const std::string& fragment = "");
// The same for shaders/<name>.comp alone.
GlProgram load_compute_program(const std::string& name);

void set_uniform(const GlProgram& program, const char* name, float value);
void set_uniform(const GlProgram& program, const char* name, Vec2f value);
void set_uniform(const GlProgram& program, const char* name, int value);
void set_uniform(const GlProgram& program, const char* name, std::uint32_t value);

// A fence that holds until the GPU has passed the point where it was placed.
class GlFence {
 public:
  GlFence() = default;
  ~GlFence() { clear(); }
  GlFence(const GlFence&) = delete;
  GlFence& operator=(const GlFence&) = delete;

  void place();
  bool placed() const { return sync_ != nullptr; }
  // Returns at once if none is placed; the fence is gone afterwards. Throws DeviceError on a lost device.
  void wait();

 private:
  void clear();
  GLsync sync_ = nullptr;
};

// An offscreen RGBA8 colour image that can be drawn to.
class ColorTarget {
 public:
  // Keeps the content if the size is the same; else it is undefined.
  void resize(int width_px, int height_px);

  GLuint framebuffer() const { return framebuffer_.get(); }
  GLuint texture() const { return texture_.get(); }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  int width_px_ = 0;
  int height_px_ = 0;
};

}  // namespace pf
