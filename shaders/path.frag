in vec3 ribbon;
uniform float half_width_px;
uniform vec4 path_color;
uniform float dash_px;  // length of a dash plus gap; 0: solid
uniform vec2 fade;  // alpha at the oldest and at the newest point
out vec4 color;
void main() {
  float edge = clamp(half_width_px - abs(ribbon.x) + 0.5, 0.0, 1.0);
  if (dash_px > 0.0 && fract(ribbon.z / dash_px) > 0.6) discard;
  color = vec4(path_color.rgb, path_color.a * edge * mix(fade.x, fade.y, ribbon.y));
}
