#include "view/overlay_figures.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {

void FrameHistory::add(const PhaseTimes& times, double frame_ms, const FrameView& frame,
                       const DrawTimes& drawing) {
  const Work work = {frame.num_scenes, frame.num_parcels, frame.settings->method, frame.settings->neighbors,
                     frame.settings->threads};
  if (!(work == work_)) begun_at_ = num_added_;
  work_ = work;
  const double steps = static_cast<double>(frame.frame_totals.num_steps);
  const bool is_stepping = steps > 0.0 || frame.unfinished;
  if ((frame.paused || frame.flight == Flight::landed) && !is_stepping) return;  // keeps the flight's figures
  kept_[num_added_ % kNumKept] = {
      times, drawing, frame_ms, is_stepping, steps * frame.num_parcels, frame.min_bytes_moved};
  ++num_added_;
}

OverlayFigures FrameHistory::figures(double copy_bytes_per_s) const {
  OverlayFigures figures;
  std::array<double, kNumKept> values{};
  const auto of = [&](const auto& value_of) {
    for (std::size_t i = 0; i < size(); ++i) values[i] = value_of(kept(i));
    return median_and_p99(std::span(values).first(size()));
  };
  for (std::size_t phase = 0; phase < kNumPhases; ++phase)
    figures.phase_ms[phase] = of([phase](const Kept& frame) { return frame.times.ms[phase]; });
  figures.total_ms = of([](const Kept& frame) { return frame.times.total(); });
  figures.frame_ms = of([](const Kept& frame) { return frame.frame_ms; });
  const auto known_median = [&](double DrawTimes::*member) {
    std::size_t num = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      const double ms = kept(i).drawing.*member;
      if (std::isfinite(ms)) values[num++] = ms;
    }
    return median_and_p99(std::span(values).first(num)).median;
  };
  figures.gpu_draw_ms = known_median(&DrawTimes::gpu_draw_ms);
  figures.gpu_panel_ms = known_median(&DrawTimes::gpu_panel_ms);
  double seconds = 0.0;
  double parcel_steps = 0.0;
  double bytes = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const Kept& frame = kept(i);
    if (!frame.is_stepping) continue;
    seconds += 1e-3 * frame.times.step_ms();
    parcel_steps += frame.parcel_steps;
    bytes += frame.min_bytes;
  }
  if (seconds > 0.0) figures.parcel_steps_per_s = parcel_steps / seconds;
  if (seconds > 0.0 && copy_bytes_per_s > 0.0) figures.copy_share = bytes / seconds / copy_bytes_per_s;
  return figures;
}

OverlayCsv::OverlayCsv(const std::filesystem::path& file)
    : stream_(standard_stream(file) != nullptr ? *standard_stream(file) : file_) {
  if (&stream_ == &file_) file_.open(file, std::ios::trunc);
  stream_ << "frame,simulated_s,slow_motion,frames_per_s";
  const auto add = [this](const char* name) {
    stream_ << fmt::format(",{0}_ms,{0}_median_ms,{0}_p99_ms", name);
  };
  add("frame");
  add("total");
  for (const char* name : kPhaseNames) add(name);
  stream_
      << ",num_parcels,method,neighbors,dt_s,steps,parcel_steps_per_s,copy_share,memory_bytes,draw_target,"
         "collisions,ball_hits,rounds,retried_steps,draw_host_ms,draw_gpu_ms,panel_host_ms,panel_gpu_ms,"
         "events,solved_events,largest_cluster,pictures\n";
  if (!stream_) {
    throw UserError(
        fmt::format("--overlay-csv: {} cannot be written; choose another file", in_quotes(file.string())));
  }
}

void OverlayCsv::add_line(const PhaseTimes& times, const DrawTimes& drawing, double frame_ms,
                          const FrameView& frame, const OverlayFigures& figures, const OverlayInfo& info) {
  const auto name = [&](const char* path) { return value_text(path, *frame.settings); };
  fmt::memory_buffer line;
  const auto out = std::back_inserter(line);
  fmt::format_to(out, "{},{},{},{:.2f}", num_lines_++, frame.simulated_s, frame.slow_motion,
                 figures.frame_ms.median > 0.0 ? 1e3 / figures.frame_ms.median : 0.0);
  const auto add = [&](double ms, const MedianP99& usual) {
    fmt::format_to(out, ",{:.4f},{:.4f},{:.4f}", ms, usual.median, usual.p99);
  };
  add(frame_ms, figures.frame_ms);
  add(times.total(), figures.total_ms);
  for (std::size_t phase = 0; phase < kNumPhases; ++phase) add(times.ms[phase], figures.phase_ms[phase]);
  const std::string target = info.draw_target.substr(0, info.draw_target.find(':'));
  const StepTotals& totals = frame.frame_totals;
  fmt::format_to(out, ",{},{},{},{},{},{:.6g},{:.4f},{},{},{},{},{},{}", frame.num_parcels,
                 name("run.method"), name("run.neighbors"), frame.dt_s, totals.num_steps,
                 figures.parcel_steps_per_s, figures.copy_share, frame.memory_bytes, target,
                 totals.num_collisions, totals.num_ball_hits, totals.num_rounds, totals.num_retried_steps);
  for (const double ms :
       {drawing.host_draw_ms, drawing.gpu_draw_ms, drawing.host_panel_ms, drawing.gpu_panel_ms}) {
    line.push_back(',');
    if (std::isfinite(ms)) fmt::format_to(out, "{:.4f}", ms);
  }
  fmt::format_to(out, ",{},{},{},{}\n", totals.num_events, totals.num_solved_events, totals.largest_cluster,
                 frame.num_pictures);
  stream_.write(line.data(), static_cast<std::streamsize>(line.size()));
  stream_.flush();
}

}  // namespace pf
