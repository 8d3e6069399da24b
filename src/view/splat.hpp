// Parcels smaller than a pixel or two, drawn as an image of counts: one compute shader adds each parcel to
// its pixel, one triangle turns counts into colours. Costs a few bytes a parcel instead of a point each.
#pragma once

#include <cstdint>

#include "view/context.hpp"
#include "view/gl.hpp"
#include "view/parcel_buffers.hpp"

namespace pf {

struct SplatStyle {
  float per_color_mps = 1.0F;  // speed to place on the colour scale
  float alpha = 1.0F;          // of one parcel, in [0, 1)
};

class Splat {
 public:
  Splat();  // throws DeviceError if a shader is missing or does not compile

  // Blends num_parcels parcels into the bound framebuffer of `size`. The View block must be bound.
  void draw(const ParcelBuffers& parcels, std::uint32_t num_parcels, const SplatStyle& style, SizePx size);

 private:
  void resize(SizePx size);

  GlProgram count_, resolve_;
  GlTexture counts_, speed_sums_;  // height x width, r32ui
  GlVertexArray empty_array_;
  SizePx size_;
};

}  // namespace pf
