// A strip under the court: density, velocity and temperature of the parcels along x, at the x of the picture
// above it; or by distance from the middle, on both sides of it.
#pragma once

#include "view/scene_marks.hpp"

namespace pf {

// The part of a region above the strip at its bottom: at least half of it, all of it without a profile.
ViewRegion above_profile_strip(const ViewRegion& all, const FrameView& frame, float scale);
OverlayPlace above_profile_strip(const OverlayPlace& all, const FrameView& frame);

// Returns its rectangle: x0, y0, x1, y1; all 0 if there is none.
std::array<float, 4> show_profile_strip(const FrameView& frame, const ScenePlace& scene);

}  // namespace pf
