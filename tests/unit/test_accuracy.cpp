// The choice of method, step and parcels from a table.
#include "app/accuracy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/accuracy_table.hpp"
#include "core/error.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

using nlohmann::json;

json row(const char* method, double eta, double displacement, double error, double cost) {
  return {{"group", "gas"},           {"device", "cpu"},
          {"method", method},         {"area_fraction", eta},
          {"restitution", 1.0},       {"displacement_per_step", displacement},
          {"ns_per_disc_time", cost}, {"errors", {{"rate", {{"value", error}, {"bound", false}}}}}};
}

// impulse is cheap and inaccurate, and its error crosses zero at the longest step. exact costs 100.
json table() {
  json rows = json::array();
  for (const double eta : {0.1, 0.3}) {
    const double denser = eta == 0.3 ? 2.0 : 1.0;
    rows.push_back(row("impulse", eta, 2.0, 0.0001, 1.0));
    rows.push_back(row("impulse", eta, 1.0, 0.2 * denser, 10.0));
    rows.push_back(row("impulse", eta, 0.5, 0.05 * denser, 20.0));
    rows.push_back(row("impulse", eta, 0.25, 0.0125 * denser, 40.0));
    rows.push_back(row("impulse", eta, 0.0625, 0.0008 * denser, 160.0));
    rows.push_back(row("exact", eta, 0.3, 0.0001, 120.0));
    rows.push_back(row("exact", eta, 0.2, 0.0001, 100.0));
  }
  return {{"kind", "lab"}, {"study", "work-precision"}, {"points", rows}};
}

Settings gas_scene(double eta) {
  Settings s = load_scene("gas");
  s.num_parcels = 1000;
  s.area_fraction = eta;
  return s;
}

AccuracyChoice choose(double error, double eta) {
  return choose_by_accuracy(table(), gas_scene(eta), {error, "rate", false}, "cpu");
}

TEST(Accuracy, ChoosesTheCheapestThatMeetsTheError) {
  const AccuracyChoice rough = choose(0.1, 0.1);
  EXPECT_EQ(rough.settings.method, Method::impulse);
  EXPECT_EQ(rough.settings.displacement_per_step, 0.5);
  EXPECT_EQ(rough.expected_error, 0.05);
  const AccuracyChoice fine = choose(0.002, 0.1);
  EXPECT_EQ(fine.settings.method, Method::exact) << "impulse costs 160, exact 100";
  EXPECT_EQ(fine.settings.displacement_per_step, 0.2) << "the cheaper of its steps";
}

// The nearest case has area fraction 0.1. Half way between two steps, in logarithms, lies the mean of their
// logarithms.
TEST(WorkPrecision, CurrentPointIsInterpolated) {
  Settings scene = gas_scene(0.12);
  const WorkPrecision picture = work_precision(table(), scene, "rate", "cpu", std::sqrt(0.5));
  EXPECT_EQ(picture.area_fraction, 0.1);
  ASSERT_EQ(picture.methods[static_cast<int>(Method::impulse)].size(), 5U);
  EXPECT_TRUE(picture.methods[static_cast<int>(Method::spring)].empty());
  ASSERT_TRUE(picture.current);
  EXPECT_NEAR(picture.current->error, std::sqrt(0.2 * 0.05), 1e-12);
  EXPECT_NEAR(picture.current->ns_per_disc_time, std::sqrt(10.0 * 20.0), 1e-12);
  EXPECT_EQ(work_precision(table(), scene, "rate", "cpu", 1e-3).current->error, 0.0008);
  EXPECT_EQ(work_precision(table(), scene, "rate", "cpu", 9.0).current->error, 0.0001);
  scene.method = Method::spring;
  EXPECT_FALSE(work_precision(table(), scene, "rate", "cpu", 0.5).current);
  EXPECT_TRUE(work_precision(table(), scene, "drag", "cpu", 0.5).methods[0].empty());
}

// A small error at a step longer than a failing one is accidental.
TEST(Accuracy, IgnoresAnErrorThatCrossesZero) {
  EXPECT_EQ(choose(0.2, 0.1).settings.displacement_per_step, 0.5);
}

