// The profile of a run for files: the last one for the report, each frame's for --profile-csv.
#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>

#include "app/simulation.hpp"

namespace pf {

// Keys: axis, simulated_s, and as lists over the bins position_m, num, area_fraction, density_per_m2,
// velocity_mps, speed_mps (null in an empty bin). null if the view has no profile.
nlohmann::json profile_report(const FrameView& view);

// Columns of the file: frame, simulated_s, and those above; a line for each bin of each frame.
class ProfileCsv {
 public:
  explicit ProfileCsv(const std::filesystem::path& file);  // throws UserError if it cannot be written
  void add_frame(const FrameView& view);
  bool broke_off() const { return !stream_; }  // the disk is full, for example

 private:
  std::ofstream file_;
  std::ostream& stream_;  // this file, or one that is open
  std::uint64_t num_frames_ = 0;
};

}  // namespace pf
