// The division of the world into slabs along x, one for each domain.
#pragma once

#include <algorithm>
#include <cstdint>

#include "model/grid.hpp"

namespace pf {

struct Slabs {
  World world;
  unsigned num = 1;

  // Lowest coordinate of slab k, position units; that of slab `num` is the world's edge.
  std::int64_t edge(unsigned k) const { return offset(k) - world.half.x; }

  // The slab that holds a coordinate. Beyond the world's edge: the outermost one.
  unsigned owner(std::int32_t x) const {
    const std::int64_t inside = std::clamp<std::int64_t>(x, -world.half.x, world.half.x) + world.half.x;
    auto k = static_cast<unsigned>(std::min<std::int64_t>(inside * num / extent(), num - 1));
    while (k + 1 < num && inside >= offset(k + 1)) ++k;  // offsets are rounded down
    return k;
  }

  // The edges of a slab. They cost divisions.
  struct Span {
    std::int64_t low, high;
  };
  Span span(unsigned k) const { return {edge(k), edge(k + 1)}; }

  // From a coordinate to a slab, position units; to the nearest image in a periodic world.
  std::int64_t distance(std::int32_t x, const Span& slab) const {
    const auto to = [&](std::int64_t coordinate) {
      return std::max({slab.low - coordinate, coordinate - slab.high, std::int64_t{0}});
    };
    if (world.boundary != Boundary::periodic) return to(x);
    return std::min({to(x), to(x - extent()), to(x + extent())});
  }

  // Slab k and what is within `margin` of it, position units, without images.
  GridArea area(unsigned k, std::int64_t margin) const {
    const auto clamped = [&](std::int64_t x) {
      return static_cast<std::int32_t>(std::clamp<std::int64_t>(x, -world.half.x, world.half.x));
    };
    return {{clamped(edge(k) - margin), -world.half.y}, {clamped(edge(k + 1) + margin), world.half.y}};
  }

  std::int64_t extent() const { return 2LL * world.half.x; }  // along x, position units

 private:
  std::int64_t offset(unsigned k) const { return extent() * k / num; }
};

}  // namespace pf
