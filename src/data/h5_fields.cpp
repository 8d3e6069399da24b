#include "data/h5_fields.hpp"

#include <algorithm>
#include <limits>

namespace pf::h5 {
namespace {

constexpr hsize_t kParcelsInChunk = 65536;
constexpr hsize_t kFewParcels = 16;
constexpr hsize_t kRowsInChunk = 512;  // of short rows
constexpr hsize_t kBytesInChunk = 1U << 16;

// Short rows share a chunk, long ones are cut into equal parts.
std::vector<hsize_t> chunk_of(const Series::Shape& shape) {
  const std::vector<hsize_t>& row = shape.row;
  std::vector<hsize_t> chunk = {1};
  chunk.insert(chunk.end(), row.begin(), row.end());
  if (row.empty() || row[0] <= kFewParcels) {
    chunk[0] = std::clamp<hsize_t>(kBytesInChunk / H5Tget_size(shape.type), 1, kRowsInChunk);
  } else {
    const hsize_t num_parts = (row[0] + kParcelsInChunk - 1) / kParcelsInChunk;
    chunk[1] = (row[0] + num_parts - 1) / num_parts;
  }
  return chunk;
}

// Without a cache, rows go straight to the file, before the index that names them.
Handle without_cache() {
  Handle list(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose, "data set access");
  checked(H5Pset_chunk_cache(list.id(), 0, 0, 0.0), "chunk cache");
  return list;
}

}  // namespace

void Series::make(hid_t parent, const std::string& path, const Shape& shape) {
  std::vector<hsize_t> extent = {0}, limit = {H5S_UNLIMITED};
  extent.insert(extent.end(), shape.row.begin(), shape.row.end());
  limit.insert(limit.end(), shape.row.begin(), shape.row.end());
  const std::vector<hsize_t> chunk = chunk_of(shape);
  const auto rank = static_cast<int>(extent.size());
  const Handle space(H5Screate_simple(rank, extent.data(), limit.data()), H5Sclose, path.c_str());
  const Handle list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, path.c_str());
  checked(H5Pset_chunk(list.id(), rank, chunk.data()), path.c_str());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  if (shape.has_nan_fill) checked(H5Pset_fill_value(list.id(), H5T_NATIVE_FLOAT, &nan), path.c_str());
  if (shape.compression > 0 && chunk[0] == 1) {
    checked(H5Pset_shuffle(list.id()), path.c_str());
    checked(H5Pset_deflate(list.id(), static_cast<unsigned>(shape.compression)), path.c_str());
  }
  const Handle made(
      H5Dcreate2(parent, path.c_str(), shape.type, space.id(), H5P_DEFAULT, list.id(), H5P_DEFAULT), H5Dclose,
      path.c_str());
}

Series::Series(hid_t parent, const std::string& path, hid_t type)
    : dataset_(H5Dopen2(parent, path.c_str(), without_cache().id()), H5Dclose, path.c_str()),
      type_(type),
      extent_(extent_of(dataset_.id())),
      path_(path) {
  std::vector<hsize_t> count = extent_;
  count[0] = 1;
  in_memory_ =
      Handle(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose, path.c_str());
}

void Series::append(const void* row) {
  std::vector<hsize_t> start(extent_.size(), 0), count = extent_;
  start[0] = extent_[0]++;
  count[0] = 1;
  checked(H5Dset_extent(dataset_.id(), extent_.data()), path_.c_str());
  const Handle in_file(H5Dget_space(dataset_.id()), H5Sclose, path_.c_str());
  checked(H5Sselect_hyperslab(in_file.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr),
          path_.c_str());
  checked(H5Dwrite(dataset_.id(), type_, in_memory_.id(), in_file.id(), H5P_DEFAULT, row), path_.c_str());
  checked(H5Dflush(dataset_.id()), path_.c_str());
}

}  // namespace pf::h5
