// The pictures that domains count and gather, against those of all parcels in one memory.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "backend/backend.hpp"

namespace pf::test {

inline bool is_before(const DrawnParcel& a, const DrawnParcel& b) {
  if (a.position_m.x != b.position_m.x) return a.position_m.x < b.position_m.x;
  if (a.position_m.y != b.position_m.y) return a.position_m.y < b.position_m.y;
  return a.speed_mps < b.speed_mps;
}

// plain: in one memory, the same state. The pictures are of a part of a world that is some metres wide.
inline void expect_same_pictures(Backend& plain, Backend& divided, std::uint32_t num_parcels) {
  std::vector<Vec2f> position_m(num_parcels);
  std::vector<float> speed_mps(num_parcels);
  plain.draw({position_m.data(), speed_mps.data(), num_parcels});
  ASSERT_NE(divided.images(), nullptr);
  EXPECT_EQ(plain.images(), nullptr);
  const PixelGrid grid{{0.3F, -0.2F}, {100.0F, 60.0F}, {20.0F, 10.0F}, 0.05F, 150, 90};
  const CountStyle style{0.2F, 1};
  std::vector<std::uint32_t> counts(std::size_t{150} * 90);
  std::vector<DrawnParcel> seen;
  for (std::uint32_t i = 0; i < num_parcels; ++i) {
    const float x = (position_m[i].x - 0.3F) / 0.05F + 100.0F - 20.0F;
    const float y = (position_m[i].y + 0.2F) / 0.05F + 60.0F - 10.0F;
    if (!(x >= 0.0F && y >= 0.0F && x < 150.0F && y < 90.0F)) continue;
    const float level = std::min(speed_mps[i] * 0.2F, 1.0F);
    counts[static_cast<std::size_t>(y) * 150 + static_cast<std::size_t>(x)] +=
        8192U * static_cast<std::uint32_t>(level * 63.0F + 0.5F) + 1U;
    seen.push_back({position_m[i], speed_mps[i]});
  }
  ASSERT_GT(seen.size(), num_parcels / 20);
  ASSERT_LT(seen.size(), num_parcels);
  EXPECT_EQ(divided.images()->count(grid, style), counts);

  std::vector<DrawnParcel> gathered = divided.images()->gather(grid);
  std::sort(seen.begin(), seen.end(), is_before);
  std::sort(gathered.begin(), gathered.end(), is_before);
  ASSERT_EQ(gathered.size(), seen.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    EXPECT_EQ(gathered[k].position_m.x, seen[k].position_m.x);
    EXPECT_EQ(gathered[k].speed_mps, seen[k].speed_mps);
  }

  // One parcel in three, chosen by id.
  const auto num_in = [](const std::vector<std::uint32_t>& pixels) {
    std::uint32_t num = 0;
    for (const std::uint32_t pixel : pixels) num += pixel & 8191U;
    return num;
  };
  const std::uint32_t num_third = num_in(divided.images()->count(grid, {0.2F, 3}));
  EXPECT_GT(num_third, seen.size() / 4);
  EXPECT_LT(num_third, seen.size() / 2);
}

}  // namespace pf::test
