// Pictures of any size: the film's picture enlarged, with its text and its lines, drawn in tiles where GL's
// images are smaller.
#pragma once

#include <cstdint>
#include <vector>

#include "view/capture.hpp"
#include "view/film_scene.hpp"

namespace pf {

// height * width * 4 bytes, bottom row first.
struct Pixels {
  std::vector<std::uint8_t> rgba;
  SizePx size;
  PngAlpha alpha = PngAlpha::left_out;
};

struct LargePictureRequest {
  SizePx size;
  int max_tile_px = 0;       // largest side of a tile; 0: what GL allows
  bool transparent = false;  // without ground, overlay and legend
};

// The state that is drawn, and the view of it that the window shows.
struct PictureScene {
  const FrameView* frame = nullptr;
  const ParcelBuffers* parcels = nullptr;  // null: nothing has been drawn
  const Camera* window = nullptr;
  ViewRegion seen;     // what is free for the scene in the window
  float scale = 1.0F;  // of the text in a picture of the window's size
  SizePx window_size;
  const Overlay* overlay = nullptr;  // null: neither overlay nor marks
  OverlayMode mode = OverlayMode::full;
  Look look;
  MagnifierMode magnifier = MagnifierMode::automatic;
  CueTitle* title = nullptr;  // of a cue; null: none
  Gui* window_gui = nullptr;  // current before and after
};

// Parts of a picture: origin and size of each tile.
struct Tile {
  Vec2i origin_px;
  SizePx size;
};
std::vector<Tile> tiles_of(SizePx picture, int max_tile_px);

// Every division into tiles gives the same pixels. Throws DeviceError if GL has no memory for a tile.
Pixels draw_large_picture(const LargePictureRequest& request, const PictureScene& scene);

}  // namespace pf
