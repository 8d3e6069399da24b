// Compared flights: the rows of the legend.
#include <gtest/gtest.h>

#include <cmath>

#include "unit/frames.hpp"
#include "view/scene_marks.hpp"

namespace pf {
namespace {

TEST(FlightLegend, ComparesFlightsOfTheSameLaunchOnly) {
  Frames frames;
  frames.flight.launch = 2;
  frames.flight.method = Method::spring;
  FlightRecord first = frames.flight, other = frames.flight;
  first.method = Method::impulse;
  first.points_m = {{0.0F, 0.0F}, {1.0F, 0.0F}};
  first.times_s = {0.0, 1.0};
  first.start_energy_j = 2.0;
  first.end_energy_j = 1.5;
  frames.flight.points_m = {{0.0F, 0.0F}, {1.0F, 2.0F}};
  frames.flight.times_s = {0.0, 1.0};
  other.launch = 1;
  frames.old_flights = {first, other};
  const auto rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].apart, "-");
  EXPECT_EQ(rows[0].method, "impulse, cut short");
  EXPECT_EQ(rows[0].energy, "-");  // of another duration than those that are complete
  EXPECT_EQ(rows[1].method, "spring");
  EXPECT_TRUE(rows[1].is_current);
  EXPECT_EQ(rows[1].apart, "2 m, 2 m");
  EXPECT_EQ(rows[1].energy, "...");
  EXPECT_EQ(rows[2].apart, "");
}

// A flight that leaves the court at a speed along x, and in which 2 ms are computed a step of 0.1 s.
FlightRecord leaving(Method method, float speed_mps, int num_steps) {
  FlightRecord flight;
  flight.launch = 1;
  flight.method = method;
  for (int i = 0; i <= num_steps; ++i) {
    flight.points_m.push_back({0.1F * speed_mps * static_cast<float>(i), 0.0F});
    flight.times_s.push_back(0.1 * i);
  }
  flight.num_steps = static_cast<std::uint64_t>(num_steps);
  flight.compute_ms = 2.0 * num_steps;
  flight.start_energy_j = 3.0;
  flight.end_energy_j = 2.0;
  flight.has_left = flight.points_m.back().x > 6.7F;
  return flight;
}

TEST(FlightLegend, ComparesOverTheShortestCompleteFlight) {
  Frames frames;
  frames.flight = leaving(Method::exact, 10.0F, 8);                   // 0.8 s to 8 m, outside
  const FlightRecord reference = leaving(Method::impulse, 8.0F, 10);  // 1 s to 8 m
  const FlightRecord cut = leaving(Method::spring, 8.0F, 3);
  frames.old_flights = {cut, reference};
  const auto rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].method, "impulse, 100 ms");
  EXPECT_EQ(rows[0].cost, "20 ms");  // for a second
  EXPECT_EQ(rows[0].energy, "-33.3 %");
  EXPECT_EQ(rows[1].apart, "1.6 m, 1.6 m");  // at 0.8 s
  EXPECT_EQ(rows[1].cost, "20 ms");
  EXPECT_EQ(rows[2].method, "spring, 100 ms, cut short");
  EXPECT_EQ(rows[2].apart, "-");
  EXPECT_EQ(rows[2].energy, "-");
}

TEST(FlightLegend, FlightsOfOtherLaunchesHaveTheirCost) {
  Frames frames;
  frames.flight = leaving(Method::exact, 10.0F, 5);
  frames.flight.launch = 2;
  EXPECT_EQ(flight_rows(frames.view)[0].cost, "");  // a flight alone
  frames.old_flights = {leaving(Method::exact, 10.0F, 8), leaving(Method::exact, 10.0F, 3)};
  const auto rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].cost, "...");
  EXPECT_EQ(rows[1].cost, "20 ms");  // for a second
  EXPECT_EQ(rows[2].cost, "20 ms");  // cut short
  EXPECT_EQ(rows[1].energy + rows[1].apart, "");
}

TEST(FlightLegend, ComparesWithTheFirstWholeFlight) {
  Frames frames;
  frames.flight = leaving(Method::exact, 10.0F, 6);  // on its way
  const FlightRecord cut = leaving(Method::spring, 8.0F, 3);
  frames.old_flights = {cut};
  EXPECT_EQ(&reference_of(frames.flight, frames.old_flights), &frames.old_flights[0]);
  frames.flight = leaving(Method::exact, 10.0F, 8);
  EXPECT_EQ(&reference_of(frames.flight, frames.old_flights), &frames.flight);
  auto rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].method, "exact, 100 ms");
  EXPECT_EQ(rows[0].cost, "20 ms");
  EXPECT_EQ(rows[1].method, "spring, 100 ms, cut short");
  EXPECT_EQ(rows[1].apart, "-");
  frames.old_flights = {frames.flight, cut};
  frames.flight = leaving(Method::impulse, 8.0F, 10);
  rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].method, "exact, 100 ms");
  EXPECT_EQ(rows[1].method, "impulse, 100 ms");
  EXPECT_EQ(rows[1].apart, "1.6 m, 1.6 m");  // at 0.8 s
}

// Else a changed setting would look like a method's error.
TEST(FlightLegend, NamesSettingsThatDiffer) {
  Frames frames;
  frames.flight = leaving(Method::exact, 10.0F, 8);
  const FlightRecord reference = leaving(Method::impulse, 8.0F, 10);
  frames.old_flights = {reference};
  frames.flight.settings.restitution = 0.4;
  frames.flight.settings.num_parcels = 9000;
  frames.flight.settings.method = Method::exact;
  EXPECT_EQ(flight_rows(frames.view)[1].method, "exact, 100 ms, num_parcels 9000, restitution 0.4");
  frames.flight.settings.friction = 0.9;
  EXPECT_EQ(flight_rows(frames.view)[1].method,
            "exact, 100 ms, num_parcels 9000, restitution 0.4 and 1 more");
  EXPECT_EQ(flight_rows(frames.view)[0].method, "impulse, 100 ms");
  EXPECT_EQ(flight_rows(frames.view)[0].name, "impulse");
  EXPECT_EQ(flight_rows(frames.view)[1].name, "exact *") << "also where there is no room for the settings";
}

// Also of flights that are not compared, as after a slider was moved between two launches.
TEST(FlightLegend, NamesWhatDiffersFromTheCurrentFlight) {
  Frames frames;
  frames.flight.settings.restitution = 0.2;
  FlightRecord earlier = frames.flight;
  frames.flight.launch = 2;
  earlier.launch = 1;
  earlier.settings.restitution = 0.9;
  frames.old_flights = {earlier};
  const auto rows = flight_rows(frames.view);
  ASSERT_EQ(rows.size(), 2U);
  for (const FlightRow& row : rows)
    EXPECT_EQ(row.method, row.is_current ? "impulse" : "impulse, restitution 0.9");
}

TEST(FlightLegend, ColourIsOfTheMethodWhereverTheRowStands) {
  FlightRecord flight;
  std::vector<Rgb> colors;
  for (const Method method : {Method::impulse, Method::spring, Method::exact}) {
    flight.method = method;
    flight.half_step = false;
    EXPECT_EQ(flight_color(Theme::dark, flight), method_color(Theme::dark, method));
    colors.push_back(flight_color(Theme::dark, flight));
    flight.half_step = true;
    colors.push_back(flight_color(Theme::dark, flight));
  }
  std::sort(colors.begin(), colors.end());
  EXPECT_EQ(std::unique(colors.begin(), colors.end()), colors.end());
}

}  // namespace
}  // namespace pf
