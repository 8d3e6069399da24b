// A square around the ball, with room for its shadow.
uniform vec2 ball_m;
uniform float radius_px;
out vec2 from_center;  // ball radii

const float kReach = 1.9;

void main() {
  vec2 corner = vec2((gl_VertexID & 1) == 0 ? -1.0 : 1.0, (gl_VertexID & 2) == 0 ? -1.0 : 1.0);
  float reach_px = kReach * radius_px + 2.0;
  gl_Position = clip_of(px_of(ball_m) + corner * reach_px);
  from_center = corner * reach_px / radius_px;
}
