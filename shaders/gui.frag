// Coverage and colours from the place in the whole picture: a rasteriser differs a little from tile to tile.
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

// On the inner side of an edge of a triangle with positive area. Two triangles that share an edge share no point.
bool is_inside(vec2 p, vec2 from, vec2 to) {
  bool turned = to.y < from.y || (to.y == from.y && to.x < from.x);
  float side = turned ? cross2(from - to, p - to) : cross2(to - from, p - from);
  return turned ? side < 0.0 : side >= 0.0;
}

void main() {
  vec2 p = vec2(gl_FragCoord.x + origin_px.x, picture_height_px - gl_FragCoord.y - origin_px.y);
  vec2 a = word_pair(first, 0);
  vec2 b = word_pair(first + 1, 0);
  vec2 c = word_pair(first + 2, 0);
  float area = cross2(b - a, c - a);
  bool positive = area > 0.0;
  vec2 second = positive ? b : c;
  vec2 third = positive ? c : b;
  if (area == 0.0 || !is_inside(p, a, second) || !is_inside(p, second, third) || !is_inside(p, third, a)) discard;
  float of_b = cross2(p - a, c - a) / area;
  float of_c = cross2(b - a, p - a) / area;
  float of_a = 1.0 - of_b - of_c;
  vec2 uv = word_pair(first, 2) * of_a + word_pair(first + 1, 2) * of_b + word_pair(first + 2, 2) * of_c;
  vec4 tint = unpackUnorm4x8(corner[5 * first + 4]) * of_a + unpackUnorm4x8(corner[5 * first + 9]) * of_b +
              unpackUnorm4x8(corner[5 * first + 14]) * of_c;
  color = clamp(tint, 0.0, 1.0) * textureLod(font, uv, 0.0);
}