TEST(Accuracy, BetweenCasesTheStricterDecides) {
  const AccuracyChoice between = choose(0.1, 0.2);
  EXPECT_EQ(between.settings.displacement_per_step, 0.25) << "at 0.3 the step of 0.5 errs by 0.1";
  EXPECT_EQ(between.expected_error, 0.025);
}

// A radius that is given sets the density: air.area_fraction is ignored then.
TEST(Accuracy, DensityFollowsFromAGivenRadius) {
  Settings s = load_scene("court");
  s.num_parcels = 1000;
  s.restitution = 1.0;
  s.area_fraction = 0.1;
  const auto choice = [&] { return choose_by_accuracy(table(), s, {0.1, "rate", false}, "cpu"); };
  EXPECT_EQ(choice().settings.displacement_per_step, choose(0.1, 0.1).settings.displacement_per_step);
  s.area_fraction = 0.3;
  s.parcel_radius_m = derive_physics(s).parcels.radius_m;
  s.area_fraction = 0.1;
  EXPECT_EQ(choice().settings.displacement_per_step, choose(0.1, 0.3).settings.displacement_per_step);
  EXPECT_NE(choose(0.1, 0.1).settings.displacement_per_step, choose(0.1, 0.3).settings.displacement_per_step);
  s.parcel_radius_m *= 1.4;
  EXPECT_EQ(choice().settings.method, Method::exact) << "denser than the table";
}

TEST(Accuracy, BeyondTheTableOnlyExactIsChosen) {
  const AccuracyChoice dense = choose(0.5, 0.6);
  EXPECT_EQ(dense.settings.method, Method::exact);
  EXPECT_EQ(dense.remarks.size(), 1U);
}

TEST(Accuracy, SaysWhereTheTableFitsLess) {
  Settings scene = gas_scene(0.1);
  const AccuracyWish wish{0.1, "rate", false};
  EXPECT_TRUE(choose_by_accuracy(table(), scene, wish, "cpu").remarks.empty());
  scene.flow_x_mps = -1.4;
  const std::vector<std::string> remarks = choose_by_accuracy(table(), scene, wish, "cpu").remarks;
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].find("of a gas at rest"), std::string::npos) << remarks[0];
  scene.contacts = false;
  EXPECT_THROW(choose_by_accuracy(table(), scene, wish, "cpu"), UserError);
}

// At 0.002 exact is cheaper than the impulse of shorter steps.
TEST(Accuracy, LeavesOutMethodsThatCannotBeFlown) {
  AccuracyWish wish{0.002, "rate", false};
  wish.refused[static_cast<std::size_t>(Method::exact)] = true;
  const AccuracyChoice choice = choose_by_accuracy(table(), gas_scene(0.1), wish, "cpu");
  EXPECT_EQ(choice.settings.method, Method::impulse);
  EXPECT_EQ(choice.settings.displacement_per_step, 0.0625);
  ASSERT_EQ(choice.remarks.size(), 1U);
  EXPECT_NE(choice.remarks.front().find("several domains can fly: impulse, spring"), std::string::npos);
  const auto refusal = [&](double error, double eta) -> std::string {
    wish.error = error;
    try {
      return choose_by_accuracy(table(), gas_scene(eta), wish, "cpu").settings.name;
    } catch (const UserError& thrown) {
      return thrown.what();
    }
  };
  EXPECT_NE(refusal(0.0005, 0.1).find("only exact is so accurate"), std::string::npos);
  EXPECT_NE(refusal(0.0005, 0.1).find("a larger error"), std::string::npos);
  EXPECT_NE(refusal(0.5, 0.6).find("only exact is so accurate"), std::string::npos) << "beyond the table";
  EXPECT_EQ(refusal(0.5, 0.6).find("a larger error"), std::string::npos) << "which would not help";
}

