// A ribbon: two vertices per point of the line, displaced to either side by half the width.
layout(location = 0) in vec2 position_m;
layout(location = 1) in vec2 normal;          // unit, longer at corners
layout(location = 2) in vec2 along;           // 0 at the oldest point to 1 at the newest; metres from the oldest
layout(location = 3) in vec2 previous_m;      // of the point before
layout(location = 4) in vec2 previous_along;
uniform float half_width_px;
// The piece of the line that a triangle belongs to: its last vertex counts.
flat out vec4 piece_px;                       // from, to
flat out vec4 piece_along;                    // share of the length and pixels from the oldest point: from, to

void main() {
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  gl_Position = clip_of(px_of(position_m) + normal * (side * (half_width_px + 1.0)));
  piece_px = vec4(px_of(previous_m), px_of(position_m));
  piece_along = vec4(previous_along.x, previous_along.y / view.m_per_px, along.x, along.y / view.m_per_px);
}
