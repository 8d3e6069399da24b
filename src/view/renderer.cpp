#include "view/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "view/color_map.hpp"
#include "view/court_lines.hpp"
#include "view/current_color.hpp"
#include "view/world_images.hpp"

namespace pf {
namespace {

// Same layout as View in common.glsl.
struct ViewBlock {
  Vec2f center_m, anchor_px, size_px;
  float metres_per_px, scale;
  float map_low, map_high;  // the part of the colour map that is used
  float map_kind, light;
  Vec2f origin_px;
  float transparent, unused;
};

void set_uniform(const GlProgram& program, const char* name, float value) {
  glProgramUniform1f(program.get(), glGetUniformLocation(program.get(), name), value);
}

void set_uniform(const GlProgram& program, const char* name, Vec2f value) {
  glProgramUniform2f(program.get(), glGetUniformLocation(program.get(), name), value.x, value.y);
}

void set_color(auto& style, const std::array<float, 3>& color, float alpha) {
  std::copy(color.begin(), color.end(), style.color);
  style.color[3] = alpha;
}

// A parcel of this diameter or more is drawn as a disc; a smaller one is counted in its pixel.
constexpr double kFirstDisc_px = 1.6;
constexpr float kDiscAlpha = 0.95F;

// The alpha of a counted parcel is its share of the pixel to the power 0.75: a little more than the share, so
// that air of 10 % area fraction can be seen at any N.
float counted_alpha(double diameter_px) {
  const double share = std::min(1.0, 0.25 * kPi * diameter_px * diameter_px);
  return kDiscAlpha * static_cast<float>(std::pow(share, 0.75));
}

double drawn_radius_m(const Settings& settings, const Physics& physics) {
  if (settings.drawn_area_fraction == 0.0) return physics.parcels.radius_m;
  const Vec2d half_m = to_metres(physics.world, physics.world.half);
  return std::sqrt(settings.drawn_area_fraction * 4.0 * half_m.x * half_m.y / (kPi * physics.parcels.num));
}

// Speed to place on the colour scale.
float per_color_mps(const Settings& settings) {
  return static_cast<float>(1.0 / top_color_speed_mps(settings.parcel_speed_mps,
                                                      std::hypot(settings.flow_x_mps, settings.flow_y_mps),
                                                      settings.hot_speed_mps));
}

// A round number of metres that cuts the side into 5 to 12 parts.
double grid_step(double side_m) {
  const double step = std::pow(10.0, std::floor(std::log10(side_m / 5.0)));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (side_m / (step * factor) <= 12.0) return step * factor;
  }
  return 10.0 * step;
}

// The viewport's pixels and those within reach_px of them.
PixelGrid pixel_grid(const Camera& camera, const Viewport& viewport, double reach_px) {
  const int reach = static_cast<int>(std::ceil(reach_px));
  const Vec2i origin = viewport.origin_px - Vec2i{reach, reach};
  PixelGrid grid{to_float(camera.center_m), to_float(camera.anchor_px), to_float(to_double(origin))};
  grid.m_per_px = static_cast<float>(camera.metres_per_px);
  grid.width = static_cast<std::uint32_t>(viewport.size.width + 2 * reach);
  grid.height = static_cast<std::uint32_t>(viewport.size.height + 2 * reach);
  return grid;
}

}  // namespace

