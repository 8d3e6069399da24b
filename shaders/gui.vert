// Triangles of Dear ImGui in a tile of a larger picture, three corners after each other.
layout(std430, binding = 3) readonly buffer Corners { uint corner[]; };  // x, y [px from the top left], u, v, colour
uniform vec2 origin_px;  // of the tile, from the lower left corner of the picture
uniform vec2 size_px;    // of the tile
uniform float picture_height_px;
flat out int first;

void main() {
  first = gl_VertexID / 3 * 3;
  vec2 px = vec2(uintBitsToFloat(corner[5 * gl_VertexID]),
                 picture_height_px - uintBitsToFloat(corner[5 * gl_VertexID + 1]));
  vec2 in_tile = round(px * 64.0) / 64.0 - origin_px;  // as in clip_of()
  gl_Position = vec4(in_tile / size_px * 2.0 - 1.0, 0.0, 1.0);
}
