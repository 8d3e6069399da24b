// Step requests from settings.
#pragma once

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

// num_steps of dt_s with method, search and contact durations of the settings. Draws nothing. physics:
// derived from the same settings.
StepRequest step_request(const Settings& settings, const Physics& physics, std::uint32_t num_steps,
                         double dt_s);

}  // namespace pf
