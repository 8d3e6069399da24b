#include "backend/domains/domain.hpp"

namespace pf {

ParcelSums Domain::sums(double mass_kg) const {
  ParcelSums sums;
  visit([&](const Parcel& parcel) {
    sums.measures += measures_of(parcel.position, parcel.velocity, mass_kg);
    sums.hash += parcel_hash(parcel.id, parcel.position, parcel.velocity);
  });
  return sums;
}

void Domain::add_to(Profile& profile) const {
  visit([&](const Parcel& parcel) { add_parcels(profile, &parcel.position, &parcel.velocity, 1); });
}

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
