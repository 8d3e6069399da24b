// A view of frames for tests of what a window shows, with data of its own.
#pragma once

#include <deque>

#include "app/simulation.hpp"
#include "scene/derive.hpp"
#include "support/scene_support.hpp"

namespace pf {

struct Frames {
  Settings settings = test::court(1000);
  Physics physics = derive_physics(settings);
  FlightRecord flight;
  std::deque<FlightRecord> old_flights;
  FrameView view;

  Frames() {
    view.settings = &settings;
    view.physics = &physics;
    view.flight_record = &flight;
    view.old_flights = &old_flights;
    view.num_parcels = 1000;
    view.frame_totals.num_steps = 4;
    view.min_bytes_moved = 1e5;
    view.memory_bytes = 4321;
  }
};

}  // namespace pf
