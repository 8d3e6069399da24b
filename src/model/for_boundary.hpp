// Turns a boundary into a template argument. Host only.
#pragma once

#include "model/world.hpp"

namespace pf {

// Returns function.template operator()<kBoundary>() for this boundary.
template <class Function>
auto for_boundary(Boundary boundary, const Function& function) {
  switch (boundary) {
    case Boundary::walls:
      return function.template operator()<Boundary::walls>();
    case Boundary::periodic:
      return function.template operator()<Boundary::periodic>();
    default:
      return function.template operator()<Boundary::open>();
  }
}

}  // namespace pf
