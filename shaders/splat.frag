// The image of counts as colours: what as many squares of `alpha` over each other would give, in the colour of
// their mean speed.
layout(r32ui, binding = 0) readonly uniform uimage2D counts;
layout(r32ui, binding = 1) readonly uniform uimage2D speed_sums;
uniform float alpha;
out vec4 color;

void main() {
  ivec2 px = ivec2(gl_FragCoord.xy);
  uint count = imageLoad(counts, px).r;
  if (count == 0u) discard;
  float mean = float(imageLoad(speed_sums, px).r) / (255.0 * float(count));
  color = vec4(speed_color(mean), 1.0 - pow(1.0 - alpha, float(count)));
}
