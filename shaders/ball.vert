// A square around the ball, with room for its shadow.
uniform vec2 ball_m;
uniform float radius_px;
flat out vec2 center_px;

const float kReach = 1.9;

void main() {
  vec2 corner = vec2((gl_VertexID & 1) == 0 ? -1.0 : 1.0, (gl_VertexID & 2) == 0 ? -1.0 : 1.0);
  float reach_px = kReach * radius_px + 2.0;
  center_px = px_of(ball_m);
  gl_Position = clip_of(near_tile(center_px + corner * reach_px));
}