Renderer::Renderer()
    : court_(load_program("fullscreen", "court")),
      box_(load_program("fullscreen", "box")),
      discs_(load_program("parcels")),
      path_(load_program("path")),
      ball_(load_program("ball")),
      view_buffer_(make_buffer()),
      path_buffer_(make_buffer()),
      empty_array_(make_vertex_array()),
      parcel_array_(make_vertex_array()),
      path_array_(make_vertex_array()) {
  glNamedBufferStorage(view_buffer_.get(), sizeof(ViewBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
  const auto add = [](const GlVertexArray& array, GLuint index, GLint size, GLuint offset, GLuint binding) {
    glEnableVertexArrayAttrib(array.get(), index);
    glVertexArrayAttribFormat(array.get(), index, size, GL_FLOAT, GL_FALSE, offset);
    glVertexArrayAttribBinding(array.get(), index, binding);
  };
  add(parcel_array_, 0, 2, 0, 0);
  add(parcel_array_, 1, 1, 0, 1);
  add(path_array_, 0, 2, offsetof(PathVertex, position_m), 0);
  add(path_array_, 1, 2, offsetof(PathVertex, normal), 0);
  add(path_array_, 2, 2, offsetof(PathVertex, along), 0);
  add(path_array_, 3, 2, offsetof(PathVertex, previous_m), 0);
  add(path_array_, 4, 2, offsetof(PathVertex, previous_along), 0);
}

void Renderer::draw_air(const FrameView& frame, const ParcelBuffers* parcels, const Camera& camera,
                        const Viewport& viewport) {
  set_view(camera, viewport);
  draw_floor(frame, camera, viewport);
  bind_for_blending(viewport);
  if (parcels == nullptr || parcels->is_empty() || frame.num_parcels == 0) return;
  const double reach_m = 0.5 * parcel_diameter_px(frame, camera, viewport.scale) * camera.metres_per_px;
  for (const Camera& image :
       image_cameras(camera, frame.physics->world, viewport.origin_px, viewport.size, reach_m)) {
    set_view(image, viewport);
    draw_parcels(frame, *parcels, image, viewport);
  }
}

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

void Renderer::bind_for_blending(const Viewport& viewport) {
  glBindFramebuffer(GL_FRAMEBUFFER, viewport.framebuffer);
  glViewport(0, 0, viewport.size.width, viewport.size.height);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
}

void Renderer::set_view(const Camera& camera, const Viewport& viewport) {
  const ViewBlock block = {
      to_float(camera.center_m),
      to_float(camera.anchor_px),
      {static_cast<float>(viewport.size.width), static_cast<float>(viewport.size.height)},
      static_cast<float>(camera.metres_per_px),
      viewport.scale,
      map_range(look_.theme).low,
      map_range(look_.theme).high,
      static_cast<float>(look_.color_map),
      look_.theme == Theme::light ? 1.0F : 0.0F,
      to_float(to_double(viewport.origin_px)),
      viewport.transparent ? 1.0F : 0.0F,
      0.0F};
  glNamedBufferSubData(view_buffer_.get(), 0, sizeof(block), &block);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, view_buffer_.get());
}

// Painted once per view and then copied: in llvmpipe its shader would cost more than 20,000 parcels.
void Renderer::draw_floor(const FrameView& frame, const Camera& camera, const Viewport& viewport) {
  const World& world = frame.physics->world;
  const Vec2d half_m = to_metres(world, world.half);
  const FloorKey key = {camera.center_m,     camera.anchor_px,   camera.metres_per_px, viewport.size,
                        2.0 * half_m.x,      2.0 * half_m.y,     world.boundary,       look_.theme,
                        camera.shows_images, viewport.origin_px, viewport.transparent};
  if (!(key == floor_key_)) paint_floor(key);
  floor_key_ = key;
  const auto [width, height] = viewport.size;
  glBlitNamedFramebuffer(floor_.framebuffer(), viewport.framebuffer, 0, 0, width, height, 0, 0, width, height,
                         GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void Renderer::paint_floor(const FloorKey& key) {
  floor_.resize(key.size.width, key.size.height);
  glBindFramebuffer(GL_FRAMEBUFFER, floor_.framebuffer());
  glViewport(0, 0, key.size.width, key.size.height);
  glDisable(GL_BLEND);
  const bool court = court::fits(key.width_m, key.height_m);
  const bool has_images = key.images && key.boundary == Boundary::periodic;
  set_uniform(court ? court_ : box_, "image_side_m",
              has_images ? to_float(Vec2d{key.width_m, key.height_m}) : Vec2f{});
  if (!court) {
    set_uniform(box_, "half_size_m", to_float(Vec2d{0.5 * key.width_m, 0.5 * key.height_m}));
    set_uniform(box_, "grid_m", static_cast<float>(grid_step(std::max(key.width_m, key.height_m))));
    glProgramUniform1i(box_.get(), glGetUniformLocation(box_.get(), "frame_kind"),
                       static_cast<int>(key.boundary));
  }
  glUseProgram(court ? court_.get() : box_.get());
  glBindVertexArray(empty_array_.get());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

double Renderer::parcel_diameter_px(const FrameView& frame, const Camera& camera, float scale) const {
  const double radius_m = parcel_look_.true_size ? frame.physics->parcels.radius_m
                                                 : drawn_radius_m(*frame.settings, *frame.physics);
  return std::max(2.0 * radius_m / camera.metres_per_px, parcel_look_.min_px * scale);
}

void Renderer::draw_parcels(const FrameView& frame, const ParcelBuffers& parcels, const Camera& camera,
                            const Viewport& viewport) {
  if (parcels.images != nullptr) return draw_images(frame, *parcels.images, camera, viewport);
  const double diameter_px = parcel_diameter_px(frame, camera, viewport.scale);
  if (diameter_px >= kFirstDisc_px) return draw_discs(frame, parcels, frame.num_parcels, diameter_px);
  splat_.draw(parcels, frame.num_parcels, splat_style(frame, camera, diameter_px), viewport.size);
}

void Renderer::draw_images(const FrameView& frame, ParcelImages& images, const Camera& camera,
                           const Viewport& viewport) {
  const double diameter_px = parcel_diameter_px(frame, camera, viewport.scale);
  if (diameter_px >= kFirstDisc_px) {
    const std::vector<DrawnParcel> seen = images.gather(pixel_grid(camera, viewport, 0.5 * diameter_px));
    return draw_discs(frame, gathered_.upload(seen), static_cast<std::uint32_t>(seen.size()), diameter_px);
  }
  const SplatStyle style = splat_style(frame, camera, diameter_px);
  const CountStyle counted = {style.per_color_mps, Splat::one_in(style)};
  splat_.draw(images.count(pixel_grid(camera, viewport, 0.0), counted), counted.one_in, style, viewport.size);
}

SplatStyle Renderer::splat_style(const FrameView& frame, const Camera& camera, double diameter_px) const {
  const Vec2d half_px =
      to_metres(frame.physics->world, frame.physics->world.half) * (1.0 / camera.metres_per_px);
  const double per_pixel = frame.num_parcels / (4.0 * half_px.x * half_px.y);
  return {per_color_mps(*frame.settings), counted_alpha(diameter_px), per_pixel};
}

void Renderer::draw_discs(const FrameView& frame, const ParcelBuffers& parcels, std::uint32_t num_parcels,
                          double diameter_px) {
  const bool squares = parcel_look_.as_squares;
  set_uniform(discs_, "point_px", static_cast<float>(diameter_px) + 1.5F);
  set_uniform(discs_, "radius_px", static_cast<float>(0.5 * diameter_px));
  set_uniform(discs_, "per_color_mps", per_color_mps(*frame.settings));
  set_uniform(discs_, "alpha", kDiscAlpha);
  set_uniform(discs_, "squares", squares ? 1.0F : 0.0F);
  glVertexArrayVertexBuffer(parcel_array_.get(), 0, parcels.position_buffer, parcels.position_offset,
                            sizeof(Vec2f));
  glVertexArrayVertexBuffer(parcel_array_.get(), 1, parcels.speed_buffer, parcels.speed_offset,
                            sizeof(float));
  for (const GLuint binding : {0U, 1U})
    glVertexArrayBindingDivisor(parcel_array_.get(), binding, squares ? 1 : 0);
  glEnable(GL_PROGRAM_POINT_SIZE);
  glUseProgram(discs_.get());
  glBindVertexArray(parcel_array_.get());
  const auto num = static_cast<GLsizei>(num_parcels);
  if (squares) {
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, num);
  } else {
    glDrawArrays(GL_POINTS, 0, num);
  }
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
