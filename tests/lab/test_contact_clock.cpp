// The study of the contact duration, and the frames of the stability study.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "lab/contact_clock_shifts.hpp"
#include "lab/frame_cases.hpp"
#include "lab/study.hpp"

namespace pf::test {
namespace {

using nlohmann::json;

json row(const char* name, double restitution, double clock, json runs) {
  return {{"case", name}, {"restitution", restitution}, {"clock", clock}, {"runs", std::move(runs)}};
}

TEST(ContactClockStudy, ShiftsAreOfTheSameSeedAndRestitution) {
  json result;
  result["points"] = {row("flight", 0.5, 0.1, {{6.0, 8.8, 4.2, 30.0}, {6.0, 8.0, 4.0, 50.0}}),
                      row("flight", 0.9, 0.0, {{1.0, 0.0, 1.0, 1.0}, {1.0, 0.0, 1.0, 1.0}}),
                      row("flight", 0.5, 0.0, {{6.0, 8.0, 4.0, 40.0}, {6.0, 8.0, 4.0, 40.0}}),
                      row("gas", 0.9, 0.1, {{11.0, 0.5}})};
  conclude_contact_clock(result);
  const json& shifted = result["points"][0];
  EXPECT_NEAR(shifted["path"].get<double>(), 0.5 * (std::hypot(6.0, 8.8) / 10.0 - 1.0), 1e-12);
  EXPECT_NEAR(shifted["drag"].get<double>(), 0.025, 1e-12);
  EXPECT_NEAR(shifted["drag_sigma"].get<double>(), 0.025, 1e-12);
  EXPECT_NEAR(shifted["collisions"].get<double>(), 40.0, 1e-12);
  EXPECT_EQ(result["points"][1]["drag"], 0.0) << "its own measure";
  EXPECT_FALSE(result["points"][3].contains("rate")) << "no run without a contact duration";
}

TEST(FrameCases, VaryOneSettingOfTheCourtEach) {
  const std::vector<FrameCase> cases = frame_cases(Method::exact, true);
  std::set<std::string> axes;
  for (const FrameCase& flight : cases) {
    axes.insert(flight.axis);
    Settings s = flight.settings;
    const std::string axis = flight.axis;
    EXPECT_EQ(flight.value, axis == "restitution"     ? s.restitution
                            : axis == "area fraction" ? s.area_fraction
                            : axis == "ball speed"    ? s.ball_vx_mps
                                                      : static_cast<double>(s.num_parcels));
    if (axis == "restitution") s.contact_clock = Settings{}.contact_clock;
    s.restitution = 0.9;
    s.area_fraction = 0.1;
    s.ball_vx_mps = 15.0;
    s.num_parcels = 4000;
    s.method = Settings{}.method;
    Settings plain;
    plain.num_parcels = 4000;
    EXPECT_EQ(s, plain) << axis << " " << flight.value;
  }
  EXPECT_EQ(axes, (std::set<std::string>{"area fraction", "ball speed", "number of parcels", "restitution"}));
}

TEST(FrameCases, ARowHasEveryFigure) {
  FrameCase flight = frame_cases(Method::exact, true).front();
  flight.settings.num_parcels = 500;
  const json row = measure_frames(flight, true);
  EXPECT_GT(row["frames"].get<int>(), 100);
  EXPECT_GE(row["worst_ms"].get<double>(), row["median_ms"].get<double>());
  EXPECT_GE(row["worst_over_mean"].get<double>(), 1.0);
  EXPECT_FALSE(row["refused"].get<bool>());
}

// Timings wait until nothing runs beside them.
TEST(FrameCases, RunAloneInTheStudy) {
  std::size_t num_frames = 0;
  for (const LabPoint& point : stability_study().plan({true, {}, "court"})) {
    const bool is_frame = point.key.starts_with("frames/");
    num_frames += is_frame ? 1 : 0;
    EXPECT_EQ(point.is_timing, is_frame) << point.key;
  }
  EXPECT_EQ(num_frames, frame_cases(Method::impulse, true).size() + frame_cases(Method::exact, true).size());
}

}  // namespace
}  // namespace pf::test
