#include "cuda/gl/gl_interop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "cuda/device_buffer.cuh"
#include "cuda/stream.hpp"
#include "view/gl.hpp"
#include "view/host_draw_target.hpp"
// After glad, which replaces GL/gl.h.
#include <cuda_gl_interop.h>

namespace pf {
namespace {

// At least 64: GL has no empty buffers.
std::size_t with_slack(std::size_t num_parcels) { return (num_parcels + num_parcels / 8 + 64) / 64 * 64; }

GlBuffer make_storage(std::size_t bytes, GLbitfield access) {
  GlBuffer buffer = make_buffer();
  glNamedBufferStorage(buffer.get(), static_cast<GLsizeiptr>(bytes), nullptr, access);
  GLint64 num_got = 0;
  glGetNamedBufferParameteri64v(buffer.get(), GL_BUFFER_SIZE, &num_got);
  if (num_got != static_cast<GLint64>(bytes))
    throw DeviceError(fmt::format("glNamedBufferStorage: no {} MiB of draw memory; choose fewer parcels (-p)",
                                  bytes >> 20));
  return buffer;
}

// Two GL buffers that are registered with CUDA. Both are mapped in one call; their addresses may change with
// each.
class InteropDrawTarget final : public GlDrawTarget {
 public:
  explicit InteropDrawTarget(std::string reason) : reason_(std::move(reason)) {}
  ~InteropDrawTarget() override { unregister(); }

  DrawTargetKind kind() const override { return DrawTargetKind::interop; }
  std::string reason() const override { return reason_; }

  void reserve(std::size_t num_parcels) override {
    if (num_parcels <= capacity_ && capacity_ > 0) return;
    unregister();
    capacity_ = 0;
    has_content_ = false;
    const std::size_t capacity = with_slack(num_parcels);
    position_ = make_storage(capacity * sizeof(Vec2f), 0);
    speed_ = make_storage(capacity * sizeof(float), 0);
    const unsigned flags = cudaGraphicsRegisterFlagsWriteDiscard;
    PF_CUDA(cudaGraphicsGLRegisterBuffer(&resources_[0], position_.get(), flags));
    PF_CUDA(cudaGraphicsGLRegisterBuffer(&resources_[1], speed_.get(), flags));
    capacity_ = capacity;
  }

  DrawBuffers map() override {
    glFlush();  // the stream will wait for GL's work, so that must have been submitted
    PF_CUDA(cudaGraphicsMapResources(2, resources_.data(), work_stream()));
    try {
      return {mapped<Vec2f>(resources_[0]), mapped<float>(resources_[1]), capacity_, true};
    } catch (...) {
      cudaGraphicsUnmapResources(2, resources_.data(), work_stream());
      throw;
    }
  }

  void unmap() override {
    PF_CUDA(cudaGraphicsUnmapResources(2, resources_.data(), work_stream()));
    has_content_ = true;
  }

  ParcelBuffers buffers(ParcelImages*) const override {
    if (!has_content_) return {};
    return {position_.get(), 0, speed_.get(), 0};
  }
  void frame_drawn() override {}  // mapping waits for GL on the device

 private:
  template <class T>
  static T* mapped(cudaGraphicsResource_t resource) {
    void* memory = nullptr;
    std::size_t bytes = 0;
    PF_CUDA(cudaGraphicsResourceGetMappedPointer(&memory, &bytes, resource));
    return static_cast<T*>(memory);
  }

  void unregister() {
    for (cudaGraphicsResource_t& resource : resources_) {
      if (resource != nullptr) cudaGraphicsUnregisterResource(resource);
      resource = nullptr;
    }
  }

  std::string reason_;
  GlBuffer position_, speed_;
  std::array<cudaGraphicsResource_t, 2> resources_{};
  std::size_t capacity_ = 0;
  bool has_content_ = false;
};

// Drawn values are copied from the device to page-locked host memory, and from there to GL.
class StagedDrawTarget final : public GlDrawTarget {
 public:
  explicit StagedDrawTarget(std::string reason) : reason_(std::move(reason)) {}

  DrawTargetKind kind() const override { return DrawTargetKind::staged; }
  std::string reason() const override { return reason_; }

