// Indices into arrays of parcels, clusters and the like.
#pragma once

#include <cstdint>

namespace pf {

constexpr std::uint32_t kInvalidIndex = 0xFFFFFFFFU;

}  // namespace pf
