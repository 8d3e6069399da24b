// What a backend is asked for, from the settings.
#pragma once

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

// num_steps of dt_s by the settings' method, search and contact durations; nothing is drawn.
StepRequest step_request(const Settings& settings, std::uint32_t num_steps, double dt_s);

}  // namespace pf
