#include "backend/profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backend/backend.hpp"

namespace pf {
namespace {

double area_of_bin(const ProfileShape& shape, std::size_t bin) {
  const double width = profile_extent_m(shape) / shape.num_bins;
  if (shape.axis == ProfileAxis::x) return width * 2.0 * shape.world.half.y * shape.world.unit_m;
  return kPi * width * width * (2.0 * static_cast<double>(bin) + 1.0);
}

}  // namespace

ProfileShape profile_shape(const Physics& physics, ProfileAxis axis, std::uint32_t num_bins) {
  int exponent = 0;
  std::frexp(physics.reference_speed_mps, &exponent);
  return {axis, std::clamp(num_bins, 1U, kMaxProfileBins), physics.world, std::ldexp(1.0, exponent - 30)};
}

Profile empty_profile(const ProfileShape& shape) {
  const std::size_t num = shape.axis == ProfileAxis::off ? 0 : shape.num_bins;
  return {shape, std::vector<ProfileSums>(num)};
}

void add_parcels(Profile& profile, const Vec2i* position, const Vec2f* velocity, std::size_t num) {
  if (profile.bins.empty()) return;
  for (std::size_t i = 0; i < num; ++i) {
    if (is_retired(position[i])) continue;
    const ProfilePlace place = profile_place(profile.shape, position[i]);
    if (place.bin >= profile.bins.size()) continue;
    profile.bins[place.bin] += profile_sums(profile.shape, place.direction, velocity[i]);
  }
}

std::vector<ProfileRow> rows_of(const Profile& profile, const ParcelConstants& parcels) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const ProfileShape& shape = profile.shape;
  const double width = profile_extent_m(shape) / shape.num_bins;
  const double first = shape.axis == ProfileAxis::x ? -0.5 * profile_extent_m(shape) : 0.0;
  std::vector<ProfileRow> rows;
  for (std::size_t k = 0; k < profile.bins.size(); ++k) {
    const ProfileSums& sums = profile.bins[k];
    ProfileRow row;
    row.position_m = first + (static_cast<double>(k) + 0.5) * width;
    row.num = sums.num;
    row.density_per_m2 = static_cast<double>(sums.num) / area_of_bin(shape, k);
    row.area_fraction = row.density_per_m2 * kPi * parcels.radius_m * parcels.radius_m;
    const double per_parcel = sums.num > 0 ? shape.unit_mps / static_cast<double>(sums.num) : kNone;
    row.velocity_mps = static_cast<double>(sums.along) * per_parcel;
    const double across = static_cast<double>(sums.across) * per_parcel;
    const double square = static_cast<double>(sums.square) * per_parcel * shape.unit_mps * kProfileSquareUnit;
    const double c2 = 0.5 * (square - row.velocity_mps * row.velocity_mps - across * across);
    row.speed_mps = std::sqrt(c2 < 0.0 ? 0.0 : c2);  // NaN stays
    rows.push_back(row);
  }
  return rows;
}

Profile Backend::profile(const ProfileShape& shape) {
  Profile profile = empty_profile(shape);
  const ParcelSnapshot state = snapshot();
  add_parcels(profile, state.position.data(), state.velocity.data(), state.position.size());
  return profile;
}

}  // namespace pf
