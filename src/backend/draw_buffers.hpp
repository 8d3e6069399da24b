// Memory into which a backend writes the picture's data in the last step of a frame.
#pragma once

#include <cmath>
#include <cstddef>

#include "core/host_device.hpp"
#include "core/vec2.hpp"
#include "model/world.hpp"

namespace pf {

// All arrays have `capacity` entries, one per parcel in any order. Null: not needed.
struct DrawBuffers {
  Vec2f* position_m = nullptr;  // of a retired parcel: far outside
  float* speed_mps = nullptr;
  std::size_t capacity = 0;
  bool on_device = false;  // device memory; else host memory
};

constexpr float kOutOfSight_m = 1e9F;

struct DrawnParcel {
  Vec2f position_m;
  float speed_mps = 0.0F;
};

PF_HD inline DrawnParcel drawn_parcel(const World& world, Vec2i position, Vec2f velocity) {
  const bool gone = is_retired(position);
  return {gone ? Vec2f{kOutOfSight_m, kOutOfSight_m} : to_float(to_metres(world, position)),
          sqrtf(velocity.x * velocity.x + velocity.y * velocity.y)};
}

// Writes a parcel's entries.
PF_HD inline void draw_parcel(const DrawBuffers& buffers, const World& world, std::size_t i, Vec2i position,
                              Vec2f velocity) {
  const DrawnParcel drawn = drawn_parcel(world, position, velocity);
  buffers.position_m[i] = drawn.position_m;
  buffers.speed_mps[i] = drawn.speed_mps;
}

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
