// Parcels large enough to be seen as discs, with soft edges.
flat in vec4 point_color;
flat in vec2 center_px;
uniform float radius_px;
out vec4 color;
void main() {
  float r = length(FRAGMENT_PX - center_px);
  float rim = radius_px > 4.0 ? mix(1.0, 0.72, smoothstep(0.6, 1.0, r / radius_px)) : 1.0;
  color = vec4(point_color.rgb * rim, point_color.a * clamp(radius_px - r + 0.5, 0.0, 1.0));
}
