#include "backend/domains/domain.hpp"

namespace pf {

void Domain::count(const PixelGrid& grid, const CountStyle& style, std::vector<std::uint32_t>& pixels) {
  visit([&](const Parcel& parcel) {
    if (parcel.id % style.one_in != 0) return;
    const DrawnParcel one = drawn_parcel(slabs_.world, parcel.position, parcel.velocity);
    const std::uint32_t pixel = pixel_of(grid, one.position_m);
    if (pixel != kNoPixel) pixels[pixel] += pixel_share(style, one.speed_mps);
  });
}

void Domain::gather(const PixelGrid& grid, std::vector<DrawnParcel>& to) const {
  visit([&](const Parcel& parcel) {
    const DrawnParcel one = drawn_parcel(slabs_.world, parcel.position, parcel.velocity);
    if (pixel_of(grid, one.position_m) != kNoPixel) to.push_back(one);
  });
}

}  // namespace pf
