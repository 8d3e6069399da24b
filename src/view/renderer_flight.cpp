// Paths and ball, drawn on top of floor and parcels.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "view/current_color.hpp"
#include "view/renderer.hpp"
#include "view/world_images.hpp"

namespace pf {
namespace {

void set_color(auto& style, const std::array<float, 3>& color, float alpha) {
  std::copy(color.begin(), color.end(), style.color);
  style.color[3] = alpha;
}

}  // namespace

void Renderer::draw_flight(const FrameView& frame, const Camera& camera, const Viewport& viewport) {
  bind_for_blending(viewport);
  const double reach_m = 2.0 * frame.physics->ball.radius_m + 8.0 * viewport.scale * camera.metres_per_px;
  for (const Camera& image :
       image_cameras(camera, frame.physics->world, viewport.origin_px, viewport.size, reach_m)) {
    set_view(image, viewport);
    draw_moving(frame, image, viewport.scale);
  }
}

void Renderer::draw_moving(const FrameView& frame, const Camera& camera, float scale) {
  if (look_.paths) draw_paths(frame, camera, scale);
  if (frame.physics->ball.exists) draw_ball(frame, camera);
}

// Earlier flights fade with age, but for the one that the others are compared with. Ghosts are dashed, the
// current flight is on top.
void Renderer::draw_paths(const FrameView& frame, const Camera& camera, float scale) {
  const ThemeColors& theme = theme_colors(look_.theme);
  if (frame.old_flights != nullptr) {
    float fading = 0.8F;
    for (std::size_t i = frame.old_flights->size(); i-- > 0;) {
      PathStyle style = {1.1F * scale, {}, {0.8F, 1.0F}};
      const FlightRecord& flight = (*frame.old_flights)[i];
      const bool is_reference = frame.flight_record != nullptr &&
                                &flight == &reference_of(*frame.flight_record, *frame.old_flights);
      const float age = is_reference ? 0.0F : static_cast<float>(i);
      set_color(style, flight_color(look_.theme, flight), std::pow(fading, age));
      draw_path(flight.points_m, camera, style);
    }
  }
  if (look_.ghosts && frame.ghosts != nullptr) draw_ghosts(*frame.ghosts, camera, scale);
  if (frame.flight_record == nullptr) return;
  const std::vector<Vec2f>& points_m = frame.flight_record->points_m;
  PathStyle shadow = {3.0F * scale, {}, {0.4F, 1.0F}};
  set_color(shadow, theme.path_shadow, 0.45F);
  draw_path(points_m, camera, shadow);
  PathStyle line = {1.6F * scale, {}, {0.45F, 1.0F}};
  set_color(line, look_.flight.value_or(current_flight_color(look_.theme, frame)), 0.95F);
  draw_path(points_m, camera, line);
}

void Renderer::draw_ghosts(const std::vector<Ghost>& ghosts, const Camera& camera, float scale) {
  for (const Ghost& ghost : ghosts) {
    PathStyle style = {1.0F * scale, {}, {0.9F, 0.9F}, ghost_dash_px(ghost.air) * scale};
    set_color(style, theme_colors(look_.theme).ghost, 0.85F);
    draw_path(ghost.points_m, camera, style);
  }
}

void Renderer::draw_path(const std::vector<Vec2f>& points_m, const Camera& camera, const PathStyle& style) {
  // Points within 1.5 px of the last one kept add no shape and make the normals unstable.
  const auto min_step_m = static_cast<float>(1.5 * camera.metres_per_px);
  path_points_.clear();
  for (const Vec2f& point : points_m) {
    const Vec2f moved = path_points_.empty() ? Vec2f{min_step_m, min_step_m} : point - path_points_.back();
    if (dot(moved, moved) >= min_step_m * min_step_m) path_points_.push_back(point);
  }
  if (path_points_.size() < 2) return;
  path_vertices_.clear();
  float flown_m = 0.0F;
  const std::size_t last = path_points_.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const Vec2f span = path_points_[std::min(i + 1, last)] - path_points_[i == 0 ? 0 : i - 1];
    const float length = std::max(std::sqrt(dot(span, span)), 1e-12F);
    if (i > 0) {
      const Vec2f moved = path_points_[i] - path_points_[i - 1];
      flown_m += std::sqrt(dot(moved, moved));
    }
    PathVertex vertex = {path_points_[i],
                         perpendicular(span) * (1.0F / length),
                         {static_cast<float>(i) / static_cast<float>(last), flown_m},
                         path_points_[i],
                         {}};
    if (i > 0) {
      vertex.previous_m = path_vertices_.back().position_m;
      vertex.previous_along = path_vertices_.back().along;
    }
    path_vertices_.insert(path_vertices_.end(), 2, vertex);
  }
  const std::size_t bytes = path_vertices_.size() * sizeof(PathVertex);
  if (bytes > path_capacity_) {
    path_capacity_ = 2 * bytes;
    path_buffer_ = make_buffer();
    glNamedBufferStorage(path_buffer_.get(), static_cast<GLsizeiptr>(path_capacity_), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
  }
  glNamedBufferSubData(path_buffer_.get(), 0, static_cast<GLsizeiptr>(bytes), path_vertices_.data());
  glVertexArrayVertexBuffer(path_array_.get(), 0, path_buffer_.get(), 0, sizeof(PathVertex));
  set_uniform(path_, "half_width_px", style.half_width_px);
  set_uniform(path_, "dash_px", style.dash_px);
  glProgramUniform4fv(path_.get(), glGetUniformLocation(path_.get(), "path_color"), 1, style.color);
  glProgramUniform2fv(path_.get(), glGetUniformLocation(path_.get(), "fade"), 1, style.fade);
  glUseProgram(path_.get());
  glBindVertexArray(path_array_.get());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, static_cast<GLsizei>(path_vertices_.size()));
}

void Renderer::draw_ball(const FrameView& frame, const Camera& camera) {
  constexpr double kMinRadius_px = 3.0;
  const double radius_px = std::max(frame.physics->ball.radius_m / camera.metres_per_px, kMinRadius_px);
  set_uniform(ball_, "ball_m", to_float(frame.ball.position_m));
  set_uniform(ball_, "radius_px", static_cast<float>(radius_px));
  set_uniform(ball_, "angle", static_cast<float>(std::remainder(frame.ball.angle_rad, 2.0 * kPi)));
  glUseProgram(ball_.get());
  glBindVertexArray(empty_array_.get());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

}  // namespace pf
