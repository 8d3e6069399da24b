// A ribbon: two vertices per point of the line, displaced to either side by half the width.
layout(location = 0) in vec2 position_m;
layout(location = 1) in vec2 normal;   // unit, longer at corners
layout(location = 2) in vec2 along;    // 0 at the oldest point to 1 at the newest; metres from the oldest
uniform float half_width_px;
out vec3 ribbon;                       // pixels from the middle, share of the length, pixels from the oldest point

void main() {
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  float reach = half_width_px + 1.0;
  gl_Position = clip_of(px_of(position_m) + normal * (side * reach));
  ribbon = vec3(side * reach, along.x, along.y / view.m_per_px);
}
