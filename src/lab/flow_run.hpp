// A gas in equilibrium whose velocities a flow replaces, and its steps by a method.
#pragma once

#include "app/scene_run.hpp"
#include "lab/flow_case.hpp"

namespace pf {

struct FlowScales {
  double hottest_rate = 1.0;  // collisions per parcel and time in the densest, hottest part
  double fastest = 1.0;       // speed of a typical fast parcel
  double reference = 1.0;     // of the fixed-point units
};

// Runs the parcels of `settings` with `exact` until each has collided a few times at temperature 1.
class FlowRun {
 public:
  FlowRun(const Settings& settings, const FlowSteps& steps, Backend& backend);

  // State at the start, in the order of ids. Its velocities have mean 0 and c = 1.
  ParcelSnapshot& start() { return start_; }
  const Physics& physics() const { return physics_; }
  // Puts the start into the backend.
  void begin(const FlowScales& scales);
  // From now on the gas has these scales.
  void rescale(const FlowScales& scales);
  // Advances by `duration` in whole steps.
  StepReport advance(double duration);

  double wall_ns() const { return wall_ns_; }  // of all steps since begin()
  const StepTotals& totals() const { return totals_; }
  double energy() const { return backend_.measure().parcel_energy_j; }

 private:
  Settings settings_;
  FlowSteps steps_;
  Backend& backend_;
  Physics physics_;
  ParcelSnapshot start_;
  double max_dt_ = 0.0;
  double wall_ns_ = 0.0;
  StepTotals totals_;
};

}  // namespace pf
