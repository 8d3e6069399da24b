// Method `exact` at a moment between two steps: all that decides how it goes on.
#pragma once

#include <cstdint>
#include <vector>

#include "core/vec2.hpp"
#include "model/exact/step_plan.hpp"

namespace pf {

struct ExactSnapshot {
  BallState ball;
  bool ball_is_new = false;  // set from outside since the last step
  double time_s = 0.0;       // of completed steps of the method since the reset
  bool active = false;       // otherwise the parcels have no trajectories, and what follows is empty
  RunConstants run;
  ExactProgress progress;
  // By id. The velocities are those of the parcels.
  std::vector<Vec2i> anchor;
  std::vector<std::uint32_t> tick;
  std::vector<std::uint32_t> last_contact_tick;  // with a contact clock only
};

}  // namespace pf
