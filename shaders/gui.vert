// Triangles of Dear ImGui in a tile of a larger picture: a rectangle around each, cut to the tile.
layout(std430, binding = 3) readonly buffer Corners { uint corner[]; };  // x, y [px from the top left], u, v, colour
uniform vec2 origin_px;  // of the tile, from the lower left corner of the picture
uniform vec2 size_px;    // of the tile
uniform float picture_height_px;
flat out int first;      // of the triangle's corners

vec2 place_px(int i) {
  return vec2(uintBitsToFloat(corner[5 * i]), picture_height_px - uintBitsToFloat(corner[5 * i + 1]));
}

void main() {
  first = gl_VertexID / 6 * 3;
  vec2 a = place_px(first);
  vec2 b = place_px(first + 1);
  vec2 c = place_px(first + 2);
  vec2 low = clamp(floor(min(a, min(b, c))) - origin_px, vec2(0.0), size_px);
  vec2 high = clamp(ceil(max(a, max(b, c))) - origin_px, vec2(0.0), size_px);
  int k = gl_VertexID % 6;
  vec2 in_tile = vec2(k == 1 || k > 3 ? high.x : low.x, k == 2 || k == 3 || k == 5 ? high.y : low.y);
  gl_Position = vec4(in_tile / size_px * 2.0 - 1.0, 0.0, 1.0);
}
