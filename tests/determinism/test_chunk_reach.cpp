// Search boxes of method exact on the CPU that are as wide as the parcels near them are fast.
#include <gtest/gtest.h>

#include <set>

#include "backend/exact/chunk_reach.hpp"
#include "determinism/disc_gas.hpp"

namespace pf::test {
namespace {

constexpr std::uint32_t kSize = 8;  // parcels of a chunk

std::vector<float> chunk_speeds(const Gas& gas) {
  std::vector<float> speed2((gas.space.num_parcels + kSize - 1) / kSize, 0.0F);
  for (std::uint32_t i = 0; i < gas.space.num_parcels; ++i) {
    const Vec2f v = gas.trajectories.velocity[i];
    if (gas.is_live(i)) speed2[i / kSize] = std::max(speed2[i / kSize], dot(v, v));
  }
  return speed2;
}

// Boxes with the reach of each chunk find the pairs that boxes with that of the fastest parcel find.
template <Boundary kBoundary>
void expect_same_pairs(double area_fraction) {
  const Gas gas(9000, area_fraction, kBoundary, 2.8, {0.0, 20.0, 300});
  const std::vector<float> speed2 = chunk_speeds(gas);
  const DiscSearch search = choose_disc_search(kBoundary);
  DiscPairs all, found;
  std::uint32_t num_pairs = 0, num_narrow = 0;
  for (std::uint32_t k = 0; k < speed2.size(); ++k) {
    const Chunk chunk(gas.position.data(), gas.space.num_parcels, k, kSize);
    DiscSpace space = gas.space;
    search.find_pairs(space, chunk.begin, chunk.end, all);
    space.reach = reach_from<kBoundary>(gas.c, space, speed2, chunk);
    search.find_pairs(space, chunk.begin, chunk.end, found);
    const std::set<IndexPair> expected(all.candidates.begin(), all.candidates.end());
    EXPECT_EQ(std::set<IndexPair>(found.candidates.begin(), found.candidates.end()), expected)
        << "chunk " << k;
    num_pairs += static_cast<std::uint32_t>(expected.size());
    num_narrow += 2 * space.reach < gas.space.reach ? 1 : 0;
  }
  EXPECT_GT(num_pairs, 150U);
  EXPECT_GT(num_narrow, 20U) << "of " << speed2.size() << " chunks";
}

TEST(ChunkReach, FindsWhatTheReachOfTheFastestFinds) {
  for (const double area_fraction : {0.05, 0.2, 0.5}) {
    expect_same_pairs<Boundary::open>(area_fraction);
    expect_same_pairs<Boundary::walls>(area_fraction);
    expect_same_pairs<Boundary::periodic>(area_fraction);
  }
}

}  // namespace
}  // namespace pf::test
