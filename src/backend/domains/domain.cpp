#include "backend/domains/domain.hpp"

#include "backend/time_step/step_loop.hpp"

namespace pf {

DrawnParcel drawn_parcel(const World& world, const Parcel& parcel) {
  DrawnParcel drawn;
  draw_parcel({&drawn.position_m, &drawn.speed_mps, 1}, world, 0, parcel.position, parcel.velocity);
  return drawn;
}

void Domain::count(const PixelGrid& grid, const CountStyle& style, std::vector<std::uint32_t>& pixels) {
  visit([&](const Parcel& parcel) {
    if (parcel.id % style.one_in != 0) return;
    const DrawnParcel one = drawn_parcel(slabs_.world, parcel);
    const std::uint32_t pixel = pixel_of(grid, one.position_m);
    if (pixel != kNoPixel) pixels[pixel] += pixel_share(style, one.speed_mps);
  });
}

void Domain::gather(const PixelGrid& grid, std::vector<DrawnParcel>& to) const {
  visit([&](const Parcel& parcel) {
    const DrawnParcel one = drawn_parcel(slabs_.world, parcel);
    if (pixel_of(grid, one.position_m) != kNoPixel) to.push_back(one);
  });
}

}  // namespace pf
