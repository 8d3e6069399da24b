// Colours from the place in the whole picture: a rasteriser interpolates a little differently in each tile.
layout(std430, binding = 3) readonly buffer Corners { uint corner[]; };  // see gui.vert
uniform vec2 origin_px;
uniform float picture_height_px;
uniform sampler2D font;
flat in int first;
out vec4 color;

vec2 word_pair(int i, int at) {
  return vec2(uintBitsToFloat(corner[5 * i + at]), uintBitsToFloat(corner[5 * i + at + 1]));
}
float cross2(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }

void main() {
  vec2 p = vec2(gl_FragCoord.x + origin_px.x, picture_height_px - gl_FragCoord.y - origin_px.y);
  vec2 a = word_pair(first, 0);
  vec2 ab = word_pair(first + 1, 0) - a;
  vec2 ac = word_pair(first + 2, 0) - a;
  float area = cross2(ab, ac);
  if (area == 0.0) discard;
  float b = cross2(p - a, ac) / area;
  float c = cross2(ab, p - a) / area;
  vec2 uv = word_pair(first, 2) * (1.0 - b - c) + word_pair(first + 1, 2) * b + word_pair(first + 2, 2) * c;
  vec4 tint = unpackUnorm4x8(corner[5 * first + 4]) * (1.0 - b - c) +
              unpackUnorm4x8(corner[5 * first + 9]) * b + unpackUnorm4x8(corner[5 * first + 14]) * c;
  color = clamp(tint, 0.0, 1.0) * textureLod(font, uv, 0.0);
}
