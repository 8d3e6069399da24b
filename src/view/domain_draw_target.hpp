// Draw target for a backend whose parcels lie in several memories: few of them are written to host memory,
// of many each picture asks for what it shows.
#pragma once

#include "view/host_draw_target.hpp"

namespace pf {

class DomainDrawTarget final : public GlDrawTarget {
 public:
  enum class Use { by_number, host, images };

  // num_parcels: at first.
  DomainDrawTarget(Use use, std::size_t num_parcels) : use_(use), asks_images_(wants_images(num_parcels)) {}

  DrawTargetKind kind() const override {
    return asks_images_ ? DrawTargetKind::images : DrawTargetKind::host;
  }
  std::string reason() const override { return "domains"; }
  void reserve(std::size_t num_parcels) override {
    asks_images_ = wants_images(num_parcels);
    if (!asks_images_) host_.reserve(num_parcels);
  }
  DrawBuffers map() override { return asks_images_ ? DrawBuffers{} : host_.map(); }
  void unmap() override {
    if (!asks_images_) host_.unmap();
    has_content_ = true;
  }
  ParcelBuffers buffers(ParcelImages* images) const override {
    if (!has_content_) return {};
    return asks_images_ ? ParcelBuffers{0, 0, 0, 0, images} : host_.buffers(images);
  }
  void frame_drawn() override {
    if (!asks_images_) host_.frame_drawn();
  }

 private:
  // A picture of counts takes an H200 and its host 10 ms, 10^6 written parcels 13 ms.
  static constexpr std::size_t kMaxWritten = 300'000;

  bool wants_images(std::size_t num_parcels) const {
    return use_ == Use::images || (use_ == Use::by_number && num_parcels > kMaxWritten);
  }

  HostDrawTarget host_{"domains"};
  Use use_;
  bool asks_images_, has_content_ = false;
};

}  // namespace pf
