#include "view/gl.hpp"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "core/error.hpp"
#include "core/program_files.hpp"

namespace pf {
namespace {

std::string read_shader(const std::string& file_name) {
  std::string looked_at;
  for (const std::filesystem::path& folder : program_folders("shaders", "PICKLEFLIGHT_SHADERS")) {
    std::ifstream file(folder / file_name, std::ios::binary);
    if (file) {
      std::ostringstream text;
      text << file.rdbuf();
      return text.str();
    }
    looked_at += (looked_at.empty() ? "" : ", ") + folder.string();
  }
  throw DeviceError(fmt::format(
      "shader {} not found in {}; set PICKLEFLIGHT_SHADERS to the folder that has it", file_name, looked_at));
}

// Shaders share one text, common.glsl, which goes in after the version line.
GLuint compile(GLenum stage, const std::string& file_name) {
  const std::string common = read_shader("common.glsl");
  const std::string source = read_shader(file_name);
  const char* parts[] = {"#version 450 core\n", common.c_str(), "#line 1\n", source.c_str()};
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, 4, parts, nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  char log[2048] = "";
  glGetShaderInfoLog(shader, sizeof(log), nullptr, log);
  glDeleteShader(shader);
  throw DeviceError(fmt::format("shader {} does not compile: {}", file_name, log));
}

void attach(const GlProgram& program, GLenum stage, const std::string& file_name) {
  const GLuint shader = compile(stage, file_name);
  glAttachShader(program.get(), shader);
  glDeleteShader(shader);  // lives on while it is attached
}

void link(const GlProgram& program, const std::string& name) {
  glLinkProgram(program.get());
  GLint linked = GL_FALSE;
  glGetProgramiv(program.get(), GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return;
  char log[2048] = "";
  glGetProgramInfoLog(program.get(), sizeof(log), nullptr, log);
  throw DeviceError(fmt::format("shader program {} does not link: {}", name, log));
}

}  // namespace

GlBuffer make_buffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  return GlBuffer(name);
}

GlVertexArray make_vertex_array() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return GlVertexArray(name);
}

GlProgram load_program(const std::string& name, const std::string& fragment) {
  GlProgram program(glCreateProgram());
  attach(program, GL_VERTEX_SHADER, name + ".vert");
  attach(program, GL_FRAGMENT_SHADER, (fragment.empty() ? name : fragment) + ".frag");
  link(program, name);
  return program;
}

GlProgram load_compute_program(const std::string& name) {
  GlProgram program(glCreateProgram());
  attach(program, GL_COMPUTE_SHADER, name + ".comp");
  link(program, name);
  return program;
}

void set_uniform(const GlProgram& program, const char* name, float value) {
  glProgramUniform1f(program.get(), glGetUniformLocation(program.get(), name), value);
}

void set_uniform(const GlProgram& program, const char* name, Vec2f value) {
  glProgramUniform2f(program.get(), glGetUniformLocation(program.get(), name), value.x, value.y);
}

void set_uniform(const GlProgram& program, const char* name, int value) {
  glProgramUniform1i(program.get(), glGetUniformLocation(program.get(), name), value);
}

void set_uniform(const GlProgram& program, const char* name, std::uint32_t value) {
  glProgramUniform1ui(program.get(), glGetUniformLocation(program.get(), name), value);
}

void GlFence::place() {
  clear();
  sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

void GlFence::wait() {
  if (sync_ == nullptr) return;
  constexpr GLuint64 kPatience_ns = 10'000'000'000;
  const GLenum state = glClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, kPatience_ns);
  clear();
  if (state == GL_TIMEOUT_EXPIRED)
    throw DeviceError("glClientWaitSync: the graphics device did not finish within 10 s");
  if (state == GL_WAIT_FAILED) throw DeviceError("glClientWaitSync failed: the graphics device may be lost");
}

void GlFence::clear() {
  if (sync_ != nullptr) glDeleteSync(sync_);
  sync_ = nullptr;
}

void ColorTarget::resize(int width_px, int height_px) {
  if (texture_ && width_px == width_px_ && height_px == height_px_) return;
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  texture_ = GlTexture(name);
  glTextureStorage2D(name, 1, GL_RGBA8, width_px, height_px);
  glCreateFramebuffers(1, &name);
  framebuffer_ = GlFramebuffer(name);
  glNamedFramebufferTexture(name, GL_COLOR_ATTACHMENT0, texture_.get(), 0);
  if (glCheckNamedFramebufferStatus(name, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    texture_ = GlTexture();
    framebuffer_ = GlFramebuffer();
    throw DeviceError(fmt::format("no drawable image of {} x {} px on this GL device", width_px, height_px));
  }
  width_px_ = width_px;
  height_px_ = height_px;
}

}  // namespace pf
