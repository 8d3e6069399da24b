#include "view/host_draw_target.hpp"

#include <fmt/format.h>

#include "core/error.hpp"

namespace pf {

void HostDrawTarget::reserve(std::size_t num_parcels) {
  if (num_parcels <= capacity_ && buffer_) return;
  const std::size_t wanted = num_parcels + num_parcels / 2;
  capacity_ = (wanted / 64 + 1) * 64;
  has_content_ = false;
  const GLbitfield access = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const auto bytes = static_cast<GLsizeiptr>(kNumRegions * region_bytes());
  buffer_ = make_buffer();
  glNamedBufferStorage(buffer_.get(), bytes, nullptr, access);
  memory_ = static_cast<std::byte*>(glMapNamedBufferRange(buffer_.get(), 0, bytes, access));
  if (memory_ == nullptr) {
    buffer_.reset();
    throw DeviceError(
        fmt::format("glMapNamedBufferRange: no {} MiB of draw memory for {} parcels; choose fewer (-p)",
                    bytes >> 20, num_parcels));
  }
}

DrawBuffers HostDrawTarget::map() {
  mapped_ = (written_ + 1) % kNumRegions;
  fences_[mapped_].wait();
  std::byte* region = memory_ + mapped_ * region_bytes();
  DrawBuffers out;
  out.position_m = reinterpret_cast<Vec2f*>(region);
  out.speed_mps = reinterpret_cast<float*>(region + capacity_ * sizeof(Vec2f));
  out.capacity = capacity_;
  return out;
}

void HostDrawTarget::unmap() {
  written_ = mapped_;
  has_content_ = true;
}

ParcelBuffers HostDrawTarget::buffers(ParcelImages*) const {
  if (!has_content_) return {};
  const auto region = static_cast<GLintptr>(written_ * region_bytes());
  const auto speeds = static_cast<GLintptr>(capacity_ * sizeof(Vec2f));
  return {buffer_.get(), region, buffer_.get(), region + speeds};
}

void HostDrawTarget::frame_drawn() { fences_[written_].place(); }

}  // namespace pf
