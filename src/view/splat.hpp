// Draws parcels smaller than a pixel or two as an image of counts: a compute shader adds each parcel to its
// pixel, another turns counts into colours over a ground. On an H200 at 1080p 10^6 parcels cost 1.8 ms as
// points.
#pragma once

#include <cstdint>
#include <vector>

#include "view/context.hpp"
#include "view/gl.hpp"
#include "view/parcel_buffers.hpp"

namespace pf {

struct SplatStyle {
  float color_per_mps = 1.0F;  // speed to place on the colour scale
  float alpha = 1.0F;          // of one parcel, in [0, 1)
  double per_pixel = 1.0;      // parcels, on average over the world; the count of a pixel is bounded
};

// The target for the colours of the counts. Both textures are RGBA8 and have this size.
struct SplatPicture {
  GLuint texture = 0;  // every pixel is written
  GLuint ground = 0;   // lies below the parcels; may be the same texture
  SizePx size;
};

class Splat {
 public:
  Splat();  // throws DeviceError if a shader is missing or does not compile

  // Blends num_parcels parcels over the ground. The View block must be bound.
  void draw(const ParcelBuffers& parcels, std::uint32_t num_parcels, const SplatStyle& style,
            const SplatPicture& picture);
  // The same for parcels that were counted elsewhere, one_in of them. pixels: see splat_resolve.comp.
  void draw(const std::vector<std::uint32_t>& pixels, std::uint32_t one_in, const SplatStyle& style,
            const SplatPicture& picture);

  // One of so many parcels is counted.
  static std::uint32_t one_in(const SplatStyle& style);

 private:
  void resize(SizePx size);
  void resolve(const SplatStyle& style, std::uint32_t one_in, const SplatPicture& picture);

  GlProgram count_, resolve_;
  GlBuffer pixels_;  // height x width x uint32, see splat_resolve.comp; all zero between pictures
  SizePx size_;
};

}  // namespace pf
