// A boundary known only when the program runs, as a template argument. Host text.
#pragma once

#include "model/world.hpp"

namespace pf {

// What function.template operator()<kBoundary>() returns for this boundary.
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
