// The view, shared by all programs. The world is in metres, pictures in pixels from the lower left corner. What is
// drawn may be a tile of a larger picture. Fragments compute from their place in the whole picture, so that a picture
// is the same, however it is divided.
layout(std140, binding = 0) uniform View {
  vec2 center_m;     // seen at anchor_px
  vec2 anchor_px;
  vec2 size_px;      // of the tile
  float m_per_px;
  float scale;       // pixels per layout pixel
  float map_low;     // used part of the colour map
  float map_high;
  float map_kind;    // 0 viridis, 1 cividis, 2 grey
  float light;       // 1: light theme
  vec2 origin_px;    // of the tile in the picture
  float transparent; // 1: without a ground
  float unused;
} view;

#define FRAGMENT_PX (gl_FragCoord.xy + view.origin_px)

vec2 px_of(vec2 world_m) { return (world_m - view.center_m) / view.m_per_px + view.anchor_px; }
// For corners of upright rectangles, whose parts outside of the tile nobody sees.
vec2 near_tile(vec2 px) { return clamp(px, view.origin_px - 2.0, view.origin_px + view.size_px + 2.0); }

// On a grid of 1/64 of a pixel, which rasterisers keep exactly: the same corners in every tile.
vec4 clip_of(vec2 px) {
  vec2 in_tile = round(px * 64.0) / 64.0 - view.origin_px;
  return vec4(in_tile / view.size_px * 2.0 - 1.0, 0.0, 1.0);
}

// Sixth-order fits of viridis (van der Walt and Smith 2015) and cividis (Nunez, Anderton and Renslow 2018), and
// grey. Lightness increases monotonically in each, also for colour-blind eyes. The part that is invisible on the
// floor is left out. t in [0, 1], slow to fast. view/color_map.hpp holds the same text for the legend.
vec3 viridis(float t) {
  const vec3 c0 = vec3(0.2777273272, 0.0054073445, 0.3340998053);
  const vec3 c1 = vec3(0.1050930431, 1.4046135299, 1.3845901628);
  const vec3 c2 = vec3(-0.3308618287, 0.2148475595, 0.0950951630);
  const vec3 c3 = vec3(-4.6342304990, -5.7991009734, -19.3324409563);
  const vec3 c4 = vec3(6.2282699363, 14.1799333668, 56.6905526007);
  const vec3 c5 = vec3(4.7763849977, -13.7451453777, -65.3530326334);
  const vec3 c6 = vec3(-5.4354558559, 4.6458526122, 26.3124352496);
  return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6)))));
}

vec3 cividis(float t) {
  const vec3 c0 = vec3(-0.0089734425, 0.1367558936, 0.2941701871);
  const vec3 c1 = vec3(-0.3846890463, 0.6394937024, 2.9826539258);
  const vec3 c2 = vec3(15.4292103485, 0.3855616507, -22.3637603722);
  const vec3 c3 = vec3(-58.9770314611, -1.4041971194, 74.8635610979);
  const vec3 c4 = vec3(102.3704915104, 2.6009142965, -121.3031642206);
  const vec3 c5 = vec3(-83.1872389608, -2.1407503893, 93.9742163957);
  const vec3 c6 = vec3(25.7760701436, 0.6881223150, -28.2625330184);
  return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6)))));
}

vec3 speed_color(float t) {
  t = mix(view.map_low, view.map_high, clamp(t, 0.0, 1.0));
  if (view.map_kind > 1.5) return vec3(t);
  return clamp(view.map_kind > 0.5 ? cividis(t) : viridis(t), 0.0, 1.0);
}
