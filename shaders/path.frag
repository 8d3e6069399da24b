flat in vec4 piece_px;
flat in vec4 piece_along;
uniform float half_width_px;
uniform vec4 path_color;
uniform float dash_px;  // length of a dash plus gap; 0: solid
uniform vec2 fade;  // alpha at the oldest and at the newest point
out vec4 color;
void main() {
  vec2 piece = piece_px.zw - piece_px.xy;
  vec2 from = FRAGMENT_PX - piece_px.xy;
  float share = clamp(dot(from, piece) / max(dot(piece, piece), 1e-12), 0.0, 1.0);
  float edge = clamp(half_width_px - length(from - share * piece) + 0.5, 0.0, 1.0);
  vec2 along = mix(piece_along.xy, piece_along.zw, share);
  if (dash_px > 0.0 && fract(along.y / dash_px) > 0.6) discard;
  color = vec4(path_color.rgb, path_color.a * edge * mix(fade.x, fade.y, along.x));
}
