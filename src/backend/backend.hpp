// The interface between the simulation loop and the owner of the state, which is the CPU or a CUDA device.
//
// A backend owns parcels and ball between calls. It does not depend on GL, files or settings.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/draw_buffers.hpp"
#include "backend/exact/event_record.hpp"
#include "backend/parcel_images.hpp"
#include "backend/profile.hpp"
#include "core/error.hpp"
#include "core/timing.hpp"
#include "model/exact/trajectory.hpp"
#include "model/measures.hpp"
#include "model/spawn.hpp"

namespace pf {

struct StepRequest {
  Method method = Method::impulse;
  Neighbors neighbors = Neighbors::grid;
  std::uint32_t num_steps = 1;
  std::uint32_t num_done = 0;     // steps of the same series that earlier requests have completed
  double budget_ms = 0.0;         // no step is begun after it; 0: no budget
  double dt_s = 0.0;              // > 0
  double spring_contact_s = 0.0;  // contact duration of `spring`; > 0 with that method
  double contact_clock_s = 0.0;   // contact duration of the TC model in `exact`; 0: off
  std::vector<EventRecord>* events = nullptr;  // `exact` on the CPU appends its events; null: not recorded
  const DrawBuffers* draw = nullptr;           // written by the last step; null: nothing is drawn
};

struct StepReport {
  PhaseTimes times;   // of the whole request
  StepTotals totals;  // num_steps: completed; fewer than asked for if the budget was spent
  BallState ball;     // after the last step, or within an unfinished one
  bool mid_step = false;
};

// Method `exact` cannot go on. The state is that of the moment, and no step is unfinished: any method may
// take it over. What has passed of the last step does not count as time.
class UnresolvableError : public UserError {
 public:
  UnresolvableError(const std::string& message, const StepReport& done) : UserError(message), report(done) {
    report.mid_step = false;
  }
  StepReport report;  // of what was done of the request
};

// Parcels by id: position units and m/s.
struct ParcelSnapshot {
  std::vector<Vec2i> position;
  std::vector<Vec2f> velocity;
  std::vector<std::uint32_t> heated{};  // ids of heated parcels (Parcel::is_heated), ascending
  std::uint64_t step = 0;               // since the reset; keys the random roundings of the next step
};

// Trajectories of method `exact`, parcels by id, and its time. Empty while another method holds the state.
struct ExactSnapshot {
  bool active = false;
  std::vector<Vec2i> anchor;                     // position units, of the last event
  std::vector<std::uint32_t> tick;               // of the anchor, modulo 2^32
  std::vector<std::uint32_t> last_contact_tick;  // empty without a contact duration
  std::uint64_t now = 0;                         // ticks of the reference speed
  std::uint32_t tick_exponent = 0;               // a tick of the trajectories lasts 2^tick_exponent of these
  BallTrajectory ball;                           // counts from now
  bool ball_holds = false;                       // whether `ball` is valid
};

// All that a backend needs to go on to the same bits, also one of the other kind.
struct BackendState {
  ParcelSnapshot parcels;
  BallState ball;
  bool ball_was_set = false;  // from outside, since the last request of `exact`
  double exact_s = 0.0;       // time of the completed steps of `exact` since the reset
  ExactSnapshot exact;
};

constexpr unsigned kMaxDomains = 64;  // everyone hears from everyone

class Backend {
 public:
  virtual ~Backend() = default;

  virtual std::string name() const = 0;    // "cpu" or "cuda"
  virtual std::string device() const = 0;  // name of processor or GPU, for the report

  // Number of parts of the world, each with parcels of its own.
  virtual unsigned num_domains() const { return 1; }
  // Describes how domains on GPUs exchange the motion of parcels near borders; empty for others.
  virtual std::string domain_link() const { return ""; }
  // Share of its parcels that are in the memory of this machine.
  virtual double share_here() const { return 1.0; }
  // Why this backend cannot make steps of a method, with a remedy; "": it can. submit() throws UserError
  // then.
  virtual std::string refusal_of(Method) const { return ""; }
  // A backend of this kind, without parcels, with num_threads threads (0: all of the machine). Null if the
  // backend does not depend on threads.
  virtual std::unique_ptr<Backend> with_threads(unsigned) const { return nullptr; }

  // Spawns the parcels of plan and adopts physics and ball. Throws UserError if a device's memory does not
  // suffice, std::bad_alloc if that of the host does not.
  virtual void reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) = 0;
  // Replaces the constants. Number of parcels and world must be those of the last reset.
  virtual void set_physics(const Physics& physics) = 0;
  virtual void set_ball(const BallState& ball) = 0;
  // Replaces the parcels' state and the count of steps. snapshot: every spawned parcel, in the order of ids.
  virtual void restore(const ParcelSnapshot& snapshot) = 0;

  // Starts a request. A device works on it while the caller continues. Draw buffers in device memory are in
  // use until collect(); those in host memory are complete when submit() returns. Until collect(), only
  // images() may be asked.
  //
  // A budget may end a request after any step, and method `exact` within a step (mid_step), where state and
  // drawing are those of the moment. The next request then goes on: num_done counts the steps that the series
  // has completed, all else is as before, and the results are those of one request without a budget. Until
  // the step is complete, only reset() and restore() may change the state; they drop it. A backend may ignore
  // the budget. submit() and collect() may throw UnresolvableError.
  virtual void submit(const StepRequest& request) = 0;
  // Waits for the end of the submitted request.
  virtual StepReport collect() = 0;
  StepReport advance(const StepRequest& request) {
    submit(request);
    return collect();
  }
  // Writes the current state into the buffers without a step.
  virtual void draw(const DrawBuffers& buffers) = 0;
  // Another way to draw, for parcels in several memories; null: this backend has them in one.
  virtual ParcelImages* images() { return nullptr; }

  virtual ParcelSnapshot snapshot() = 0;
  // Stores the state into `state`, whose memory is used again. Not while a step is unfinished (mid_step).
  virtual void save(BackendState& state) = 0;
  // Replaces all that a reset sets. state: as save() left it, of a run with these constants, on any backend.
  // Throws as reset() does.
  virtual void resume(const Physics& physics, const BackendState& state) = 0;
  virtual Measures measure() = 0;
  // Profile of the current state. The base class sums over snapshot(); results are the same everywhere.
  virtual Profile profile(const ProfileShape& shape);
  virtual std::uint64_t state_hash() = 0;
  // Bytes of state and scratch held for the parcels.
  virtual std::uint64_t memory_bytes() const = 0;
  // Lower bound on the bytes that the steps and sorts of totals read and wrote: state, keys, cell starts.
  // Repeated reads of the search for partners are not counted.
  virtual double min_bytes_moved(const StepTotals& totals) const = 0;
  // Measures a plain copy of about num_bytes on the device. Returns bytes per second, read plus written.
  virtual double measure_copy_bandwidth(std::size_t num_bytes) = 0;
};

// num_threads: 0 means all of the machine.
std::unique_ptr<Backend> make_cpu_backend(unsigned num_threads);

// Constants of a step of dt_s, the same for every backend.
StepConstants make_step_constants(const Physics& physics, double dt_s, double spring_contact_s);

// Constants of method `exact` that hold for a whole run. contact_clock_s: see StepRequest.
RunConstants make_run_constants(const Physics& physics, double contact_clock_s);

// Makes a backend by its name, with so many threads (0: all of the machine).
using MakeBackend = std::function<std::unique_ptr<Backend>(const std::string& name, std::int64_t threads)>;

}  // namespace pf
