// Counts the parcels of each pixel, where many share one: a point each would cost far more than the physics.
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer Positions { vec2 position_m[]; };
layout(std430, binding = 1) readonly buffer Speeds { float speed_mps[]; };
layout(r32ui, binding = 0) uniform uimage2D counts;
layout(r32ui, binding = 1) uniform uimage2D speed_sums;  // of the place on the colour scale, in 1/255
uniform uint num_parcels;
uniform float per_color_mps;

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= num_parcels) return;
  vec2 px = px_of(position_m[i]);
  if (any(lessThan(px, vec2(0.0))) || any(greaterThanEqual(px, view.size_px))) return;
  imageAtomicAdd(counts, ivec2(px), 1u);
  imageAtomicAdd(speed_sums, ivec2(px), uint(clamp(speed_mps[i] * per_color_mps, 0.0, 1.0) * 255.0 + 0.5));
}
