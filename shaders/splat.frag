// Counts as colours: what as many squares of `alpha` over each other would give, in the colour of their mean
// speed. Leaves the counts at zero for the next frame.
//
// A pixel holds a count in its low 13 bits and above it the sum of places on the colour scale, in 1/63 each;
// 8191 parcels fit.
layout(std430, binding = 2) buffer Pixels { uint pixel[]; };
uniform float alpha;
uniform float one_in;
out vec4 color;

void main() {
  uint i = uint(gl_FragCoord.y) * uint(view.size_px.x) + uint(gl_FragCoord.x);
  uint sums = pixel[i];
  if (sums == 0u) discard;
  pixel[i] = 0u;
  float count = float(sums & 8191u);
  color = vec4(speed_color(float(sums >> 13) / (63.0 * count)), 1.0 - pow(1.0 - alpha, count * one_in));
}
