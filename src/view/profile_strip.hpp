// A strip under the court: density, velocity and temperature of the parcels along x, at the x of the picture
// above it; or by distance from the middle, on both sides of it.
#pragma once

#include "view/scene_marks.hpp"

namespace pf {

// Height of the strip; 0 if the frame has no profile.
double profile_strip_height_px(const FrameView& frame, float scale);
// What the strip at its bottom leaves of a region: half of it at least.
ViewRegion above_profile_strip(const ViewRegion& all, const FrameView& frame, float scale);

// Returns its rectangle: left, top, width, height; all 0 if there is none.
std::array<float, 4> show_profile_strip(const FrameView& frame, const ScenePlace& scene);

}  // namespace pf
