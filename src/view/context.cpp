#include "view/context.hpp"

#include <fmt/format.h>
#include <glad/gl.h>
// After glad: GLFW must not bring its own GL header.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "core/error.hpp"

namespace pf {
namespace {

std::string gl_text(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text == nullptr ? "unknown" : reinterpret_cast<const char*>(text);
}

std::string glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text == nullptr ? "no reason given" : text;
}

// Renderer and version of the GL that a window gets here, for the message that it is not enough.
std::string gl_of_any_window() {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  GLFWwindow* window = glfwCreateWindow(16, 16, "", nullptr, nullptr);
  if (window == nullptr) return "no OpenGL at all";
  glfwMakeContextCurrent(window);
  const std::string found = describe_gl(glfwGetProcAddress("glGetString"));
  glfwDestroyWindow(window);
  return found;
}

class WindowContext final : public GlContext {
 public:
  explicit WindowContext(const ContextRequest& request) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    owner_.reset(
        glfwCreateWindow(request.width_px, request.height_px, request.title.c_str(), nullptr, nullptr));
    if (owner_ == nullptr) {
      const std::string reason = glfw_error();
      throw DeviceError(fmt::format(
          "no window with OpenGL 4.5: {}; found: {}; update the graphics driver or use --headless", reason,
          gl_of_any_window()));
    }
    glfwMakeContextCurrent(owner_.get());
    glfwSwapInterval(request.vsync ? 1 : 0);
    if (gladLoadGL(glfwGetProcAddress) == 0) throw DeviceError("the window's GL functions cannot be loaded");
    read_info("window");
    glfwSetWindowSizeLimits(owner_.get(), 480, 320, GLFW_DONT_CARE, GLFW_DONT_CARE);
  }

  SizePx size_px() const override {
    SizePx size;
    glfwGetFramebufferSize(window(), &size.width, &size.height);
    return size;
  }
  float content_scale() const override {
    float x = 1.0F;
    float y = 1.0F;
    glfwGetWindowContentScale(window(), &x, &y);
    return std::clamp(std::max(x, y), 1.0F, 4.0F);
  }
  void present() override { glfwSwapBuffers(window()); }
  void poll_events() override { glfwPollEvents(); }
  bool close_requested() const override { return glfwWindowShouldClose(window()) == GLFW_TRUE; }
  GLFWwindow* window() const override { return owner_.get(); }
  void set_vsync(bool on) override { glfwSwapInterval(on ? 1 : 0); }
  void set_full_screen(bool on) override {
    if (on == (glfwGetWindowMonitor(window()) != nullptr)) return;
    if (!on) {
      glfwSetWindowMonitor(window(), nullptr, place_.x, place_.y, place_.width, place_.height,
                           GLFW_DONT_CARE);
      return;
    }
    glfwGetWindowPos(window(), &place_.x, &place_.y);
    glfwGetWindowSize(window(), &place_.width, &place_.height);
    GLFWmonitor* monitor = monitor_of_window();
    const GLFWvidmode* mode = monitor == nullptr ? nullptr : glfwGetVideoMode(monitor);
    if (mode != nullptr)
      glfwSetWindowMonitor(window(), monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
  }

 private:
  struct Place {
    int x = 0, y = 0, width = 0, height = 0;
  };

  // The monitor that has the window's centre, else the first.
  GLFWmonitor* monitor_of_window() const {
    int num_monitors = 0;
    GLFWmonitor** monitors = glfwGetMonitors(&num_monitors);
    const int x = place_.x + place_.width / 2;
    const int y = place_.y + place_.height / 2;
    for (int i = 0; i < num_monitors; ++i) {
      Place area;
      glfwGetMonitorPos(monitors[i], &area.x, &area.y);
      const GLFWvidmode* mode = glfwGetVideoMode(monitors[i]);
      if (mode != nullptr && x >= area.x && x < area.x + mode->width && y >= area.y &&
          y < area.y + mode->height)
        return monitors[i];
    }
    return glfwGetPrimaryMonitor();
  }

  Place place_;  // before full screen
  std::unique_ptr<GLFWwindow, decltype(&glfwDestroyWindow)> owner_{nullptr, glfwDestroyWindow};
};

// GLFW 3.4 and later try Wayland first if the kind of session is not named, and libwayland complains if there
// is none.
void name_session() {
  const bool is_wayland =
      std::getenv("WAYLAND_DISPLAY") != nullptr || std::getenv("WAYLAND_SOCKET") != nullptr;
  if (!is_wayland && std::getenv("DISPLAY") != nullptr) ::setenv("XDG_SESSION_TYPE", "x11", 0);
}

// GLFW is started at most once and ended when the program ends.
bool glfw_started() {
  static const bool started = [] {
    name_session();
    if (glfwInit() != GLFW_TRUE) return false;
    std::atexit(glfwTerminate);
    return true;
  }();
  return started;
}

}  // namespace

std::string describe_gl(void (*get_string)()) {
  const auto get = reinterpret_cast<const GLubyte* (*)(GLenum)>(get_string);
  const GLubyte* renderer = get == nullptr ? nullptr : get(GL_RENDERER);
  const GLubyte* version = get == nullptr ? nullptr : get(GL_VERSION);
  if (renderer == nullptr || version == nullptr) return "an OpenGL that does not name itself";
  return fmt::format("{} with OpenGL {}", reinterpret_cast<const char*>(renderer),
                     reinterpret_cast<const char*>(version));
}

void GlContext::read_info(const std::string& platform) {
  info_.renderer = gl_text(GL_RENDERER);
  info_.version = gl_text(GL_VERSION);
  info_.platform = platform;
  for (const char* name : {"llvmpipe", "softpipe", "SWR", "SwiftShader"}) {
    if (info_.renderer.find(name) != std::string::npos) info_.software = true;
  }
  GLint major = 0;
  GLint minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  if (major * 10 + minor < 45) {
    throw DeviceError(
        fmt::format("OpenGL 4.5 is needed, but {} offers {} ({})", info_.renderer, info_.version, platform));
  }
}

bool display_available() {
  const char* x11 = std::getenv("DISPLAY");
  const char* wayland = std::getenv("WAYLAND_DISPLAY");
  const bool named = (x11 != nullptr && *x11 != '\0') || (wayland != nullptr && *wayland != '\0');
  return named && glfw_started();
}

std::string no_display_text() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"}) {
    const char* value = std::getenv(name);
    if (value != nullptr && *value != '\0')
      return fmt::format("the display {}={} cannot be opened", name, value);
  }
  return "no display (DISPLAY, WAYLAND_DISPLAY)";
}

std::unique_ptr<GlContext> open_window(const ContextRequest& request) {
  if (!display_available()) throw DeviceError(no_display_text() + "; use --headless");
  return std::make_unique<WindowContext>(request);
}

}  // namespace pf
