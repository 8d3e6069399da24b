// The second of two flights in one picture, of the window or of the film: in its half or over the first one.
#pragma once

#include <optional>

#include "app/flight_pair.hpp"
#include "view/overlay.hpp"
#include "view/parcel_buffers.hpp"
#include "view/renderer.hpp"
#include "view/split_card.hpp"
#include "view/split_layout.hpp"
#include "view/split_switches.hpp"

namespace pf {

// The contents of every picture of two flights.
struct SplitScene {
  const FlightPair* pair = nullptr;
  SplitMode mode = SplitMode::halves;
  double share = 0.5;       // of the first half
  ParcelBuffers parcels;    // of the second flight
  Look look;                // of the first one
  bool is_grabbed = false;  // the divider
};

class SplitPicture {
 public:
  // Places everything in the part of the picture that is free. Returns the first flight's region.
  ViewRegion lay_out(const SplitScene& scene, const ViewRegion& free, float scale);
  const SplitLayout& layout() const { return layout_; }

  // The second half's floor and parcels, into memory; needs no result of the frame's steps. camera: of the
  // first flight.
  void draw_air(const SplitScene& scene, const Camera& camera, const Viewport& viewport);
  // The second flight's path and ball, and its half, over the first one's picture.
  void draw_flight(const SplitScene& scene, const Camera& camera, const Viewport& viewport);
  // Card, divider and names, to ImGui. height_px: of the picture.
  void describe(const SplitScene& scene, const Camera& camera, float height_px, float scale);

  // Height that the card of figures and the halves' names cover in the middle of the picture's top; 0: none.
  // Called within a frame of ImGui.
  float covered_at_top_px(const SplitScene& scene, const OverlayPlace& place, float height_px) const;
  // The camera of the second half.
  Camera second_camera(const Camera& first, const World& world, float scale) const;

 private:
  Camera half_camera(const SplitScene& scene, const Camera& camera, float scale) const;
  Viewport half_viewport(float scale) const;
  void paint_divider(const SplitScene& scene, float height_px, float scale) const;
  void paint_names(const SplitScene& scene, const Camera& camera, float height_px, float scale) const;

  std::optional<Renderer> renderer_;  // of its own: it keeps a picture of the floor for one view
  ColorTarget half_;
  SplitLayout layout_;
  SplitCard card_;
};

}  // namespace pf