TEST(Accuracy, NumberOfParcelsFollowsTheTableAndItsLaw) {
  json with = table();
  for (const double num : {500.0, 2000.0}) {
    json wall = row("exact", 0.2, 0.2, num == 500.0 ? 0.04 : 0.02, 1.0);
    wall["group"] = "parcels";
    wall["num_parcels"] = num;
    with["points"].push_back(wall);
  }
  const AccuracyWish wish{0.05, "rate", false};
  EXPECT_EQ(choose_by_accuracy(with, gas_scene(0.1), wish, "cpu").settings.num_parcels, 2000)
      << "0.6 of 5 % are 3 %";
  const AccuracyChoice more = choose_by_accuracy(with, gas_scene(0.1), {0.01, "rate", false}, "cpu");
  EXPECT_EQ(more.settings.num_parcels, 22223) << "2000 (0.02 / 0.006)^2";
  const AccuracyChoice kept = choose_by_accuracy(with, gas_scene(0.1), {0.01, "rate", true}, "cpu");
  EXPECT_EQ(kept.settings.num_parcels, 1000);
  EXPECT_NEAR(kept.parcels_error, 0.04 * std::sqrt(0.5), 1e-12) << "a given number has an error, too";
  const AccuracyChoice enough = choose_by_accuracy(with, gas_scene(0.1), {0.035, "rate", true}, "cpu");
  EXPECT_GT(enough.parcels_error, 0.6 * 0.035);
  EXPECT_LT(std::hypot(enough.parcels_error, enough.expected_error), 0.035);
  EXPECT_TRUE(enough.remarks.empty()) << "the errors together are small enough";
  ASSERT_EQ(kept.remarks.size(), 1U);
  EXPECT_NE(kept.remarks.front().find("1000 parcels, as given, are too few"), std::string::npos);
}

// Between 2,000 and 8,000 the error changes its sign; it is no smaller there than with 8,000.
TEST(Accuracy, NumberOfParcelsIsNotChosenWhereTheErrorChangesItsSign) {
  json with = table();
  for (const auto& [num, error] :
       {std::pair(500.0, 0.04), {2000.0, 0.001}, {8000.0, 0.02}, {32000.0, 0.004}}) {
    json wall = row("exact", 0.2, 0.2, error, 1.0);
    wall["group"] = "parcels";
    wall["num_parcels"] = num;
    with["points"].push_back(wall);
  }
  EXPECT_EQ(choose_by_accuracy(with, gas_scene(0.1), {0.01, "rate", false}, "cpu").settings.num_parcels,
            32000);
  EXPECT_EQ(choose_by_accuracy(with, gas_scene(0.1), {0.04, "rate", false}, "cpu").settings.num_parcels,
            2000);
}

json drag_row(const char* group, const char* method, double displacement, double error, double cost) {
  json result = row(method, 0.1, displacement, 0.0, cost);
  result["group"] = group;
  result["errors"] = {{"drag", {{"value", error}, {"bound", false}}}};
  return result;
}

// Flights would do with steps of 1; the layer in front of the ball needs 0.5.
TEST(Accuracy, ABallsDragHoldsInTheLayerToo) {
  json with = table();
  with["points"].push_back(drag_row("ball", "impulse", 0.5, 0.01, 20.0));
  with["points"].push_back(drag_row("ball", "impulse", 1.0, 0.02, 10.0));
  with["points"].push_back(drag_row("ball", "exact", 0.5, 0.0, 100.0));
  Settings court = load_scene("court");
  court.restitution = 1.0;
  const auto choose = [&](double error) {
    return choose_by_accuracy(with, court, {error, "drag", true}, "cpu");
  };
  EXPECT_EQ(choose(0.04).settings.displacement_per_step, 1.0);
  EXPECT_EQ(choose(0.04).expected_error, 0.02);
  with["layer"] = {drag_row("layer", "impulse", 0.5, 0.015, 900.0),
                   drag_row("layer", "impulse", 1.0, 0.05, 9.0)};
  EXPECT_EQ(choose(0.04).settings.displacement_per_step, 0.5);
  EXPECT_EQ(choose(0.04).expected_error, 0.015) << "the layer's";
  EXPECT_EQ(choose(0.04).ns_per_disc_time, 20.0) << "the flight's";
  EXPECT_EQ(choose(0.015).settings.method, Method::exact) << "no step of the layer is as good as 0.8 of that";
}

