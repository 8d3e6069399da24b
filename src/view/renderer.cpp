#include "view/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "view/color_map.hpp"
#include "view/court_lines.hpp"
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
float color_per_mps(const Settings& settings) {
  return static_cast<float>(1.0 / top_color_speed_mps(settings));
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
  GLfloat point_range_px[2] = {};
  glGetFloatv(GL_POINT_SIZE_RANGE, point_range_px);
  max_point_px_ = point_range_px[1];
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
  keep_floor(frame, camera, viewport);
  bind_for_blending(viewport);
  if (parcels == nullptr || parcels->is_empty() || frame.num_parcels == 0) return copy(floor_, viewport);
  const double diameter_px = parcel_diameter_px(frame, camera, viewport.scale);
  const std::vector<Camera> images = image_cameras(camera, frame.physics->world, viewport.origin_px,
                                                   viewport.size, 0.5 * diameter_px * camera.metres_per_px);
  if (!images.empty() && diameter_px < kFirstDisc_px) return draw_counted(frame, *parcels, images, viewport);
  copy(floor_, viewport);
  for (const Camera& image : images) {
    set_view(image, viewport);
    draw_discs(frame, *parcels, image, viewport);
  }
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

// Painted once per view: in llvmpipe its shader would cost more than 20,000 parcels.
void Renderer::keep_floor(const FrameView& frame, const Camera& camera, const Viewport& viewport) {
  const World& world = frame.physics->world;
  const Vec2d half_m = to_metres(world, world.half);
  const FloorKey key = {camera.center_m,     camera.anchor_px,   camera.metres_per_px, viewport.size,
                        2.0 * half_m.x,      2.0 * half_m.y,     world.boundary,       look_.theme,
                        camera.shows_images, viewport.origin_px, viewport.transparent, viewport.scale};
  if (!(key == floor_key_)) paint_floor(key);
  floor_key_ = key;
}

void Renderer::copy(const ColorTarget& picture, const Viewport& viewport) {
  const auto [width, height] = viewport.size;
  glBlitNamedFramebuffer(picture.framebuffer(), viewport.framebuffer, 0, 0, width, height, 0, 0, width,
                         height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
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
    set_uniform(box_, "frame_kind", static_cast<int>(key.boundary));
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

// Each image is blended over the one before, the first over the floor. A window's framebuffer has no texture:
// its picture is made beside it, and copied.
void Renderer::draw_counted(const FrameView& frame, const ParcelBuffers& parcels,
                            const std::vector<Camera>& images, const Viewport& viewport) {
  const double diameter_px = parcel_diameter_px(frame, images.front(), viewport.scale);
  const SplatStyle style = splat_style(frame, images.front(), diameter_px);
  const bool is_window = viewport.texture == 0;
  if (is_window) air_.resize(viewport.size.width, viewport.size.height);
  SplatPicture picture = {is_window ? air_.texture() : viewport.texture, floor_.texture(), viewport.size};
  for (const Camera& image : images) {
    set_view(image, viewport);
    if (parcels.images != nullptr) {
      const CountStyle counted = {style.color_per_mps, Splat::one_in(style)};
      const PixelGrid grid = pixel_grid(image, viewport, 0.0);
      splat_.draw(parcels.images->count(grid, counted), counted.one_in, style, picture);
    } else {
      splat_.draw(parcels, frame.num_parcels, style, picture);
    }
    picture.ground = picture.texture;
  }
  if (is_window) copy(air_, viewport);
}

SplatStyle Renderer::splat_style(const FrameView& frame, const Camera& camera, double diameter_px) const {
  const Vec2d half_px =
      to_metres(frame.physics->world, frame.physics->world.half) * (1.0 / camera.metres_per_px);
  const double per_pixel = frame.num_parcels / (4.0 * half_px.x * half_px.y);
  return {color_per_mps(*frame.settings), counted_alpha(diameter_px), per_pixel};
}

void Renderer::draw_discs(const FrameView& frame, const ParcelBuffers& parcels, const Camera& camera,
                          const Viewport& viewport) {
  const double diameter_px = parcel_diameter_px(frame, camera, viewport.scale);
  if (parcels.images == nullptr) return draw_discs(frame, parcels, frame.num_parcels, diameter_px);
  const std::vector<DrawnParcel> seen =
      parcels.images->gather(pixel_grid(camera, viewport, 0.5 * diameter_px));
  draw_discs(frame, gathered_.upload(seen), static_cast<std::uint32_t>(seen.size()), diameter_px);
}

void Renderer::draw_discs(const FrameView& frame, const ParcelBuffers& parcels, std::uint32_t num_parcels,
                          double diameter_px) {
  // A point vanishes with its middle at the picture's edge, and has a largest size. Many squares take longer.
  constexpr double kLargePoint_px = 48.0;
  constexpr std::uint32_t kFewParcels = 1'000'000;
  const double point_px = diameter_px + 1.5;
  const bool is_large = point_px > max_point_px_ || (point_px > kLargePoint_px && num_parcels <= kFewParcels);
  const bool squares = parcel_look_.as_squares || is_large;
  set_uniform(discs_, "point_px", static_cast<float>(point_px));
  set_uniform(discs_, "radius_px", static_cast<float>(0.5 * diameter_px));
  set_uniform(discs_, "color_per_mps", color_per_mps(*frame.settings));
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

}  // namespace pf
