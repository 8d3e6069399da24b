// Memory into which a backend writes the picture's data in the last step of a frame.
#pragma once

#include <cstddef>

#include "core/vec2.hpp"

namespace pf {

// All arrays have `capacity` entries, one per parcel in any order. Null: not needed.
struct DrawBuffers {
  Vec2f* position_m = nullptr;  // of a retired parcel: far outside
  float* speed_mps = nullptr;
  std::size_t capacity = 0;
  bool on_device = false;  // device memory; else host memory
};

constexpr float kOutOfSight_m = 1e9F;

enum class DrawTargetKind { interop, staged, host, images };

constexpr const char* kDrawTargetNames[] = {"interop", "staged", "host", "images"};

// Owner of draw memory on the view's side. map() returns memory that is safe to write until unmap(). After
// unmap() the renderer may draw from it.
class DrawTarget {
 public:
  virtual ~DrawTarget() = default;
  virtual DrawTargetKind kind() const = 0;
  // Provides room for num_parcels. Existing memory is kept if it suffices. Called before map().
  virtual void reserve(std::size_t num_parcels) = 0;
  // Null pointers: nothing is to be written.
  virtual DrawBuffers map() = 0;
  virtual void unmap() = 0;
};

}  // namespace pf
