// Kernels of a domain on a GPU, beside those of steps and sorts. Lists are filled in any order.
#pragma once

#include "backend/domains/domain.hpp"
#include "cuda/cell_sort.cuh"

namespace pf {

// Id of a parcel that the next sort drops: it has left the slab, or is a copy of before.
constexpr std::uint32_t kDroppedId = UINT32_MAX;

// Parcels and where they lie; count: how many so far.
struct ParcelList {
  ParcelPointers parcels;
  std::uint32_t* index = nullptr;  // null: not wanted
  std::uint32_t* count = nullptr;
};

// A parcel is inside if first <= x < end, position units.
struct SlabRange {
  std::int64_t first, end;
};

// Lists own parcels that are outside, and drops these and all copies.
void launch_release(const ParcelPointers& parcels, std::uint32_t num, const SlabRange& slab,
                    const ParcelList& left, cudaStream_t stream);

// Lists parcels of the world that are neither dropped nor strictly between inner.first and inner.end.
void launch_find_margins(const ParcelPointers& parcels, std::uint32_t num, const SlabRange& inner,
                         const ParcelList& near, cudaStream_t stream);

// Writes parcels, `num` in device memory, to places `first` and following. id_bits: added to their ids.
void launch_append(const Parcel* parcels, std::uint32_t num, std::uint32_t id_bits, std::uint32_t first,
                   const ParcelPointers& to, cudaStream_t stream);

// Counts the parcels that are not dropped. The others get no cell.
void launch_count_kept(const GridShape& grid, const ParcelPointers& parcels, std::uint32_t num,
                       const SortKeys& keys, cudaStream_t stream);

// motion[k] of parcel index[k], and the reverse.
void launch_pack(const ParcelPointers& parcels, const std::uint32_t* index, std::uint32_t num,
                 ParcelMotion* motion, cudaStream_t stream);
void launch_unpack(const ParcelMotion* motion, const std::uint32_t* index, std::uint32_t num,
                   const ParcelPointers& parcels, cudaStream_t stream);

}  // namespace pf
