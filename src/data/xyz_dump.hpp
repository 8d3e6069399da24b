// Extended XYZ: text that OVITO and ASE read. A frame has the parcels that are in the world, with their ids.
#pragma once

#include <filesystem>
#include <string>

#include "core/descriptor.hpp"
#include "data/state_writer.hpp"

namespace pf {

class XyzDump final : public StateSink {
 public:
  // Throws UserError if the file cannot be opened.
  explicit XyzDump(std::filesystem::path file);

  void write(const RunState& state) override;
  void finish() override;
  std::uint64_t num_bytes() const override { return num_bytes_; }

 private:
  std::filesystem::path file_;
  Descriptor stream_;
  std::uint64_t num_bytes_ = 0;
};

// Text of one frame.
std::string xyz_frame(const RunState& state);

}  // namespace pf