  void reserve(std::size_t num_parcels) override {
    if (num_parcels <= capacity_ && capacity_ > 0) return;
    capacity_ = 0;
    has_content_ = false;
    const std::size_t capacity = with_slack(num_parcels);
    device_position_ = DeviceBuffer<Vec2f>(capacity);
    device_speed_ = DeviceBuffer<float>(capacity);
    staging_ = PinnedBuffer<std::byte>(capacity * (sizeof(Vec2f) + sizeof(float)));
    gl_ = make_storage(staging_.bytes(), GL_DYNAMIC_STORAGE_BIT);
    capacity_ = capacity;
  }

  DrawBuffers map() override { return {device_position_.data(), device_speed_.data(), capacity_, true}; }

  void unmap() override {
    const cudaStream_t stream = work_stream();
    const std::size_t positions = capacity_ * sizeof(Vec2f);
    PF_CUDA(
        cudaMemcpyAsync(staging_.data(), device_position_.data(), positions, cudaMemcpyDeviceToHost, stream));
    PF_CUDA(cudaMemcpyAsync(staging_.data() + positions, device_speed_.data(), capacity_ * sizeof(float),
                            cudaMemcpyDeviceToHost, stream));
    PF_CUDA(cudaStreamSynchronize(stream));
    glNamedBufferSubData(gl_.get(), 0, static_cast<GLsizeiptr>(staging_.bytes()), staging_.data());
    has_content_ = true;
  }

  ParcelBuffers buffers(ParcelImages*) const override {
    if (!has_content_) return {};
    return {gl_.get(), 0, gl_.get(), static_cast<GLintptr>(capacity_ * sizeof(Vec2f))};
  }
  void frame_drawn() override {}

 private:
  std::string reason_;
  DeviceBuffer<Vec2f> device_position_;
  DeviceBuffer<float> device_speed_;
  PinnedBuffer<std::byte> staging_;  // positions, then speeds
  GlBuffer gl_;
  std::size_t capacity_ = 0;
  bool has_content_ = false;
};

constexpr std::size_t kProbeParcels = 64;

// Throws DeviceError if the current GL context and the current CUDA device cannot share buffers.
void check_interop() {
  unsigned count = 0;
  std::array<int, 16> devices{};
  const cudaError_t result = cudaGLGetDevices(&count, devices.data(), devices.size(), cudaGLDeviceListAll);
  if (result != cudaSuccess || count == 0) {
    cudaGetLastError();
    throw DeviceError(std::string("GL runs on no CUDA device (") + cudaGetErrorString(result) + ")");
  }
  int current = 0;
  PF_CUDA(cudaGetDevice(&current));
  if (std::find(devices.begin(), devices.begin() + count, current) == devices.begin() + count)
    throw DeviceError("GL runs on another GPU");
  InteropDrawTarget("probe").reserve(kProbeParcels);
}

// The message of the DeviceError that check() throws, or empty.
template <class Check>
std::string obstacle_of(Check check) {
  try {
    check();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

int cuda_device_of_gl(int egl_cuda_device) {
  unsigned count = 0;
  std::array<int, 16> devices{};
  if (cudaGLGetDevices(&count, devices.data(), devices.size(), cudaGLDeviceListAll) == cudaSuccess &&
      count > 0) {
    return devices[0];
  }
  cudaGetLastError();
  return egl_cuda_device < 0 ? 0 : egl_cuda_device;
}

std::unique_ptr<GlDrawTarget> make_cuda_draw_target(const std::string& kind) {
  if (kind == "host") return std::make_unique<HostDrawTarget>("asked for");
  if (kind == "staged") return std::make_unique<StagedDrawTarget>("asked for");
  const std::string no_interop = obstacle_of([] { check_interop(); });
  if (no_interop.empty()) {
    return std::make_unique<InteropDrawTarget>(kind == "interop" ? "asked for" : "GL and CUDA share the GPU");
  }
  if (kind == "interop") throw DeviceError("--draw-target interop: " + no_interop + "; try auto or staged");
  const std::string no_staging = obstacle_of([] { StagedDrawTarget("probe").reserve(kProbeParcels); });
  if (no_staging.empty()) return std::make_unique<StagedDrawTarget>(no_interop);
  return std::make_unique<HostDrawTarget>(no_interop + "; " + no_staging);
}

}  // namespace pf
