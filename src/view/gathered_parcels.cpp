#include "view/gathered_parcels.hpp"

namespace pf {

ParcelBuffers GatheredParcels::upload(const std::vector<DrawnParcel>& parcels) {
  if (parcels.size() > capacity_ || !buffer_) {
    capacity_ = parcels.size() + parcels.size() / 2 + 64;
    buffer_ = make_buffer();
    glNamedBufferStorage(buffer_.get(), static_cast<GLsizeiptr>(capacity_ * (sizeof(Vec2f) + sizeof(float))),
                         nullptr, GL_DYNAMIC_STORAGE_BIT);
  }
  std::vector<Vec2f> position_m;
  std::vector<float> speed_mps;
  position_m.reserve(parcels.size());
  speed_mps.reserve(parcels.size());
  for (const DrawnParcel& parcel : parcels) {
    position_m.push_back(parcel.position_m);
    speed_mps.push_back(parcel.speed_mps);
  }
  const auto speeds = static_cast<GLintptr>(capacity_ * sizeof(Vec2f));
  const auto put = [&](GLintptr offset, const auto& values) {
    glNamedBufferSubData(buffer_.get(), offset, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])),
                         values.data());
  };
  put(0, position_m);
  put(speeds, speed_mps);
  return {buffer_.get(), 0, buffer_.get(), speeds, nullptr};
}

}  // namespace pf
