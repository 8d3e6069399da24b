// The interface to dumps, which the program has with or without HDF5.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "data/state_writer.hpp"

namespace pf {

struct DumpFormat {
  bool has_velocity = true;
  bool has_state = true;  // exact positions, and what `exact` needs: a run can start from it
  int compression = 0;    // 0 (off) to 9
};

// Throws UserError if this build has no HDF5.
std::unique_ptr<StateSink> make_h5_dump(const std::filesystem::path& file, const DumpFormat& format);

// A frame of a dump as a state to go on from; none: the last one. Throws UserError if the file is no dump,
// has no such frame, or lacks what a start needs.
RunState read_h5_frame(const std::filesystem::path& file, std::optional<std::int64_t> frame);

}  // namespace pf
