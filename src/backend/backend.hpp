// The interface between the simulation loop and what carries the state: the CPU or a CUDA device.
//
// A backend owns the parcels and the ball between calls and knows nothing of GL, files or settings.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "backend/draw_buffers.hpp"
#include "backend/exact/event_record.hpp"
#include "core/timing.hpp"
#include "model/exact/trajectory.hpp"
#include "model/measures.hpp"
#include "model/spawn.hpp"

namespace pf {

struct StepRequest {
  Method method = Method::impulse;
  Neighbors neighbors = Neighbors::grid;
  std::uint32_t num_steps = 1;
  double dt_s = 0.0;                           // > 0
  double spring_contact_s = 0.0;               // contact duration of `spring`, > 0 when that is the method
  double contact_clock_s = 0.0;                // contact duration of the TC model in `exact`; 0: off
  std::vector<EventRecord>* events = nullptr;  // `exact` on the CPU appends its events; null: not wanted
  const DrawBuffers* draw = nullptr;           // written by the last step; null: nothing is drawn
};

struct StepReport {
  PhaseTimes times;  // of the whole request
  StepTotals totals;
  BallState ball;  // after the last step
};

// Parcels by id: position units and m/s.
struct ParcelSnapshot {
  std::vector<Vec2i> position;
  std::vector<Vec2f> velocity;
  std::uint64_t step = 0;  // since the reset: it keys the random roundings of the next one
};

class Backend {
 public:
  virtual ~Backend() = default;

  virtual std::string name() const = 0;    // "cpu" or "cuda"
  virtual std::string device() const = 0;  // what it runs on, for the report

  // Spawns the parcels of plan and takes over physics and ball. Throws UserError if memory would not do.
  virtual void reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) = 0;
  // Replaces all constants but the number of parcels and the world, which must be those of the last reset.
  virtual void set_physics(const Physics& physics) = 0;
  virtual void set_ball(const BallState& ball) = 0;
  // Replaces the parcels' state and the count of steps; entries in the order of ids, as many as were spawned.
  virtual void restore(const ParcelSnapshot& snapshot) = 0;

  // Starts a request. A device works on it while the caller goes on; draw buffers in device memory are in
  // use until collect(), those in host memory are written when submit returns. One request at a time:
  // nothing but collect() may be called in between.
  virtual void submit(const StepRequest& request) = 0;
  // Waits for the end of the submitted request.
  virtual StepReport collect() = 0;
  StepReport advance(const StepRequest& request) {
    submit(request);
    return collect();
  }
  // Writes the present state into the buffers without stepping.
  virtual void draw(const DrawBuffers& buffers) = 0;

  virtual ParcelSnapshot snapshot() = 0;
  virtual Measures measure() = 0;
  virtual std::uint64_t state_hash() = 0;
  // Bytes of state and scratch held for the parcels.
  virtual std::uint64_t memory_bytes() const = 0;
  // Bytes that the steps and sorts of totals had to read and write at least: state, keys, cell starts. What
  // the search for partners reads again is not counted.
  virtual double min_bytes_moved(const StepTotals& totals) const = 0;
  // Bytes per second, read plus written, of a plain copy of about num_bytes on the device, measured now.
  virtual double measure_copy_bandwidth(std::size_t num_bytes) = 0;
};

// num_threads: 0 means all the machine has.
std::unique_ptr<Backend> make_cpu_backend(unsigned num_threads);

// Constants of a step of dt_s, derived from the physics; the same for every backend.
StepConstants make_step_constants(const Physics& physics, double dt_s, double spring_contact_s);

// Constants of method `exact` that hold for a whole run. contact_clock_s: see StepRequest.
RunConstants make_run_constants(const Physics& physics, double contact_clock_s);

}  // namespace pf
