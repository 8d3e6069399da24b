// A pickleball from above: a lit sphere whose holes turn with it. One hole is marked to show the spin.
flat in vec2 center_px;
uniform float radius_px;
uniform float angle;
out vec4 color;

const float kPi = 3.14159265;

// Coverage of a foreshortened round hole whose centre is at `middle` on the sphere.
float hole(vec3 on_sphere, vec3 middle, float half_angle) {
  float away = acos(clamp(dot(on_sphere, middle), -1.0, 1.0)) - half_angle;
  return clamp(0.5 - away * radius_px * max(on_sphere.z, 0.3), 0.0, 1.0);
}

vec3 on_ring(float tilt, float turn) { return vec3(sin(tilt) * cos(turn), sin(tilt) * sin(turn), cos(tilt)); }

// The nearest hole of a ring of `count`.
float ring(vec3 s, float turn, float tilt, float count, float half_angle) {
  float sector = 2.0 * kPi / count;
  float nearest = round((atan(s.y, s.x) - turn) / sector) * sector + turn;
  return hole(s, on_ring(tilt, nearest), half_angle);
}

vec3 surface(vec2 p) {
  vec3 s = vec3(p, sqrt(max(1.0 - dot(p, p), 0.0)));
  float light = 0.62 + 0.46 * max(dot(s, normalize(vec3(-0.45, 0.55, 0.72))), 0.0);
  vec3 c = vec3(0.965, 0.890, 0.170) * light;
  float glint = pow(max(dot(s, normalize(vec3(-0.28, 0.36, 0.89))), 0.0), 24.0);
  float size = 0.165;
  float holes = max(ring(s, angle, 0.60, 6.0, size), ring(s, angle + 0.26, 1.12, 12.0, 0.9 * size));
  c = mix(c, vec3(0.235, 0.215, 0.060), 0.92 * holes);
  c = mix(c, vec3(0.900, 0.235, 0.130), hole(s, on_ring(0.60, angle), 1.45 * size));
  return c + 0.22 * glint;
}

void main() {
  vec2 from_center = (FRAGMENT_PX - center_px) / radius_px;  // ball radii
  float r = length(from_center);
  float disc = clamp((1.0 - r) * radius_px + 0.5, 0.0, 1.0);
  float rim = clamp((1.0 - r) * radius_px + 2.0, 0.0, 1.0);
  float shadow = 0.55 * (1.0 - smoothstep(0.75, 1.55, length(from_center - vec2(0.20, -0.24))));
  float alpha = max(shadow, rim * 0.75);
  vec3 c = vec3(0.016, 0.030, 0.040);
  c = mix(c, surface(from_center / max(r, 1.0)), disc);
  color = vec4(c, mix(alpha, 1.0, disc));
}
