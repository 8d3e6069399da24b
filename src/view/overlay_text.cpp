#include "view/overlay_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pf {

std::string grouped(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

std::string counted(std::uint64_t num, const char* what) {
  return fmt::format("{} {}{}", grouped(num), what, num == 1 ? "" : "s");
}

std::string short_number(double value) {
  constexpr const char* kUnits[] = {"", "k", "M", "G", "T"};
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < std::size(kUnits)) {
    value *= 1e-3;
    ++unit;
  }
  const int decimals = unit == 0 || value >= 99.95 ? 0 : (value >= 9.995 ? 1 : 2);
  return fmt::format("{:.{}f}{}{}", value, decimals, unit > 0 ? " " : "", kUnits[unit]);
}

std::string ms_text(double ms) {
  return ms < 9.995 ? fmt::format("{:.2f}", ms) : fmt::format("{:.{}f}", ms, ms < 99.95 ? 1 : 0);
}

std::string time_text(double seconds) {
  if (seconds >= 1.0) return fmt::format("{:.2f} s", seconds);
  if (seconds >= 1e-3) return fmt::format("{:.2f} ms", 1e3 * seconds);
  return fmt::format("{:.3g} \xC2\xB5s", 1e6 * seconds);
}

std::string rounded_text(double value) {
  return value < 1000.0 ? fmt::format("{:.3g}", value) : grouped(std::llround(value));
}

std::string rate_text(double frame_ms) {
  return frame_ms > 0.0 ? fmt::format("{:.0f}", 1e3 / std::max(frame_ms, 1e-3)) : "-";
}

namespace {

// Above this a flight counts as real time or faster.
constexpr double kRealTime = 0.95;

std::string factor_text(double slow_motion) {
  if (slow_motion > kRealTime && slow_motion < 99.5) return fmt::format("{:.2g} \xC3\x97", slow_motion);
  if (slow_motion > kRealTime) return fmt::format("{} \xC3\x97", rounded_text(slow_motion));
  const double slower = 1.0 / slow_motion;
  const std::string factor = slower < 100.0 ? fmt::format("{:.3g}", slower) : grouped(std::llround(slower));
  return fmt::format("{}\xC3\x97", factor);
}

}  // namespace

std::string speed_text(double slow_motion) {
  if (slow_motion <= 0.0) return "time stands still";
  return factor_text(slow_motion) + (slow_motion > kRealTime ? " real time" : " slow motion");
}

std::string pace_text(const FrameView& frame, double frames_per_s) {
  if (frame.waits_for_step && frame.mid_step) return "input waits for the end of the step";
  constexpr double kNoticed = 1.25;
  std::string speed = speed_text(frame.slow_motion);
  const double faster = frames_per_s / frame.settings->frame_rate_hz;
  if (frame.slow_motion > 0.0 && faster > 0.0 && (faster > kNoticed || faster < 1.0 / kNoticed)) {
    const double on_screen = faster * frame.slow_motion;
    speed = frame.num_pictures > 1 ? speed_text(on_screen) + " on screen"
                                   : fmt::format("{}, {} on screen", speed, factor_text(on_screen));
  }
  return frame.num_pictures > 1 ? fmt::format("{} pictures a frame, {}", frame.num_pictures, speed) : speed;
}

std::string clock_text(const FrameView& frame) {
  const std::string text = fmt::format("t = {:.3f} s", frame.simulated_s);
  const FlightRecord* flight = frame.flight_record;
  if (flight == nullptr || flight->number <= 1) return text;
  return fmt::format("{}, flight {}: {:.3f} s", text, flight->number, flight->time_s());
}

std::string cluster_text(const StepTotals& totals) {
  return fmt::format("cluster of {}, {} retried", grouped(totals.largest_cluster),
                     grouped(totals.num_retried_steps));
}

std::array<NamedText, 3> ball_texts(const FrameView& frame) {
  const std::optional<FreeFlowFigures>& flow = frame.free_flow;
  if (!flow) {
    return {{{"ball", fmt::format("{:.2f} m/s", length(frame.ball.velocity_mps))},
             {"spin", fmt::format("{:.1f} rad/s", frame.ball.spin_radps)},
             {"flown", fmt::format("{:.2f} m", frame.ball_distance_m)}}};
  }
  const auto share = [](double ratio, double error) {
    return fmt::format("{:.1f} \xC2\xB1 {:.1f} %", 100.0 * ratio, 100.0 * error);
  };
  return {{{"held ball", "of theory"},
           {"drag", share(flow->drag_over_theory, flow->drag_error)},
           {"hits", share(flow->hits_over_theory, flow->hits_error)}}};
}

std::string fitting_parts(std::vector<LinePart> parts, float width,
                          const std::function<float(const std::string&)>& width_of) {
  const auto joined = [&] {
    std::string line;
    for (const LinePart& part : parts) line += (line.empty() ? "" : "   ") + part.text;
    return line;
  };
  const auto less = [](const LinePart& a, const LinePart& b) { return a.importance < b.importance; };
  while (parts.size() > 1 && width_of(joined()) > width)
    parts.erase(std::min_element(parts.begin(), parts.end(), less));
  return joined();
}

std::string air_text(const FrameView& frame) {
  const Air air = frame.settings->air;
  if (air == Air::parcels) return counted(frame.num_parcels, "parcel");
  return std::string(air_name(air)) + (air == Air::drag ? ", no parcels" : "");
}

}  // namespace pf
