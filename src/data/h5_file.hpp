// An HDF5 file that grows while others may read it, and that opens after its writer was killed at any moment.
//
// HDF5's SWMR mode orders its writes: data, then index, then the data set's extent. So what a reader finds is
// whole at any time. But the mode leaves flags in the superblock (bytes 0 to 47) with which the file cannot
// be opened after a crash without repair, and an end of file that it updates only when the file is closed.
// put_superblock() writes these 48 bytes: no flags, and an end of file up to which the file has been extended
// beforehand. A kill may also end a write, at a border of two pages of the system's memory; so metadata lie
// in pages of that size, and none that fits into one lies across two.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/descriptor.hpp"
#include "data/h5.hpp"

namespace pf::h5 {

class GrowingFile {
 public:
  // Creates the file under a temporary name, calls `fill` to create groups and data sets, and renames it once
  // it is readable. Throws DeviceError.
  GrowingFile(const std::filesystem::path& file, const std::function<void(hid_t)>& fill);

  hid_t id() const { return file_.id(); }
  // Extends the file so that num_bytes_more can be written. Must be called before they are.
  void reserve(std::uint64_t num_bytes_more);
  // Closes the file, with its exact size. All data sets must be closed.
  void finish();
  std::uint64_t num_bytes() const;  // used so far

 private:
  void make(const std::filesystem::path& file, const std::function<void(hid_t)>& fill);
  void put_superblock(std::uint64_t end);

  std::filesystem::path path_;
  Descriptor superblock_;  // of the same file; closed last
  Handle file_;
  std::uint64_t reserved_ = 0;
};

// HDF5's checksum of metadata: lookup3 of Bob Jenkins (2006, public domain), hashlittle() with 0.
std::uint32_t lookup3(const std::uint8_t* bytes, std::size_t num_bytes);

}  // namespace pf::h5
