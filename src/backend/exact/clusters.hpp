// Clusters of a window: sets of parcels whose events depend on each other.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/exact/window.hpp"

namespace pf {

// Sets of indices as trees: parent[i] leads towards the root of i's set, which is its own parent. Threads may
// share the trees. The root of a union is the lower of the two roots.
std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t i);
void union_sets(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b);

// Second stage of a window: groups the active parcels into clusters and lists all clusters in `todo`. Parcels
// are in one cluster if a chain of earliest events connects them. A participating ball gets a cluster of its
// own.
void form_clusters(WindowContext& window);

}  // namespace pf
