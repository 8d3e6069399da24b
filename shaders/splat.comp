// Adds each parcel to its pixel. With many parcels per pixel, drawing points would cost far more than the physics.
// Parcels in a row lie near each other, in one pixel often: a run of them is added at once.
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer Positions { vec2 position_m[]; };
layout(std430, binding = 1) readonly buffer Speeds { float speed_mps[]; };
layout(std430, binding = 2) buffer Pixels { uint pixel[]; };  // see splat_resolve.comp
uniform uint num_parcels;
uniform uint one_in;  // one of this many parcels is counted
uniform uint per_thread;  // parcels that a thread counts
uniform float color_per_mps;

void main() {
  uint at = 0u, sums = 0u;  // of the pixel that the run is in
  for (uint k = 0u; k < per_thread; ++k) {
    uint i = (gl_GlobalInvocationID.x * per_thread + k) * one_in;
    if (i >= num_parcels) break;
    vec2 px = px_of(position_m[i]) - view.origin_px;
    if (any(lessThan(px, vec2(0.0))) || any(greaterThanEqual(px, view.size_px))) continue;
    uint here = uint(px.y) * uint(view.size_px.x) + uint(px.x);
    if (here != at) {
      if (sums != 0u) atomicAdd(pixel[at], sums);
      at = here;
      sums = 0u;
    }
    uint level = uint(clamp(speed_mps[i] * color_per_mps, 0.0, 1.0) * 63.0 + 0.5);
    sums += (level << 13) | 1u;
  }
  if (sums != 0u) atomicAdd(pixel[at], sums);
}
