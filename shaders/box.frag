// A plain floor with a frame, for worlds without a court.
uniform vec2 half_size_m;
uniform float grid_m;   // distance of the grid lines
uniform vec2 image_side_m;  // of a periodic world that goes on beyond its edges; 0: it does not
uniform int frame_kind; // 0 open: dashed, 1 walls: solid, 2 periodic: thin
out vec4 color;

float cover(float d) { return clamp(0.5 - d / view.m_per_px, 0.0, 1.0); }

void main() {
  vec2 p = (FRAGMENT_PX - view.anchor_px) * view.m_per_px + view.center_m;
  if (image_side_m.x > 0.0) p -= image_side_m * round(p / image_side_m);
  vec2 q = abs(p) - half_size_m;
  float inside = max(q.x, q.y);
  vec3 outside = mix(vec3(0.043, 0.071, 0.090), vec3(0.878, 0.902, 0.906), view.light);
  vec3 ground = mix(outside, mix(vec3(0.063, 0.133, 0.180), vec3(0.922, 0.945, 0.957), view.light), cover(inside));
  vec4 c = view.transparent > 0.5 ? vec4(0.0) : vec4(ground, 1.0);  // colours are times alpha, as blending leaves them
  vec2 to_line = abs(fract(p / grid_m + 0.5) - 0.5) * grid_m;
  float grid = cover(min(to_line.x, to_line.y) - 0.5 * view.m_per_px) * cover(inside);
  c = mix(c, vec4(mix(vec3(0.25, 0.40, 0.46), vec3(0.50, 0.60, 0.65), view.light), 1.0), 0.22 * grid);
  float distance_m = length(max(q, 0.0)) + min(inside, 0.0);
  float half_width = (frame_kind == 1 ? 1.6 : 0.8) * view.scale * view.m_per_px;
  float frame = cover(abs(distance_m - half_width) - half_width);
  vec2 dash = step(0.5, fract(FRAGMENT_PX / (14.0 * view.scale)));
  if (frame_kind == 0) frame *= q.x > q.y ? dash.y : dash.x;
  c = mix(c, vec4(mix(vec3(0.87, 0.90, 0.89), vec3(0.25, 0.33, 0.38), view.light), 1.0), 0.85 * frame);
  float noise = fract(sin(dot(FRAGMENT_PX, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;
  color = vec4(c.rgb + noise / 255.0 * c.a, c.a);
}
