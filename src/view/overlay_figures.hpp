// The figures of the overlay, over the last frames, and a CSV file with one line per frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "app/simulation.hpp"
#include "core/statistics.hpp"

namespace pf {

struct OverlayFigures {
  std::array<MedianP99, kNumPhases> phase_ms;
  MedianP99 total_ms;        // all phases
  double gpu_draw_ms = 0.0;  // medians by the clock of the GL device; 0: not known
  double gpu_panel_ms = 0.0;
  MedianP99 frame_ms;               // from one frame to the next
  double parcel_steps_per_s = 0.0;  // in the phases of a step; 0: nothing stepped
  double copy_share = 0.0;          // least bytes moved per second over those of a plain copy; 0: not known
};

// The last kNumKept frames of the same work: another scene, method or number of parcels begins anew.
class FrameHistory {
 public:
  static constexpr std::size_t kNumKept = 120;

  // times: all phases of one frame; frame_ms: wall time from the frame before to it. Frames that only wait
  // for the next launch are left out, so that the flight's figures stay.
  void add(const PhaseTimes& times, double frame_ms, const FrameView& frame, const DrawTimes& drawing = {});
  std::size_t size() const { return std::min(num_added_ - begun_at_, kNumKept); }
  std::uint64_t num_added() const { return num_added_; }
  const PhaseTimes& times(std::size_t age) const { return kept(age).times; }

  // copy_bytes_per_s: of a plain copy, read plus written; 0: not known.
  OverlayFigures figures(double copy_bytes_per_s) const;

 private:
  // Frames whose work differs have no common median; those of several launches have.
  struct Work {
    std::int64_t num_scenes = 0;
    std::uint32_t num_parcels = 0;
    Method method{};
    Neighbors neighbors{};
    std::int64_t threads = 0;
    bool operator==(const Work&) const = default;
  };
  struct Kept {
    PhaseTimes times;
    DrawTimes drawing;
    double frame_ms = 0.0;
    bool is_stepping = false;  // perhaps within a step
    double parcel_steps = 0.0;
    double min_bytes = 0.0;
  };
  const Kept& kept(std::size_t age) const { return kept_[(num_added_ - 1 - age) % kNumKept]; }

  std::array<Kept, kNumKept> kept_{};
  std::size_t num_added_ = 0;
  std::size_t begun_at_ = 0;  // frames added before the present work
  Work work_;
};

// Facts about the view, besides the frame.
struct OverlayInfo {
  std::string draw_target;        // kind and reason
  double copy_bytes_per_s = 0.0;  // 0: not measured
  bool vsync = false;             // frames wait for a screen
  std::string terms{};            // cost of the model's terms; empty: not shown
};

// Columns of the file: frame, simulated_s, slow_motion, frames_per_s, then in milliseconds frame, total and
// each phase of kPhaseNames (of this frame, median and 99th percentile of those kept), num_parcels, method,
// neighbors, dt_s, steps, parcel_steps_per_s, copy_share, memory_bytes, draw_target, collisions, ball_hits,
// rounds, retried_steps (of this frame), draw_host_ms, draw_gpu_ms, panel_host_ms, panel_gpu_ms (by the
// clocks of the host and of the GL device; the device's is one or two frames late, and empty where it has
// none), events, solved_events (in all rounds), largest_cluster (events), pictures (that the steps of a frame
// take).
class OverlayCsv {
 public:
  explicit OverlayCsv(const std::filesystem::path& file);  // throws UserError if it cannot be written
  void add_line(const PhaseTimes& times, const DrawTimes& drawing, double frame_ms, const FrameView& frame,
                const OverlayFigures& figures, const OverlayInfo& info);
  bool broke_off() const { return !stream_; }  // the disk is full, for example

 private:
  std::ofstream file_;
  std::ostream& stream_;  // this file, or one that is open
  std::uint64_t num_lines_ = 0;
};

}  // namespace pf
