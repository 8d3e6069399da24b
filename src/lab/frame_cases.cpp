#include "lab/frame_cases.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/statistics.hpp"
#include "lab/flight_case.hpp"

namespace pf {

std::vector<FrameCase> frame_cases(Method method, bool quick) {
  Settings court = court_settings({quick ? 4000 : 20000, 0.1, 0.9});
  court.method = method;
  std::vector<FrameCase> cases;
  const auto add = [&](const char* axis, double value) -> Settings& {
    cases.push_back({axis, value, court});
    return cases.back().settings;
  };
  for (const double e : {0.0, 0.3, 0.5, 0.7, 0.9, 1.0}) add("restitution", e).restitution = e;
  if (method == Method::exact) {
    for (const double e : {0.0, 0.3, 0.5, 0.7, 0.9}) {
      Settings& s = add("restitution", e);
      s.restitution = e;
      s.contact_clock = 0.0;
    }
  }
  for (const double eta : {0.05, 0.1, 0.2, 0.4, 0.6}) add("area fraction", eta).area_fraction = eta;
  for (const double speed : {5.0, 15.0, 30.0, 60.0, 120.0, 300.0})
    add("ball speed", speed).ball_vx_mps = speed;
  const double max_parcels = quick ? 20000.0 : 100000.0;
  for (double num = 1000.0; num <= max_parcels; num *= num == 1000.0 ? 4.0 : 5.0)
    add("number of parcels", num).num_parcels = static_cast<std::int64_t>(num);
  return cases;
}

namespace {

constexpr std::size_t kMinFlights = 4, kMaxFlights = 8;

// Keeps the shorter time of each frame.
void take_shorter(const std::vector<double>& other_ms, std::vector<double>& ms) {
  ms.resize(std::min(ms.size(), other_ms.size()));
  for (std::size_t k = 0; k < ms.size(); ++k) ms[k] = std::min(ms[k], other_ms[k]);
}

}  // namespace

nlohmann::json measure_frames(const FrameCase& flight, bool quick) {
  const double max_wall_s = quick ? 2.0 : 30.0;
  const std::unique_ptr<Backend> backend = make_cpu_backend(2);
  const auto fly = [&] { return fly_frames(flight.settings, 10.0, max_wall_s, *backend); };
  const Clock::time_point start = Clock::now();
  FlightFrames flown = fly();
  std::vector<double>& ms = flown.frame_ms;
  std::size_t num_flights = 1;
  while (num_flights < kMinFlights ||
         (num_flights < kMaxFlights && milliseconds_since(start) < 1e3 * max_wall_s)) {
    take_shorter(fly().frame_ms, ms);
    ++num_flights;
  }
  nlohmann::json row = {{"axis", flight.axis},
                        {"value", flight.value},
                        {"method", method_name(flight.settings.method)},
                        {"contact_clock", flight.settings.contact_clock},
                        {"flights", num_flights},
                        {"frames", ms.size()},
                        {"flown_s", flown.time_s},
                        {"refused", flown.refused},
                        {"max_overlap", flown.totals.max_overlap_diameters}};
  if (ms.empty()) return row;
  const double mean = std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size());
  const double worst = *std::max_element(ms.begin(), ms.end());
  row["mean_ms"] = mean;
  row["median_ms"] = median_of(ms);
  row["worst_ms"] = worst;
  row["worst_over_mean"] = worst / mean;
  return row;
}

}  // namespace pf
