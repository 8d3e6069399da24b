// Dumps as HDF5 files in the layout of H5MD 1.1 (docs/data.md), with an XDMF file beside each.
#pragma once

#include <memory>

#include "data/dump.hpp"
#include "data/state_writer.hpp"

namespace pf {

class H5DumpFile;

// Begins another file, with the first free name of NAME-2.h5 and so on, where a state does not continue the
// one before: another number of parcels, another world, a step back.
class H5Dump final : public StateSink {
 public:
  H5Dump(std::filesystem::path file, DumpFormat format);
  ~H5Dump() override;

  void write(const RunState& state) override;
  void finish() override;
  std::uint64_t num_bytes() const override;
  std::vector<std::filesystem::path> further_files() const override { return further_files_; }

 private:
  std::filesystem::path next_file();

  std::filesystem::path path_;
  DumpFormat format_;
  std::unique_ptr<H5DumpFile> file_;
  int number_ = 0;  // of the last file's name
  std::vector<std::filesystem::path> further_files_;
  std::uint64_t num_bytes_before_ = 0;
};

}  // namespace pf
