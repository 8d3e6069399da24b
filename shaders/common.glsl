// The eye, shared by all programs. World in metres, pictures in pixels from the lower left corner.
layout(std140, binding = 0) uniform View {
  vec2 center_m;     // seen at anchor_px
  vec2 anchor_px;
  vec2 size_px;
  float m_per_px;
  float scale;       // pixels per layout pixel
} view;

vec2 px_of(vec2 world_m) { return (world_m - view.center_m) / view.m_per_px + view.anchor_px; }
vec4 clip_of(vec2 px) { return vec4(px / view.size_px * 2.0 - 1.0, 0.0, 1.0); }

// Viridis (van der Walt and Smith 2015), sixth-order fit. Its luminance rises all the way, also for colour-blind
// eyes; the darkest quarter is left out, because it would not show on the floor. t in [0, 1].
// view/color_map.hpp holds the same text for the legend.
vec3 speed_color(float t) {
  t = 0.28 + 0.72 * clamp(t, 0.0, 1.0);
  const vec3 c0 = vec3(0.2777273272, 0.0054073445, 0.3340998053);
  const vec3 c1 = vec3(0.1050930431, 1.4046135299, 1.3845901628);
  const vec3 c2 = vec3(-0.3308618287, 0.2148475595, 0.0950951630);
  const vec3 c3 = vec3(-4.6342304990, -5.7991009734, -19.3324409563);
  const vec3 c4 = vec3(6.2282699363, 14.1799333668, 56.6905526007);
  const vec3 c5 = vec3(4.7763849977, -13.7451453777, -65.3530326334);
  const vec3 c6 = vec3(-5.4354558559, 4.6458526122, 26.3124352496);
  return clamp(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6))))), 0.0, 1.0);
}
