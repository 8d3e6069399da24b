// A GL context that draws to a window or to memory: two kinds behind one small interface.
#pragma once

#include <memory>
#include <string>

struct GLFWwindow;

namespace pf {

struct GlContextInfo {
  std::string renderer;   // GL_RENDERER
  std::string version;    // GL_VERSION
  std::string platform;   // "window", "egl device 0", "egl surfaceless"
  int cuda_device = -1;   // EGL_CUDA_DEVICE_NV of the device that draws; -1: unknown or none
  bool software = false;  // a CPU rasteriser draws
};

struct SizePx {
  int width = 0;
  int height = 0;
  bool operator==(const SizePx&) const = default;
};

class GlContext {
 public:
  virtual ~GlContext() = default;
  const GlContextInfo& info() const { return info_; }

  // The current size of the window's framebuffer, or the requested size.
  virtual SizePx size_px() const = 0;
  // Screen pixels per layout pixel.
  virtual float content_scale() const = 0;
  virtual void present() = 0;  // shows the back buffer; does nothing offscreen
  virtual void poll_events() = 0;
  virtual bool close_requested() const = 0;
  virtual GLFWwindow* window() const { return nullptr; }
  // Makes present() wait for the screen, or not. Does nothing offscreen.
  virtual void set_vsync(bool) {}
  // Fills the monitor that the window is on, or restores its place and size. Does nothing offscreen.
  virtual void set_full_screen(bool) {}

 protected:
  void read_info(const std::string& platform);  // after GL is loaded; throws DeviceError below GL 4.5
  GlContextInfo info_;
};

struct ContextRequest {
  int width_px = 1280;
  int height_px = 720;
  bool vsync = true;
  std::string title = "Pickleball Flight";
};

// Renderer and version of the current context by its glGetString: for contexts older than what glad loads.
std::string describe_gl(void (*get_string)());

// True if a window can be opened: DISPLAY or WAYLAND_DISPLAY is set and GLFW starts. GLFW ends with the
// program.
bool display_available();
// Why there is none: "the display DISPLAY=:7 cannot be opened".
std::string no_display_text();

// Both make the new context current. Without GL 4.5 they throw a DeviceError that names the GL found.
std::unique_ptr<GlContext> open_window(const ContextRequest& request);
std::unique_ptr<GlContext> open_offscreen(const ContextRequest& request);

}  // namespace pf
