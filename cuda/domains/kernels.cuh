// Kernels of a domain on a GPU, beside those of steps and sorts. Lists are filled in any order.
#pragma once

#include "backend/backend.hpp"
#include "backend/domains/domain.hpp"
#include "cuda/cell_sort.cuh"

namespace pf {

// Id of a parcel that the next sort drops: it has left the slab, or is a ghost of the last sort.
constexpr std::uint32_t kDroppedId = UINT32_MAX;

// Indices of parcels; count: how many so far.
struct IndexList {
  std::uint32_t* index = nullptr;
  std::uint32_t* count = nullptr;
};

// The margins of slabs.
struct SlabMargins {
  Slabs::Span slab[kMaxDomains];
  unsigned num, own;    // slabs, and the one that all parcels are in
  std::int64_t margin;  // position units
  std::int64_t extent;  // along x, of a periodic world; else 0
};
// Lists of the parcels of the world: own ones that are not inside (low <= x < high), and the others that are
// within the margin of another slab. num_near[k]: of the latter those within the margin of slab k.
struct BorderLists {
  Slabs::Span inside;
  IndexList left, near;
  std::uint32_t* num_near;
};
// Adds parcels from `first` on to the lists. Drops ghosts.
void launch_find_borders(const ParcelPointers& parcels, std::uint32_t first, std::uint32_t num,
                         const SlabMargins& slabs, const BorderLists& lists, cudaStream_t stream);
// The same for all parcels but those that were in columns first_inner <= column < end_inner at the sort.
struct SortedColumns {
  GridShape grid;
  const std::uint32_t* cell_start;
  std::uint32_t first_inner, end_inner;
};
void launch_find_borders_in_columns(const ParcelPointers& parcels, const SortedColumns& columns,
                                    const SlabMargins& slabs, const BorderLists& lists, cudaStream_t stream);
// Drops the parcels of a list.
void launch_drop(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t num,
                 cudaStream_t stream);
// Lists of the near parcels within the margin of each slab k: an index goes to index[next[k]++].
struct DividedList {
  std::uint32_t* next;
  std::uint32_t* index;
};
void launch_divide_by_slab(const ParcelPointers& parcels, const std::uint32_t* near, std::uint32_t num,
                           const SlabMargins& slabs, const DividedList& divided, cudaStream_t stream);

// to[k]: parcel index[k], without bits in its id.
void launch_gather(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t num, Parcel* to,
                   cudaStream_t stream);
// Writes parcels to places `first` and following. id_bits: added to their ids.
void launch_append(const Parcel* parcels, std::uint32_t num, std::uint32_t id_bits, std::uint32_t first,
                   const ParcelPointers& to, cudaStream_t stream);
// index[k] = first + k.
void launch_count_up(std::uint32_t first, std::uint32_t num, std::uint32_t* index, cudaStream_t stream);

// Counts the parcels from `first` on that are not dropped. The others get no cell.
void launch_count_kept(const GridShape& grid, const ParcelPointers& parcels, std::uint32_t first,
                       std::uint32_t num, const SortKeys& keys, cudaStream_t stream);

// Adds the shares of own parcels, every one_in-th id, to the pixels of a picture.
struct CountedPicture {
  PixelGrid grid;
  CountStyle style;
  std::uint32_t* pixels;
};
void launch_count_pixels(const ParcelPointers& parcels, std::uint32_t num, const World& world,
                         const CountedPicture& picture, cudaStream_t stream);
// Lists own parcels in the picture.
void launch_find_seen(const ParcelPointers& parcels, std::uint32_t num, const World& world,
                      const PixelGrid& grid, const IndexList& seen, cudaStream_t stream);

// motion[k] of parcel index[k], and the reverse.
void launch_pack(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t num,
                 ParcelMotion* motion, cudaStream_t stream);
void launch_unpack(const ParcelMotion* motion, const std::uint32_t* index, std::uint32_t num,
                   const ParcelPointers& parcels, cudaStream_t stream);

}  // namespace pf
