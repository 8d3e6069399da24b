// Draw memory for a backend on the CPU: one GL buffer that stays mapped, in three regions, so that the CPU
// writes one while GL still reads the others.
#pragma once

#include <array>

#include "view/parcel_buffers.hpp"

namespace pf {

class HostDrawTarget final : public GlDrawTarget {
 public:
  explicit HostDrawTarget(std::string reason) : reason_(std::move(reason)) {}

  DrawTargetKind kind() const override { return DrawTargetKind::host; }
  std::string reason() const override { return reason_; }
  // Allocates half as much again. Throws DeviceError if GL has no memory for it.
  void reserve(std::size_t num_parcels) override;
  DrawBuffers map() override;  // waits until GL has read the next region
  void unmap() override;
  ParcelBuffers buffers(ParcelImages* images) const override;
  void frame_drawn() override;

 private:
  static constexpr std::size_t kNumRegions = 3;

  std::size_t region_bytes() const { return capacity_ * (sizeof(Vec2f) + sizeof(float)); }

  std::string reason_;
  GlBuffer buffer_;
  std::byte* memory_ = nullptr;
  std::size_t capacity_ = 0;  // parcels per region, a multiple of 64
  std::array<GlFence, kNumRegions> fences_;
  std::size_t written_ = 0;  // region that is drawn
  std::size_t mapped_ = 0;
  bool has_content_ = false;
};

}  // namespace pf
