// Draws one frame of the scene, seen from above: floor, parcels, paths, ball.
#pragma once

#include <cstdint>
#include <vector>

#include "app/simulation.hpp"
#include "view/camera.hpp"
#include "view/context.hpp"
#include "view/gathered_parcels.hpp"
#include "view/gl.hpp"
#include "view/look.hpp"
#include "view/parcel_buffers.hpp"
#include "view/splat.hpp"

namespace pf {

// The framebuffer that a frame is drawn to (0: the window's), and its size. It may be a tile of a larger
// picture, in whose pixels camera and marks count.
struct Viewport {
  GLuint framebuffer = 0;
  GLuint texture = 0;  // the framebuffer's image, RGBA8 and of this size; 0: none, as of a window
  SizePx size;
  float scale = 1.0F;        // pixels per layout pixel
  Vec2i origin_px{};         // of the tile in the picture
  int picture_height = 0;    // 0: not a tile
  bool transparent = false;  // no ground: only lines, parcels, paths and ball

  int whole_height() const { return picture_height > 0 ? picture_height : size.height; }
};

// Appearance of parcels.
struct ParcelLook {
  bool true_size = false;   // without the scene's drawn_area_fraction
  double min_px = 0.0;      // layout pixels; smaller ones are drawn as wide as this; 0: they are counted
  bool as_squares = false;  // each a square of its own: also for discs beyond GL's largest point
};

class Renderer {
 public:
  Renderer();  // throws DeviceError if a shader is missing or does not compile

  // Floor and parcels; covers the whole viewport. Needs no result of the frame's steps. parcels: null if
  // there are none to draw.
  void draw_air(const FrameView& frame, const ParcelBuffers* parcels, const Camera& camera,
                const Viewport& viewport);
  // Paths and ball, on top.
  void draw_flight(const FrameView& frame, const Camera& camera, const Viewport& viewport);

  void set_look(const Look& look) { look_ = look; }
  void set_parcel_size(const ParcelLook& look) { parcel_look_ = look; }

 private:
  // The view that the kept picture of the floor belongs to.
  struct FloorKey {
    Vec2d center_m, anchor_px;
    double metres_per_px = 0.0;
    SizePx size;
    double width_m = 0.0;
    double height_m = 0.0;
    Boundary boundary = Boundary::open;
    Theme theme = Theme::dark;
    bool images = false;
    Vec2i origin_px{};
    bool transparent = false;
    float scale = 0.0F;
    bool operator==(const FloorKey&) const = default;
  };
  struct PathVertex {
    Vec2f position_m, normal;
    Vec2f along;                       // 0 at the oldest point to 1 at the newest; metres from the oldest
    Vec2f previous_m, previous_along;  // of the point before
  };
  struct PathStyle {
    float half_width_px;
    float color[4];
    float fade[2];         // alpha at the oldest and the newest point
    float dash_px = 0.0F;  // length of a dash and the gap after it; 0: solid
  };

  void set_view(const Camera& camera, const Viewport& viewport);
  void keep_floor(const FrameView& frame, const Camera& camera, const Viewport& viewport);
  void paint_floor(const FloorKey& key);
  static void copy(const ColorTarget& picture, const Viewport& viewport);
  void bind_for_blending(const Viewport& viewport);
  double parcel_diameter_px(const FrameView& frame, const Camera& camera, float scale) const;
  void draw_counted(const FrameView& frame, const ParcelBuffers& parcels, const std::vector<Camera>& images,
                    const Viewport& viewport);
  void draw_discs(const FrameView& frame, const ParcelBuffers& parcels, const Camera& camera,
                  const Viewport& viewport);
  void draw_discs(const FrameView& frame, const ParcelBuffers& parcels, std::uint32_t num,
                  double diameter_px);
  SplatStyle splat_style(const FrameView& frame, const Camera& camera, double diameter_px) const;
  void draw_paths(const FrameView& frame, const Camera& camera, float scale);
  void draw_moving(const FrameView& frame, const Camera& camera, float scale);
  void draw_ghosts(const std::vector<Ghost>& ghosts, const Camera& camera, float scale);
  void draw_path(const std::vector<Vec2f>& points_m, const Camera& camera, const PathStyle& style);
  void draw_ball(const FrameView& frame, const Camera& camera);

  GlProgram court_, box_, discs_, path_, ball_;
  Splat splat_;
  GatheredParcels gathered_;
  GlBuffer view_buffer_, path_buffer_;
  GlVertexArray empty_array_, parcel_array_, path_array_;
  ColorTarget floor_, air_;  // air_: floor and counted parcels for a window
  FloorKey floor_key_;
  std::vector<Vec2f> path_points_;
  std::vector<PathVertex> path_vertices_;
  std::size_t path_capacity_ = 0;
  Look look_;
  ParcelLook parcel_look_;
  double max_point_px_ = 1.0;  // GL's limit
};

}  // namespace pf
