// A pickleball court from above, in metres: 44 x 20 ft, non-volley zones 7 ft deep, net between posts 22 ft apart
// (docs/physics.md, 'Court and ball'). It is drawn once per view and kept as a picture.
uniform vec2 image_side_m;  // of a periodic world that goes on beyond its edges; 0: it does not
out vec4 color;

const float kFoot = 0.3048;
const vec2 kHalfCourt = vec2(22.0, 10.0) * kFoot;
const vec2 kHalfPlay = vec2(30.0, 15.5) * kFoot;
const float kZone = 7.0 * kFoot;
const float kHalfLine = 0.0254;        // lines are 2 inches wide
const float kHalfPosts = 11.0 * kFoot;

// Covered share of the pixel at distance d from an edge, m; negative inside.
float cover(float d) { return clamp(0.5 - d / view.m_per_px, 0.0, 1.0); }

float box(vec2 p, vec2 half_size) {
  vec2 q = abs(p) - half_size;
  return length(max(q, 0.0)) + min(max(q.x, q.y), 0.0);
}

// Lines are at least 1.2 px wide.
float half_line() { return max(kHalfLine, 0.6 * view.m_per_px); }

float lines(vec2 p) {
  float w = half_line();
  vec2 a = abs(p);
  float outline = abs(box(p, kHalfCourt - kHalfLine)) - w;
  float zone = max(abs(a.x - kZone) - w, a.y - kHalfCourt.y);
  float middle = max(max(a.y - w, kZone - a.x), a.x - kHalfCourt.x);
  return min(min(outline, zone), middle);
}

vec3 floor_color(vec2 p) {
  vec3 outside = mix(vec3(0.043, 0.071, 0.090), vec3(0.878, 0.902, 0.906), view.light);
  vec3 apron = mix(vec3(0.067, 0.129, 0.149), vec3(0.827, 0.867, 0.859), view.light);
  vec3 court = mix(vec3(0.058, 0.158, 0.228), vec3(0.902, 0.933, 0.957), view.light);
  vec3 zone = mix(vec3(0.066, 0.205, 0.222), vec3(0.871, 0.922, 0.910), view.light);
  // The floor has no edge: beyond the room for play its light fades.
  vec3 c = mix(apron, outside, smoothstep(-0.5, 7.0, box(p, kHalfPlay)));
  c = mix(c, court, cover(box(p, kHalfCourt)));
  return mix(c, zone, cover(box(p, vec2(kZone, kHalfCourt.y))));
}

float net_half_width() { return max(0.022, 0.75 * view.m_per_px); }
float net(vec2 p) { return cover(max(abs(p.x) - net_half_width(), abs(p.y) - kHalfPosts)); }
float posts(vec2 p) { return cover(length(vec2(p.x, abs(p.y) - kHalfPosts)) - 0.06); }

// Lays a colour over a picture, of which colours are times alpha.
vec4 over(vec4 c, vec3 dark, vec3 light, float a) { return mix(c, vec4(mix(dark, light, view.light), 1.0), a); }

vec4 with_net(vec4 c, vec2 p) {
  float shadow = mix(0.42, 0.16, view.light) * (1.0 - smoothstep(0.0, 0.30, p.x)) * cover(abs(p.y + 0.05) - kHalfPosts);
  if (view.transparent < 0.5) c.rgb *= 1.0 - shadow * step(0.0, p.x);
  c = over(c, vec3(0.86, 0.89, 0.88), vec3(0.20, 0.27, 0.31), 0.92 * net(p));
  return over(c, vec3(0.72, 0.76, 0.78), vec3(0.24, 0.31, 0.35), posts(p));
}

void main() {
  vec2 p = (FRAGMENT_PX - view.anchor_px) * view.m_per_px + view.center_m;
  if (image_side_m.x > 0.0) p -= image_side_m * round(p / image_side_m);
  vec3 ground = floor_color(p) * (1.0 - mix(0.18, 0.05, view.light) * smoothstep(4.0, 16.0, length(p * vec2(0.8, 1.2))));
  bool is_transparent = view.transparent > 0.5;
  vec4 c = is_transparent ? vec4(0.0) : vec4(ground, 1.0);
  c = over(c, vec3(0.87, 0.90, 0.89), vec3(0.30, 0.38, 0.43), 0.80 * cover(lines(p)));
  c = with_net(c, p);
  // Half a grey level of noise hides the bands of the soft shading.
  float noise = fract(sin(dot(FRAGMENT_PX, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;
  color = vec4(c.rgb + noise / 255.0 * c.a, c.a);
}