TEST(Accuracy, SaysFirstWhatIsNotReached) {
  AccuracyChoice choice;
  choice.settings = gas_scene(0.1);
  choice.of = "rate";
  choice.asked_error = 0.01;
  choice.expected_error = 0.005;
  EXPECT_EQ(describe(choice, "t.json").find("is not reached"), std::string::npos);
  choice.parcels_error = 0.007;
  EXPECT_EQ(describe(choice, "t.json").find("is not reached"), std::string::npos);
  choice.expected_error = 0.008;
  EXPECT_NE(describe(choice, "t.json").find("may be 1.1 %"), std::string::npos) << "both together";
  choice.parcels_error = 0.45;
  EXPECT_TRUE(
      describe(choice, "t.json")
          .starts_with("--accuracy: 1 % is not reached: the error of rate may be 45 %\n--accuracy: method"));
}

TEST(Accuracy, AChoiceGoesIntoTheReport) {
  EXPECT_TRUE(to_json(std::nullopt).is_null());
  const AccuracyChoice choice = choose_by_accuracy(table(), gas_scene(0.1), {0.05, "rate", false}, "cpu");
  const json chosen = to_json(choice);
  EXPECT_EQ(chosen.at("of"), "rate");
  EXPECT_EQ(chosen.at("asked_error"), 0.05);
  EXPECT_EQ(chosen.at("expected_error"), choice.expected_error);
  EXPECT_TRUE(chosen.at("parcels_error").is_null()) << "unknown";
}

TEST(Accuracy, AQuickTableInTheCacheIsNotTaken) {
  const char* before = std::getenv("XDG_CACHE_HOME");
  const std::string kept = before != nullptr ? before : "";
  const TemporaryFolder folder;
  ::setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
  std::filesystem::create_directory(folder.path() / "pickleflight");
  for (const bool is_quick : {true, false}) {
    std::ofstream(cached_table_file()) << json{{"quick", is_quick}};
    EXPECT_EQ(accuracy_table_file() == cached_table_file(), !is_quick);
  }
  if (before != nullptr)
    ::setenv("XDG_CACHE_HOME", kept.c_str(), 1);
  else
    ::unsetenv("XDG_CACHE_HOME");
}

TEST(Accuracy, ATableOfAnotherFormatIsRefused) {
  TemporaryFolder folder;
  const auto reading = [&](const json& points) {
    const json written = {{"study", "work-precision"}, {"points", points}};
    return read_accuracy_table(folder.write("t.json", written.dump()));
  };
  EXPECT_EQ(reading(table()["points"]).at("points").size(), 14U);
  json without_step = row("exact", 0.1, 0.3, 0.0, 1.0), no_number = without_step, no_error = without_step;
  without_step.erase("displacement_per_step");
  no_number["ns_per_disc_time"] = "cheap";
  no_error["errors"]["rate"] = 3;
  for (const json& bad : {json{{"device", "cpu"}}, json(7), without_step, no_number, no_error}) {
    try {
      reading(json::array({bad}));
      ADD_FAILURE() << "accepted: " << bad;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("t.json' is not a table of the lab"), std::string::npos);
    }
  }
  EXPECT_THROW(read_accuracy_table(folder.write("t.json", "{\"study\": 3, \"points\": []}")), UserError);
}

TEST(Accuracy, RejectsUnanswerableWishes) {
  const AccuracyWish path{0.01, "path", false};
  EXPECT_THROW(choose_by_accuracy(table(), gas_scene(0.1), path, "cpu"), UserError) << "no ball";
  EXPECT_EQ(read_accuracy("--accuracy", "1%"), 0.01);
  EXPECT_EQ(read_accuracy("--accuracy", "0.02"), 0.02);
  for (const char* text : {"", "%", "0", "1", "-1%", "100%", "1 %", "nan", "five"}) {
    EXPECT_THROW(read_accuracy("--accuracy", text), UserError) << text;
  }
}

}  // namespace
}  // namespace pf
