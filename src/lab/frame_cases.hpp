// Frames of flights over the court, for the stability study: how much longer the worst one takes than the
// mean.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "backend/backend.hpp"
#include "model/methods.hpp"
#include "scene/settings.hpp"

namespace pf {

// A court with one setting changed.
struct FrameCase {
  const char* axis = "";  // name of the setting
  double value = 0.0;     // its value
  Settings settings;      // with method
};

// Cases along the four axes: restitution, number of parcels, area fraction and speed of the ball. `exact` has
// those of restitution below 1 twice, the second time without a contact duration.
std::vector<FrameCase> frame_cases(Method method, bool quick);

// Flies the case on two threads until the ball has left or a limit of time is reached. Repeats the flight 4
// to 8 times and keeps each frame's shortest time, to exclude the load of other programs. Keys: axis, value,
// method, contact_clock, flights, frames, mean_ms, median_ms, worst_ms, worst_over_mean, flown_s, refused,
// max_overlap.
nlohmann::json measure_frames(const FrameCase& flight, bool quick);

}  // namespace pf
