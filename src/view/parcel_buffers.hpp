// What the renderer binds to draw the parcels, whichever way they came there.
#pragma once

#include <memory>
#include <string>

#include "backend/draw_buffers.hpp"
#include "view/gl.hpp"

namespace pf {

// position: num_parcels x (x, y) float, metres. speed: num_parcels x float, m/s. Offsets in bytes.
struct ParcelBuffers {
  GLuint position_buffer = 0;
  GLintptr position_offset = 0;
  GLuint speed_buffer = 0;
  GLintptr speed_offset = 0;
};

// A draw target whose memory is GL buffers.
class GlDrawTarget : public DrawTarget {
 public:
  // The buffers of the last unmap(); position_buffer is 0 before the first.
  virtual ParcelBuffers buffers() const = 0;
  // Called after the frame's draw calls were issued: from here on GL may still read the buffers.
  virtual void frame_drawn() = 0;
  // One short line: why this kind was chosen.
  virtual std::string reason() const = 0;
};

}  // namespace pf
