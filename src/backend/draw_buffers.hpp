// Memory that a backend may write what is drawn into, in the last step of a frame.
#pragma once

#include <cstddef>

#include "core/vec2.hpp"

namespace pf {

// All arrays have `capacity` entries, one per parcel in any order. Null: not wanted.
struct DrawBuffers {
  Vec2f* position_m = nullptr;  // retired parcels are put far outside
  float* speed_mps = nullptr;
  std::size_t capacity = 0;
  bool on_device = false;  // device memory; else host memory
};

constexpr float kOutOfSight_m = 1e9F;

enum class DrawTargetKind { interop, staged, host };

constexpr const char* kDrawTargetNames[] = {"interop", "staged", "host"};

// Owner of draw memory on the view's side. map() hands out memory that is safe to write until unmap(); after
// unmap() the renderer may draw from it.
class DrawTarget {
 public:
  virtual ~DrawTarget() = default;
  virtual DrawTargetKind kind() const = 0;
  // Makes room for num_parcels; keeps what it has if that is enough.
  virtual void reserve(std::size_t num_parcels) = 0;
  virtual DrawBuffers map() = 0;
  virtual void unmap() = 0;
};

}  // namespace pf
