// The table of settings, and conversion of settings to and from text.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "scene/settings.hpp"
#include "support/text.hpp"

namespace pf {
namespace {

std::string message_of(const std::string& path, const std::string& text) {
  Settings settings;
  try {
    set_from_text(find_field(path, "test"), settings, text, "here");
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

Settings with(const std::string& path, const std::string& text) {
  Settings settings;
  set_from_text(find_field(path, "test"), settings, text, "test");
  return settings;
}

std::string number_text(double value) {
  std::ostringstream text;
  text << std::setprecision(17) << value;
  return text.str();
}

const std::set<std::string>& all_paths() {
  static const std::set<std::string> paths = {"scene.description",
                                              "world.width_m",
                                              "world.height_m",
                                              "world.boundary",
                                              "world.box_follows_parcels",
                                              "air.kind",
                                              "air.num_parcels",
                                              "air.num_parcels_cpu",
                                              "air.num_parcels_gpu",
                                              "air.area_fraction",
                                              "air.areal_density_kg_m2",
                                              "air.parcel_radius_m",
                                              "air.drawn_area_fraction",
                                              "air.parcel_mass_kg",
                                              "air.parcel_speed_mps",
                                              "air.flow_x_mps",
                                              "air.flow_y_mps",
                                              "air.hot_radius_m",
                                              "air.hot_speed_mps",
                                              "air.restitution",
                                              "air.impulse_scale",
                                              "air.contacts",
                                              "ball.present",
                                              "ball.held",
                                              "ball.mass_kg",
                                              "ball.radius_m",
                                              "ball.inertia",
                                              "ball.x_m",
                                              "ball.y_m",
                                              "ball.vx_mps",
                                              "ball.vy_mps",
                                              "ball.spin_radps",
                                              "ball.friction",
                                              "ball.magnus",
                                              "ball.k_magnus",
                                              "run.method",
                                              "run.neighbors",
                                              "run.dt_s",
                                              "run.displacement_per_step",
                                              "run.substeps",
                                              "run.max_substeps",
                                              "run.frame_budget_ms",
                                              "run.time_scale",
                                              "run.frame_rate_hz",
                                              "run.seconds",
                                              "run.seed",
                                              "run.threads",
                                              "run.spring_contact_s",
                                              "run.allow_unstable",
                                              "run.contact_clock",
                                              "run.contact_clock_s",
                                              "run.profile",
                                              "run.profile_bins",
                                              "run.relaunch",
                                              "view.follow",
                                              "view.magnifier"};
  return paths;
}

TEST(Fields, CoverEverySettingOnce) {
  std::set<std::string> found;
  for (const Field& field : fields()) EXPECT_TRUE(found.insert(field.path()).second) << field.path();
  EXPECT_EQ(found, all_paths());
}

// Each row must reach its own member: a change of its value changes its text and no other.
TEST(Fields, RowsReachDifferentMembers) {
  for (const Field& field : fields()) {
    Settings changed;
    const std::string before = value_text(field, changed);
    if (const auto* choice = std::get_if<Choice>(&field.member)) {
      const auto num = static_cast<int>(choice->names.size());
      choice->set(changed, (choice->get(changed) + 1) % num);
    } else if (std::holds_alternative<bool Settings::*>(field.member)) {
      set_from_text(field, changed, before == "true" ? "false" : "true", "test");
    } else if (std::holds_alternative<std::string Settings::*>(field.member)) {
      set_from_text(field, changed, "other", "test");
    } else {
      set_from_text(field, changed, number_text(field.max),
                    "test");  // no default equals an end of its range
    }
    for (const Field& other : fields()) {
      const bool same = value_text(other, changed) == value_text(other, Settings{});
      EXPECT_EQ(same, other.path() != field.path()) << field.path() << " and " << other.path();
    }
  }
}

TEST(Fields, DefaultsLieInTheirRanges) {
  for (const Field& field : fields()) {
    Settings copy;
    EXPECT_NO_THROW(set_from_text(field, copy, value_text(field, copy), "test")) << field.path();
    EXPECT_EQ(copy, Settings{}) << field.path();
    EXPECT_FALSE(field.doc.empty()) << field.path();
    EXPECT_FALSE(contains(field.doc, "\n")) << field.path();
  }
}

TEST(Fields, HaveTheDocumentedRanges) {
  const auto range = [](const char* path) {
    const Field& field = find_field(path, "test");
    return std::pair(field.min, field.max);
  };
  EXPECT_EQ(range("air.num_parcels"), std::pair(0.0, 1e9));
  EXPECT_EQ(range("air.restitution"), std::pair(0.0, 1.0));
  EXPECT_EQ(range("run.time_scale"), std::pair(1e-6, 100.0));
  EXPECT_EQ(range("run.threads"), std::pair(0.0, 1024.0));
  EXPECT_EQ(range("air.area_fraction").second, 0.7);
  EXPECT_EQ(find_field("air.areal_density_kg_m2", "test").unit, "kg/m^2");
}

TEST(ValueText, RoundTripsDoublesExactly) {
  const Field& field = find_field("ball.vx_mps", "test");
  for (const double value : {0.1, 1.0 / 3.0, -1e-300, 99999.999999999985, 5e-324, -0.0}) {
    Settings settings;
    settings.ball_vx_mps = value;
    Settings read;
    set_from_text(field, read, value_text(field, settings), "test");
    EXPECT_EQ(read.ball_vx_mps, value) << value_text(field, settings);
    EXPECT_EQ(std::signbit(read.ball_vx_mps), std::signbit(value));
  }
}

TEST(ValueText, IsTheShortestForm) {
  EXPECT_EQ(value_text(find_field("air.restitution", "test"), Settings{}), "0.9");
  EXPECT_EQ(value_text(find_field("ball.vx_mps", "test"), Settings{}), "15");
  EXPECT_EQ(value_text(find_field("air.num_parcels_gpu", "test"), Settings{}), "1000000");
  EXPECT_EQ(value_text(find_field("run.neighbors", "test"), with("run.neighbors", "all-pairs")), "all-pairs");
  EXPECT_EQ(value_text(find_field("ball.magnus", "test"), Settings{}), "true");
}

TEST(SetFromText, ReadsEveryKind) {
  EXPECT_EQ(with("air.num_parcels", "1e6").num_parcels, 1000000);
  EXPECT_EQ(with("air.num_parcels", "200000000").num_parcels, 200000000);
  EXPECT_EQ(with("air.num_parcels", "+7").num_parcels, 7);
  for (const char* most : {"9007199254740992", "+9007199254740992", "9007199254740992.0"})
    EXPECT_EQ(with("run.seed", most).seed, 9007199254740992) << most;
  for (const char* above :
       {"9007199254740993", "+9007199254740993", "9007199254740993.0", "9.007199254740993e15"})
    EXPECT_TRUE(contains(message_of("run.seed", above), "is out of range")) << above;
  EXPECT_EQ(with("air.restitution", "1").restitution, 1.0);
  EXPECT_EQ(with("ball.magnus", "off").magnus, false);
  EXPECT_EQ(with("world.boundary", "walls").boundary, Boundary::walls);
  EXPECT_EQ(with("air.kind", "vacuum").air, Air::vacuum);
  EXPECT_EQ(with("ball.inertia", "disk").inertia, Inertia::disk);
  EXPECT_EQ(with("run.method", "spring").method, Method::spring);
  EXPECT_EQ(with("run.method", "exact").method, Method::exact);
  EXPECT_EQ(with("run.neighbors", "all-pairs").neighbors, Neighbors::all_pairs);
  EXPECT_EQ(with("scene.description", "a b").description, "a b");
}

TEST(SetFromText, ErrorNamesPlaceValueRangeAndDefault) {
  EXPECT_EQ(message_of("air.restitution", "1.5"),
            "here: '1.5' is out of range; air.restitution takes a number from 0 to 1 (default 0.9)");
  EXPECT_EQ(
      message_of("air.parcel_speed_mps", "fast"),
      "here: 'fast' is not a number; air.parcel_speed_mps takes a number from 0 to 100000 m/s (default 1)");
  EXPECT_EQ(
      message_of("world.boundary", "wall"),
      "here: 'wall' is unknown, the nearest is walls; world.boundary takes one of open, walls, periodic "
      "(default open)");
}

TEST(SetFromText, RejectsUnusableNumbers) {
  for (const char* text : {"nan", "-nan", "inf", "-inf", "NaN"}) {
    EXPECT_TRUE(contains(message_of("ball.vx_mps", text), "is not a finite number")) << text;
    EXPECT_TRUE(contains(message_of("run.seed", text), "is not a finite number")) << text;
  }
  for (const char* text : {"", " ", "1x", "0x10", "1,5", "--1", "+-1", "1_000", "one"}) {
    EXPECT_TRUE(contains(message_of("ball.vx_mps", text), "is not a number")) << text;
  }
  EXPECT_TRUE(contains(message_of("ball.vx_mps", "1e999"), "is out of range"));
  EXPECT_TRUE(contains(message_of("air.num_parcels", "1000000000000"), "is out of range"));
  EXPECT_EQ(limit_text(9007199254740992.0), "2^53");
  EXPECT_EQ(limit_text(-1e6), "-1 million");
  EXPECT_EQ(limit_text(2e9), "2 billion");
  EXPECT_EQ(limit_text(1.5e6), "1500000");
  EXPECT_TRUE(contains(message_of("air.num_parcels", "-5"), "whole number from 0 to 1 billion"));
  EXPECT_TRUE(contains(message_of("air.num_parcels", "1.5"), "is not a whole number"));
  EXPECT_TRUE(contains(message_of("ball.magnus", "maybe"), "is neither true nor false"));
  EXPECT_TRUE(contains(message_of("scene.description", std::string(1001, 'a')), "is too long"));
  EXPECT_TRUE(contains(message_of("scene.description", "one\xFF"), "is not UTF-8"));
}

// Every number rejects values just beyond its range, absurd ones and NaN with the same error. The ends of the
// range are allowed.
TEST(SetFromText, ChecksTheRangeOfEveryNumber) {
  for (const Field& field : fields()) {
    const bool is_whole = std::holds_alternative<std::int64_t Settings::*>(field.member);
    if (!is_whole && !std::holds_alternative<double Settings::*>(field.member)) continue;
    const std::string path = field.path();
    const double step = is_whole ? 1.0 : 1e-9 * std::max(std::fabs(field.min), std::fabs(field.max));
    // 2^53 + 1 is not a double.
    const double above = field.max + (is_whole ? std::max(1.0, 1e-15 * field.max) : step);
    EXPECT_EQ(message_of(path, number_text(field.min)), "") << path;
    EXPECT_EQ(message_of(path, number_text(field.max)), "") << path;
    for (const std::string& text : {number_text(field.min - step), number_text(above), std::string("1e300"),
                                    std::string("-1e300"), std::string("1e999")}) {
      EXPECT_TRUE(message_of(path, text)
                      .starts_with("here: '" + text + "' is out of range; " + path +
                                   (is_whole ? " takes a whole number" : " takes a number")))
          << path << " " << text << " " << message_of(path, text);
    }
    for (const char* text : {"nan", "inf", "-inf"}) {
      EXPECT_TRUE(contains(message_of(path, text), "is not a finite number; " + path + " takes")) << path;
    }
  }
}

TEST(SetFromText, RejectsAbsurdSizesMassesAndSteps) {
  for (const char* path : {"ball.radius_m", "ball.mass_kg", "world.width_m", "air.areal_density_kg_m2",
                           "air.area_fraction", "run.time_scale", "run.displacement_per_step"}) {
    EXPECT_TRUE(contains(message_of(path, "0"), "'0' is out of range")) << path;
  }
  for (const char* path :
       {"ball.radius_m", "ball.mass_kg", "air.parcel_radius_m", "air.parcel_mass_kg", "air.parcel_speed_mps",
        "run.dt_s", "run.threads", "run.substeps", "run.seconds"}) {
    EXPECT_TRUE(contains(message_of(path, "-1"), "'-1' is out of range")) << path;
  }
  for (const char* path : {"ball.vx_mps", "ball.vy_mps", "air.flow_x_mps", "air.parcel_speed_mps"}) {
    EXPECT_TRUE(contains(message_of(path, "3e8"), "to 100000 m/s")) << path;
  }
  EXPECT_TRUE(contains(message_of("air.area_fraction", "0.71"), "from 1e-12 to 0.7"));
}

TEST(CheckSettings, GivesTheSameErrorsAsText) {
  const auto message = [](const Settings& settings) {
    try {
      check_settings(settings, "panel");
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(Settings{}), "");
  Settings settings;
  settings.ball_spin_radps = std::nan("");
  EXPECT_EQ(
      message(settings),
      "panel: 'nan' is not a finite number; ball.spin_radps takes a number from -100000 to 100000 rad/s "
      "(default 25)");
  settings = {};
  settings.dt_s = HUGE_VAL;
  EXPECT_TRUE(contains(message(settings), "panel: 'inf' is not a finite number; run.dt_s takes"));
  settings = {};
  settings.threads = -1;
  EXPECT_TRUE(contains(message(settings), "panel: '-1' is out of range; run.threads takes"));
}

TEST(SetFromText, KeepsSettingsOnError) {
  Settings settings;
  EXPECT_THROW(set_from_text(find_field("air.restitution", "t"), settings, "2", "t"), UserError);
  EXPECT_EQ(settings, Settings{});
}

TEST(SetFromText, ErrorsHaveOneLine) {
  const std::string message = message_of("ball.vx_mps", "1\n2\x1b[0m" + std::string(500, 'x'));
  EXPECT_FALSE(contains(message, "\n"));
  EXPECT_FALSE(contains(message, "\x1b"));
  EXPECT_LT(message.size(), 250U);
}

TEST(FindField, NamesTheNearest) {
  const auto message = [](const std::string& path) {
    try {
      find_field(path, "--set");
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(contains(message("air.restituton"),
                       "--set: 'air.restituton' is not a setting; the nearest is "
                       "air.restitution"));
  EXPECT_TRUE(contains(message("seed"), "the nearest is run.seed")) << message("seed");
  EXPECT_TRUE(contains(message("ball.boundary"), "the nearest is world.boundary"));
}

TEST(NearestName, ByEditDistance) {
  EXPECT_EQ(nearest_name("implse", {"spring", "impulse", "exact"}), "impulse");
  EXPECT_EQ(nearest_name("GRID", {"all-pairs", "grid"}), "grid");
  EXPECT_EQ(nearest_name("", {"abc", "a"}), "a");
  EXPECT_EQ(nearest_name("abc", {"abd", "abc"}), "abc");
  EXPECT_EQ(nearest_name("hots", {"host"}), "host");
  EXPECT_EQ(nearest_name("valid", {"validate", "plot"}), "validate");
  for (const char* far : {"xyzzy", "--parcels"}) EXPECT_EQ(nearest_name(far, {"blast", "--force"}), "");
  EXPECT_EQ(say_nearest("; try [", "bal", {"ball"}, "]"), "; try [ball]");
  EXPECT_EQ(say_nearest("; try [", "xyzzy", {"ball"}, "]"), "");
}

}  // namespace
}  // namespace pf
