// A profile of the parcels: the sums of its bins, and the rows that follow from them.
#pragma once

#include <vector>

#include "model/profile.hpp"

namespace pf {

struct Profile {
  ProfileShape shape;
  std::vector<ProfileSums> bins;  // shape.num_bins; none if the axis is `off`
};

// A bin in physical units. In an empty bin velocity and temperature are NaN.
struct ProfileRow {
  double position_m = 0.0;  // middle of the bin: x, or distance from the origin
  std::int64_t num = 0;
  double area_fraction = 0.0;
  double density_per_m2 = 0.0;
  double velocity_mps = 0.0;  // mean, along x or away from the origin
  double speed_mps = 0.0;     // thermal, c = sqrt(kT/m): standard deviation per component about the mean
};

// physics: of a run's start, whose reference speed fixes the units. num_bins: 1 to kMaxProfileBins.
ProfileShape profile_shape(const Physics& physics, ProfileAxis axis, std::uint32_t num_bins);

// Adds parcels [0, num), retired ones left out.
void add_parcels(Profile& profile, const Vec2i* position, const Vec2f* velocity, std::size_t num);

Profile empty_profile(const ProfileShape& shape);
std::vector<ProfileRow> rows_of(const Profile& profile, const ParcelConstants& parcels);

}  // namespace pf
