// A point or a square per parcel.
layout(location = 0) in vec2 position_m;
layout(location = 1) in float speed_mps;
uniform float point_px;          // side of the square that is drawn
uniform float color_per_mps;     // position on the colour scale per speed
uniform float alpha;
uniform float squares;           // 1: four vertices per parcel; 0: a point
flat out vec4 point_color;
flat out vec2 center_px;

void main() {
  center_px = px_of(position_m);
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1 & 1)) - 0.5;
  gl_Position = clip_of(squares > 0.5 ? near_tile(center_px + corner * point_px) : center_px);
  gl_PointSize = point_px;
  point_color = vec4(speed_color(speed_mps * color_per_mps), alpha);
}
