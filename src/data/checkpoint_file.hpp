// A checkpoint: a run's whole state in one file. docs/data.md has the layout.
#pragma once

#include <filesystem>

#include "app/run_state.hpp"

namespace pf {

// Writes beside the file, syncs, and renames, so that a whole checkpoint exists at any time. Returns the
// number of bytes. Throws UserError if that fails; an earlier checkpoint is kept.
std::uint64_t write_checkpoint(const std::filesystem::path& file, const RunState& state);

bool is_checkpoint(const std::filesystem::path& file);

// Throws UserError with the reason for a file that is missing, foreign, cut off, damaged or of another
// format.
RunState read_checkpoint(const std::filesystem::path& file);

}  // namespace pf
