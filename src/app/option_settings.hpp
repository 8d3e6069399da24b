// The settings of a command line: a scene or a list of cues, then --set, then the flags.
#pragma once

#include "app/option_flags.hpp"

namespace pf {

Settings read_settings(const Typed& typed, const char* default_scene);

// Reads --cues. What the command line sets holds for every cue. Refuses options that choose another scene.
void read_cues(const Typed& typed, Options& options);

}  // namespace pf
