// Draws parcels smaller than a pixel or two as an image of counts: a compute shader adds each parcel to its
// pixel, and one triangle turns counts into colours. On an H200 at 1080p 10^6 parcels cost 1.8 ms as points.
#pragma once

#include <cstdint>
#include <vector>

#include "view/context.hpp"
#include "view/gl.hpp"
#include "view/parcel_buffers.hpp"

namespace pf {

struct SplatStyle {
  float per_color_mps = 1.0F;  // speed to place on the colour scale
  float alpha = 1.0F;          // of one parcel, in [0, 1)
  double per_pixel = 1.0;      // parcels, on average over the world; the count of a pixel is bounded
};

class Splat {
 public:
  Splat();  // throws DeviceError if a shader is missing or does not compile

  // Blends num_parcels parcels into the bound framebuffer of `size`. The View block must be bound.
  void draw(const ParcelBuffers& parcels, std::uint32_t num_parcels, const SplatStyle& style, SizePx size);
  // The same for parcels that were counted elsewhere, one_in of them. pixels: see splat.frag.
  void draw(const std::vector<std::uint32_t>& pixels, std::uint32_t one_in, const SplatStyle& style,
            SizePx size);

  // One of so many parcels is counted.
  static std::uint32_t one_in(const SplatStyle& style);

 private:
  void resize(SizePx size);
  void resolve(const SplatStyle& style, std::uint32_t one_in);

  GlProgram count_, resolve_;
  GlBuffer pixels_;  // height x width x uint32, see splat.frag; all zero between frames
  GlVertexArray empty_array_;
  SizePx size_;
};

}  // namespace pf
