// One point per parcel.
layout(location = 0) in vec2 position_m;
layout(location = 1) in float speed_mps;
uniform float point_px;          // side of the square that is drawn
uniform float per_color_mps;     // position on the colour scale per speed
uniform float alpha;
out vec4 point_color;

void main() {
  gl_Position = clip_of(px_of(position_m));
  gl_PointSize = point_px;
  point_color = vec4(speed_color(speed_mps * per_color_mps), alpha);
}
