// The offscreen context: EGL without any window system.
#include <fmt/format.h>
#include <glad/egl.h>
#include <glad/gl.h>

#include <cstring>
#include <vector>

#include "core/error.hpp"
#include "view/context.hpp"

namespace pf {
namespace {

// One way to a display, in the order of preference.
struct Candidate {
  std::string platform;
  EGLenum kind = EGL_PLATFORM_SURFACELESS_MESA;
  EGLDeviceEXT device = nullptr;
  int cuda_device = -1;
};

bool has_extension(const char* list, const char* name) {
  if (list == nullptr) return false;
  const std::size_t length = std::strlen(name);
  for (const char* at = std::strstr(list, name); at != nullptr; at = std::strstr(at + length, name)) {
    if ((at == list || at[-1] == ' ') && (at[length] == ' ' || at[length] == '\0')) return true;
  }
  return false;
}

int cuda_device_of(EGLDeviceEXT device) {
  if (!has_extension(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_NV_device_cuda")) return -1;
  EGLAttrib value = -1;
  return eglQueryDeviceAttribEXT(device, EGL_CUDA_DEVICE_NV, &value) == EGL_TRUE ? static_cast<int>(value)
                                                                                 : -1;
}

std::vector<Candidate> list_devices(const char* client_extensions) {
  std::vector<Candidate> found;
  const bool devices_known = has_extension(client_extensions, "EGL_EXT_device_enumeration") ||
                             has_extension(client_extensions, "EGL_EXT_device_base");
  if (!devices_known || !has_extension(client_extensions, "EGL_EXT_platform_device")) return found;
  EGLint count = 0;
  if (eglQueryDevicesEXT(0, nullptr, &count) != EGL_TRUE || count <= 0) return found;
  std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
  eglQueryDevicesEXT(count, devices.data(), &count);
  for (EGLint i = 0; i < count; ++i) {
    const EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
    found.push_back(
        {fmt::format("egl device {}", i), EGL_PLATFORM_DEVICE_EXT, device, cuda_device_of(device)});
  }
  return found;
}

// NVIDIA devices, then Mesa surfaceless, then any others.
std::vector<Candidate> list_candidates() {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const std::vector<Candidate> devices = list_devices(client);
  std::vector<Candidate> ordered;
  for (const Candidate& c : devices) {
    if (c.cuda_device >= 0) ordered.push_back(c);
  }
  if (has_extension(client, "EGL_MESA_platform_surfaceless"))
    ordered.push_back({.platform = "egl surfaceless"});
  for (const Candidate& c : devices) {
    if (c.cuda_device < 0) ordered.push_back(c);
  }
  return ordered;
}

class OffscreenContext final : public GlContext {
 public:
  OffscreenContext(const ContextRequest& request, const Candidate& candidate)
      : size_{request.width_px, request.height_px} {
    try {
      open(candidate);
      read_info(candidate.platform);
    } catch (...) {
      close();
      throw;
    }
    info_.cuda_device = candidate.cuda_device;
  }
  ~OffscreenContext() override { close(); }
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  SizePx size_px() const override { return size_; }
  // Text keeps its share of the picture, so that a film of any size reads the same.
  float content_scale() const override {
    const float share =
        static_cast<float>(size_.width < size_.height * 16 / 9 ? size_.width * 9 / 16 : size_.height);
    return share > 720.0F ? share / 720.0F : 1.0F;
  }
  void present() override { glFlush(); }
  void poll_events() override {}
  bool close_requested() const override { return false; }

 private:
  void open(const Candidate& candidate) {
    display_ = eglGetPlatformDisplayEXT(candidate.kind, candidate.device, nullptr);
    EGLint major = 0;
    EGLint minor = 0;
    if (display_ == EGL_NO_DISPLAY || eglInitialize(display_, &major, &minor) != EGL_TRUE)
      fail("eglInitialize");
    gladLoaderLoadEGL(display_);
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) fail("eglBindAPI(EGL_OPENGL_API)");
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 4,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 5,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_NONE};
    context_ = eglCreateContext(display_, choose_config(), EGL_NO_CONTEXT, attributes);
    if (context_ == EGL_NO_CONTEXT) {
      const EGLint error = eglGetError();
      throw DeviceError(
          fmt::format("it has {} (eglCreateContext: EGL error 0x{:04x})", gl_of_any_context(), error));
    }
    // No surface at all: everything is drawn to framebuffer objects.
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE)
      fail("eglMakeCurrent");
    if (gladLoadGL(reinterpret_cast<GLADloadfunc>(eglGetProcAddress)) == 0) fail("loading the GL functions");
  }

  // Renderer and version of the GL found, for the message that it is not enough.
  std::string gl_of_any_context() {
    const EGLint attributes[] = {EGL_NONE};
    context_ = eglCreateContext(display_, choose_config(), EGL_NO_CONTEXT, attributes);
    const bool is_there = context_ != EGL_NO_CONTEXT &&
                          eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE;
    return is_there ? describe_gl(eglGetProcAddress("glGetString")) : "no OpenGL at all";
  }

  EGLConfig choose_config() const {
    const EGLint attributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                 EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(display_, attributes, &config, 1, &count) == EGL_TRUE && count > 0) return config;
    return nullptr;  // EGL_NO_CONFIG_KHR: a context without a surface needs none
  }

  [[noreturn]] static void fail(const char* call) {
    throw DeviceError(fmt::format("{} failed (EGL error 0x{:04x})", call, eglGetError()));
  }

  void close() {
    if (display_ == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
    eglTerminate(display_);
    display_ = EGL_NO_DISPLAY;
  }

  SizePx size_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::unique_ptr<GlContext> open_offscreen(const ContextRequest& request) {
  if (gladLoaderLoadEGL(EGL_NO_DISPLAY) == 0) {
    throw DeviceError("libEGL cannot be loaded; install libegl1 (Debian, Ubuntu) or open a window instead");
  }
  // The core eglGetPlatformDisplay is null before a display exists; the extension's name is not.
  if (eglGetPlatformDisplayEXT == nullptr) {
    throw DeviceError(
        "no OpenGL: libEGL finds no driver (it has no eglGetPlatformDisplayEXT); install the graphics driver "
        "or libegl-mesa0 (Debian, Ubuntu)");
  }
  std::string found;
  for (const Candidate& candidate : list_candidates()) {
    try {
      return std::make_unique<OffscreenContext>(request, candidate);
    } catch (const DeviceError& error) {
      found += fmt::format("{}{}: {}", found.empty() ? "" : "; ", candidate.platform, error.what());
    }
  }
  throw DeviceError("no OpenGL 4.5 without a display: " + (found.empty() ? "EGL names no device" : found) +
                    "; update the graphics driver");
}

}  // namespace pf
