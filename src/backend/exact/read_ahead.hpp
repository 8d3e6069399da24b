// Method `exact` on the CPU: has memory in the cache before loops over many parcels need it.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <initializer_list>

#include "backend/exact/broad_phase.hpp"

namespace pf {

// Reads arrays of the parcels ahead of a loop that visits parcels in ascending order: each line once, up to
// the neighbours of the parcels that are visited soon, which lie within a row of cells. It reads, since
// prefetch instructions did not help on an EPYC when the parcels exceeded its cache.
class ReadAhead {
 public:
  // of_4, of_8: arrays of 4 and of 8 bytes a parcel. A loop is left to itself if the cache holds all parcels
  // or if it visits fewer than one in kSparse.
  ReadAhead(const DiscSpace& space, std::size_t num_visits, std::initializer_list<const void*> of_4,
            std::initializer_list<const void*> of_8)
      : space_(space),
        is_active_(space.num_parcels >= kFewest && num_visits * kSparse >= space.num_parcels &&
                   !space.all_pairs && space.cell_start != nullptr) {
    assert(of_4.size() + of_8.size() <= kMaxArrays);
    for (const void* array : of_4) arrays_[num_++] = {static_cast<const char*>(array), 4};
    for (const void* array : of_8) arrays_[num_++] = {static_cast<const char*>(array), 8};
  }

  bool is_active() const { return is_active_; }

  // Parcel i is visited soon.
  void reach(std::uint32_t i) {
    const GridShape& grid = space_.grid;
    const Vec2i centre{static_cast<std::int32_t>(space_.x[i]), static_cast<std::int32_t>(space_.y[i])};
    const std::uint32_t above = cell_key(grid, centre) + static_cast<std::uint32_t>(grid.x.num) + 2;
    const std::uint32_t end = space_.cell_start[std::min(above, grid.num_cells())];
    if (end > next_ + kMaxCaughtUp) next_ = end - kMaxCaughtUp;
    for (; next_ < end; next_ += kLine) read();
  }

 private:
  static constexpr std::size_t kFewest = 130'000, kSparse = 64, kMaxArrays = 12;
  static constexpr std::uint32_t kLine = 16;           // parcels whose 4 bytes each fill a line of the cache
  static constexpr std::uint32_t kMaxCaughtUp = 4096;  // parcels that are caught up with

  struct Array {
    const char* data;
    std::uint32_t bytes;
  };

  // Other threads may write meanwhile; what is read does not matter.
  __attribute__((no_sanitize("thread"))) void read() const {
    const std::uint32_t last = space_.num_parcels - 1;
    for (unsigned k = 0; k < num_; ++k) {
      const auto [data, bytes] = arrays_[k];
      for (std::uint32_t i = next_; i < next_ + kLine; i += 64 / bytes)
        static_cast<void>(*static_cast<const volatile char*>(data + std::size_t{bytes} * std::min(i, last)));
    }
  }

  const DiscSpace& space_;
  bool is_active_;
  std::uint32_t next_ = 0;
  unsigned num_ = 0;
  Array arrays_[kMaxArrays];
};

}  // namespace pf
