// The report of a run, in JSON. Its keys are stable.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

struct RecordedFrame {
  PhaseTimes times;
  DrawTimes drawing;
  double interval_ms;  // from the end of the frame before; NaN for the first
};

// Collects one run, frame by frame.
class RunRecord {
 public:
  RunRecord(const Physics& physics, const Measures& initial, std::string device);

  // times: all phases of one frame; totals and dt_s: of that frame's steps; drawing: both clocks' times, for
  // frames that are drawn.
  void add_frame(const PhaseTimes& times, const StepTotals& totals, double dt_s,
                 const DrawTimes& drawing = {});
  // Leaves the time since the last frame, or since the last call, out of frame times: a picture without
  // steps.
  void pass_idle_time();
  void start_clock();  // wall_s counts from here
  // For a run that ends on another device than it started on (other threads of the CPU backend).
  void set_device(std::string device) { device_ = std::move(device); }
  // Must be called before the first frame.
  void set_warmup(int num_frames) { num_warmup_ = static_cast<std::size_t>(num_frames); }

  // The steps that the run had made when it was saved to a file. They count in all figures except speeds.
  void continue_from(const StepTotals& totals, double simulated_s);
  const Measures& initial() const { return initial_; }

  // Adds a part under a key of its own.
  void set_part(const std::string& key, const nlohmann::json& part);

  // Keys: those of set_part (record: the last film, files: dump and checkpoint, replay, display: the window
  // at the end, chosen: what --accuracy chose (accuracy.hpp), accuracy: the last readout of the panel's
  // section, interrupted: by a signal, split: see FlightPair, terms: the cost of each term per step, measured
  // beside a window, clock_s: simulated time at the end, which jumps back make less than simulated_s),
  // version, device, domain_link (how motion goes between domains on GPUs; otherwise null), scene, method,
  // neighbors, num_parcels, area_fraction, restitution, dt_s, steps, simulated_s, wall_s,
  // frame_ms.{median,p99} (from one frame's end to the next), phase_ms.<phase>.{median,p99} (each name of
  // kPhaseNames; draw: the longer of both clocks; panel and later phases: the host's clock),
  // host_ms.{draw,panel}.{median,p99}, gpu_ms.{draw,panel}.{median,p99} (the GL device's clock; null where it
  // has none), ns_per_parcel_step, parcel_steps_per_s, energy.{initial_j,final_j,relative_drift},
  // momentum.{initial,final,relative_drift},
  // collisions.{count,rate_per_parcel_per_s,enskog_rate_per_parcel_per_s}, compressibility,
  // max_overlap_diameters, num_retired, exact.{rounds,retried_steps,events,solved_events (in all
  // rounds),largest_cluster (events),event_hash,max_overlap_units} (null for other methods),
  // ball.{x_m,y_m,vx_mps,vy_mps,spin_radps,distance_m,hits,impulse...}, state_hash (hex string), memory_bytes
  // (state and scratch of the parcels). A figure without meaning in the run (no parcels, no collision) is
  // null. settings: those at the end, which the panel may have changed.
  nlohmann::json finish(const Settings& settings, const Physics& physics, Backend& backend,
                        const BallState& ball, double ball_distance_m) const;

  // Means over the frames after the warm-up, for runs that add one frame per picture. Keys: num, warmup,
  // frame_ms (wall time, end of frame to end of frame) = physics_ms (PhaseTimes::step_ms) + render_ms (map,
  // unmap, draw, present) + overhead_ms (the rest; 0 where a device worked beside the host, so that the parts
  // exceed the whole). null where there was no such frame.
  nlohmann::json frame_report() const;

 private:
  void thin_out();

  std::vector<std::pair<std::string, std::string>> parts_;  // key, JSON text
  Measures initial_;
  std::string device_;
  std::vector<RecordedFrame> frames_;  // every stride_-th frame, so that a window may stay open for days
  std::size_t num_frames_ = 0, stride_ = 1;
  double compute_ms_ = 0.0;
  PhaseTimes sum_;  // over the frames after the warm-up
  StepTotals totals_;
  StepTotals earlier_;  // of the run before it was saved
  double simulated_s_ = 0.0;
  double dt_s_ = 0.0;
  double speed_mps_ = 0.0;  // thermal, at the start
  Clock::time_point start_;
  std::size_t num_warmup_ = 0;
  Clock::time_point timed_from_;  // end of the warm-up
  Clock::time_point last_frame_;  // end of the last frame
};

// Writes indented JSON. Throws OutputError if the file cannot be written.
void write_report(const std::filesystem::path& file, const nlohmann::json& report);

}  // namespace pf
