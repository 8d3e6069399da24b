// The parcels of a picture, gathered from several memories, as GL buffers.
#pragma once

#include <cstddef>
#include <vector>

#include "view/gl.hpp"
#include "view/parcel_buffers.hpp"

namespace pf {

class GatheredParcels {
 public:
  // Valid until the next call.
  ParcelBuffers upload(const std::vector<DrawnParcel>& parcels);

 private:
  GlBuffer buffer_;
  std::size_t capacity_ = 0;  // parcels
};

}  // namespace pf
