// The GL buffers that the renderer draws the parcels from.
#pragma once

#include <string>

#include "backend/draw_buffers.hpp"
#include "backend/parcel_images.hpp"
#include "view/gl.hpp"

namespace pf {

// position: num_parcels x (x, y) float, metres. speed: num_parcels x float, m/s. Offsets in bytes. Or images,
// which each picture asks for what it shows.
struct ParcelBuffers {
  GLuint position_buffer = 0;
  GLintptr position_offset = 0;
  GLuint speed_buffer = 0;
  GLintptr speed_offset = 0;
  ParcelImages* images = nullptr;

  bool is_empty() const { return position_buffer == 0 && images == nullptr; }
};

// A draw target with GL buffers as its memory.
class GlDrawTarget : public DrawTarget {
 public:
  // The buffers of the last unmap(); empty before the first. images: of the backend that runs now.
  virtual ParcelBuffers buffers(ParcelImages* images) const = 0;
  // To be called after the frame's draw calls: GL may read the buffers after this.
  virtual void frame_drawn() = 0;
  // The reason for this kind, in one short line.
  virtual std::string reason() const = 0;
};

}  // namespace pf
