// All of a run's state but its arrays, as JSON on one line: part of checkpoints and of each frame of a dump.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "app/run_state.hpp"

namespace pf {

// Every setting as "section.key = value".
std::vector<std::string> settings_lines(const Settings& settings);

// base: lines of settings that the reader has; only those that differ are stored. Keys are those of RunState.
std::string run_state_text(const RunState& state, const std::vector<std::string>& base);

// The state, with the arrays of `state`. Throws UserError, which begins with `where`, for text that is not
// such a state.
RunState run_state_from_text(const std::string& text, const std::vector<std::string>& base,
                             const std::string& where, RunState state = {});

}  // namespace pf
