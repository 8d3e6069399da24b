// The XDMF file beside a dump: with it ParaView and VTK read the frames of a .h5.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/descriptor.hpp"

namespace pf {

// Returns whether the file begins as an index of a dump does.
bool is_xdmf(const std::filesystem::path& file);

class XdmfFile {
 public:
  struct Layout {
    std::string h5_name;  // as seen from the XDMF file
    std::uint64_t num_parcels = 0;
    bool has_velocity = false;
  };

  // Throws UserError if the file cannot be written.
  XdmfFile(const std::filesystem::path& file, Layout layout);

  // Adds frame num_frames - 1. The text is complete before and after.
  void add_frame(double time_s, std::uint64_t num_frames);

 private:
  void put(const std::string& text);
  [[noreturn]] void fail(const std::string& reason) const;

  std::string name_;
  Layout layout_;
  Descriptor stream_;
  std::int64_t end_ = 0;  // of the last frame, where the next one begins
};

}  // namespace pf
