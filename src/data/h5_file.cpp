#include "data/h5_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>

#include "core/error.hpp"
#include "core/link_target.hpp"
#include "core/replace_file.hpp"

namespace pf::h5 {
namespace {

namespace fs = std::filesystem;

constexpr hsize_t kPageBytes = 4096;
// Offsets in a superblock of version 3.
constexpr std::size_t kSuperblockBytes = 48;
constexpr std::size_t kVersionAt = 8, kFlagsAt = 11, kEndAt = 28, kChecksumAt = 44;

Handle access_list() {
  Handle list(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  checked(H5Pset_libver_bounds(list.id(), H5F_LIBVER_V110, H5F_LIBVER_V110), "format 1.10");
  return list;
}

// No object of the file's metadata that fits into a page lies across two: a kill may end a write between
// pages.
Handle creation_list() {
  Handle list(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "file creation");
  checked(H5Pset_file_space_strategy(list.id(), H5F_FSPACE_STRATEGY_PAGE, false, 1), "space by pages");
  checked(H5Pset_file_space_page_size(list.id(), kPageBytes), "size of pages");
  return list;
}

[[noreturn]] void fail(const fs::path& file) {
  throw DeviceError(file.string() + ": cannot be written: " + std::strerror(errno));
}

std::uint32_t little_endian(const std::uint8_t* bytes, std::size_t num) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < num; ++k) value |= static_cast<std::uint32_t>(bytes[k]) << (8 * k);
  return value;
}

}  // namespace

std::uint32_t lookup3(const std::uint8_t* bytes, std::size_t num_bytes) {
  std::uint32_t a = 0xDEADBEEFU + static_cast<std::uint32_t>(num_bytes), b = a, c = a;
  for (; num_bytes > 12; bytes += 12, num_bytes -= 12) {
    a += little_endian(bytes, 4);
    b += little_endian(bytes + 4, 4);
    c += little_endian(bytes + 8, 4);
    a = (a - c) ^ std::rotl(c, 4), c += b;
    b = (b - a) ^ std::rotl(a, 6), a += c;
    c = (c - b) ^ std::rotl(b, 8), b += a;
    a = (a - c) ^ std::rotl(c, 16), c += b;
    b = (b - a) ^ std::rotl(a, 19), a += c;
    c = (c - b) ^ std::rotl(b, 4), b += a;
  }
  if (num_bytes == 0) return c;
  a += little_endian(bytes, std::min<std::size_t>(num_bytes, 4));
  if (num_bytes > 4) b += little_endian(bytes + 4, std::min<std::size_t>(num_bytes - 4, 4));
  if (num_bytes > 8) c += little_endian(bytes + 8, num_bytes - 8);
  c = (c ^ b) - std::rotl(b, 14);
  a = (a ^ c) - std::rotl(c, 11);
  b = (b ^ a) - std::rotl(a, 25);
  c = (c ^ b) - std::rotl(b, 16);
  a = (a ^ c) - std::rotl(c, 4);
  b = (b ^ a) - std::rotl(a, 14);
  return (c ^ b) - std::rotl(b, 24);
}

GrowingFile::GrowingFile(const fs::path& file, const std::function<void(hid_t)>& fill) : path_(file) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const fs::path target = link_target(file);
  const fs::path aside = part_of(target);
  std::error_code error;
  try {
    make(aside, fill);
    fs::rename(aside, target, error);
    if (error) throw DeviceError(path_.string() + ": cannot be written: " + error.message());
  } catch (...) {
    fs::remove(aside, error);
    throw;
  }
}

void GrowingFile::make(const fs::path& file, const std::function<void(hid_t)>& fill) {
  {
    Handle made(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, creation_list().id(), access_list().id()), H5Fclose,
                file.c_str());
    fill(made.id());
    if (!made.reset()) checked(-1, file.c_str());
  }
  file_ = Handle(H5Fopen(file.c_str(), H5F_ACC_RDWR | H5F_ACC_SWMR_WRITE, access_list().id()), H5Fclose,
                 path_.c_str());
  superblock_ = Descriptor(::open(file.c_str(), O_RDWR | O_CLOEXEC));
  if (!superblock_.is_open()) fail(path_);
  reserve(0);
}

std::uint64_t GrowingFile::num_bytes() const {
  haddr_t end = 0;
  if (file_.id() >= 0) H5Fget_eoa(file_.id(), &end);
  return end;
}

void GrowingFile::put_superblock(std::uint64_t end) {
  std::array<std::uint8_t, kSuperblockBytes> block{};
  if (::pread(superblock_.get(), block.data(), block.size(), 0) != static_cast<ssize_t>(block.size()))
    fail(path_);
  if (block[kVersionAt] != 3)
    throw DeviceError(path_.string() + ": HDF5 has written another superblock than expected");
  block[kFlagsAt] = 0;
  for (std::size_t k = 0; k < 8; ++k) block[kEndAt + k] = static_cast<std::uint8_t>(end >> (8 * k));
  const std::uint32_t checksum = lookup3(block.data(), kChecksumAt);
  for (std::size_t k = 0; k < 4; ++k) block[kChecksumAt + k] = static_cast<std::uint8_t>(checksum >> (8 * k));
  if (::pwrite(superblock_.get(), block.data(), block.size(), 0) != static_cast<ssize_t>(block.size()))
    fail(path_);
}

// The file is longer before its superblock says so.
void GrowingFile::reserve(std::uint64_t num_bytes_more) {
  constexpr std::uint64_t kSlack = 1U << 20;  // of HDF5's indices
  const std::uint64_t needed = num_bytes() + num_bytes_more + kSlack;
  if (needed <= reserved_) return;
  constexpr std::uint64_t kMaxAhead = 64 * kSlack;
  reserved_ = needed + std::min(4 * num_bytes_more, kMaxAhead) + 4 * kSlack;
  if (::ftruncate(superblock_.get(), static_cast<off_t>(reserved_)) != 0) fail(path_);
  put_superblock(reserved_);
}

// Closing truncates the file, so its end is put right before. Then it is that of the superblock.
void GrowingFile::finish() {
  put_superblock(num_bytes());
  if (!file_.reset()) checked(-1, path_.c_str());
  std::uint64_t end = 0;
  const bool is_known = ::pread(superblock_.get(), &end, sizeof end, kEndAt) == sizeof end;
  if (!is_known || ::ftruncate(superblock_.get(), static_cast<off_t>(end)) != 0 || !superblock_.close())
    fail(path_);
}

}  // namespace pf::h5
