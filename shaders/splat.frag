// Colours of the counts: as many overlaid squares of opacity `alpha` as counted, in the colour of their mean speed.
// Resets the counts to zero for the next frame.
//
// A pixel holds a count in its low 13 bits, and above it the sum of levels on the colour scale, in units of 1/63.
// It has room for 8191 parcels.
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
