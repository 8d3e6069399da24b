// Refuses settings that a run divided into domains does not support.
#pragma once

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

// Throws UserError, with a remedy, if the backend cannot fly these settings: a method, or slabs that are too
// thin for the parcels. physics: derived from the settings.
void check_backend(const Settings& settings, const Physics& physics, const Backend& backend);

}  // namespace pf
