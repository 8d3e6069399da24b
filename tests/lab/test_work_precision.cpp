// Errors of the work-precision study, and a choice by its shipped table held against theory and the
// reference.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/accuracy.hpp"
#include "app/options.hpp"
#include "lab/gas_case.hpp"
#include "lab/path_case.hpp"
#include "lab/reference.hpp"
#include "lab/study.hpp"
#include "lab/study_files.hpp"
#include "lab/theory.hpp"
#include "lab/work_precision_errors.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

using nlohmann::json;

json gas_row(const char* method, double rate, double cost) {
  return {{"group", "gas"},       {"device", "cpu"},          {"method", method},
          {"area_fraction", 0.2}, {"restitution", 1.0},       {"dt", 0.1},
          {"num_parcels", 1000},  {"ns_per_disc_time", cost}, {"rate", rate},
          {"rate_sigma", 0.001},  {"compressibility", 1.5},   {"compressibility_sigma", 0.001},
          {"energy_ratio", 1.0},  {"collisions", 10.0}};
}

TEST(WorkPrecision, ErrorsAreAgainstTheoryAndTheFrontIsOfThoseUnbeaten) {
  const double truth = theory::collision_rate_per_s(0.2, 1.0, 0.5);
  json result = {{"points",
                  {gas_row("impulse", 0.9 * truth, 10.0), gas_row("spring", 0.8 * truth, 20.0),
                   gas_row("exact", truth * 1.0002, 30.0)}}};
  conclude_work_precision(result);
  const auto error = [&](int k) { return result["points"][k]["errors"]["rate"]; };
  EXPECT_NEAR(error(0)["value"].get<double>(), 0.1, 1e-12);
  EXPECT_FALSE(error(0)["bound"].get<bool>());
  EXPECT_TRUE(error(0)["front"].get<bool>());
  EXPECT_FALSE(error(1)["front"].get<bool>()) << "dearer and worse";
  EXPECT_TRUE(error(2)["bound"].get<bool>()) << "0.02 % with a statistical error of 0.08 %";
  EXPECT_NEAR(error(2)["value"].get<double>(), 0.0002 + 2.0 * 0.001 / truth, 1e-9);
}

// First order: a quarter of the step, about a quarter of the error. `exact` strays by rounding only:
// positions of 2^-26 diameters, amplified some ten times in a collision.
TEST(WorkPrecision, PathsConverge) {
  const GasCase gas{1000, 0.3, 1.0};
  const auto error = [&](Method method, double dt) {
    GasSteps steps{method, dt / theory_rate(gas.area_fraction)};
    steps.collisions = 1.0;
    return measure_path(gas, steps, make_cpu_backend(1)).at("path_error").get<double>();
  };
  const double long_step = error(Method::impulse, 1.0 / 64), short_step = error(Method::impulse, 1.0 / 256);
  EXPECT_GT(long_step / short_step, 3.0);
  EXPECT_LT(long_step / short_step, 5.5);
  EXPECT_LT(error(Method::exact, 0.125), 1e-5);
}

// A gas at area fraction 0.3: between two cases of the table, made from other seeds. 5 % of the rate, against
// the reference from the same start and against theory. 4,000 discs and 30 collisions each: sigma 0.4 %.
TEST(WorkPrecision, AChoiceByTheShippedTableHolds) {
  const json table = read_accuracy_table(find_asset("lab/work-precision.json"));
  const GasCase gas{4000, 0.3, 1.0, 77};
  const AccuracyWish wish{0.05, "rate", true};
  const AccuracyChoice choice = choose_by_accuracy(table, gas_settings(gas), wish, "cpu");
  ASSERT_EQ(choice.settings.method, Method::impulse) << "the cheap method does for 5 %";
  const Physics physics = derive_physics(choice.settings);
  GasSteps steps{choice.settings.method, choice.settings.displacement_per_step / 2.5};
  steps.collisions = 30.0;
  const json row = measure_gas(gas, steps, make_cpu_backend(2));
  const double rate = row.at("rate").get<double>();
  EXPECT_NEAR(rate / theory_rate(gas.area_fraction), 1.0, wish.error);

  Reference reference(physics, reference_parcels(physics.world, equilibrated(gas)), BallState{});
  const double time = 30.0 / theory_rate(gas.area_fraction);
  reference.run_until(time);
  const double true_rate = 2.0 * static_cast<double>(reference.totals().num_collisions) / (4000.0 * time);
  EXPECT_NEAR(rate / true_rate, 1.0, wish.error);
  // What it expects is honest: the error is not far above it.
  EXPECT_LT(std::fabs(rate / true_rate - 1.0), choice.expected_error + 3.0 * 0.006);
}

// A series that is not measured now stays in the folder, with the device that it was measured on.
TEST(Lab, ResumingKeepsTheSeriesOfAnotherMachine) {
  const TemporaryFolder folder;
  const Study study = terms_study();
  json there = {{"study", "terms"}, {"version", "1"}, {"quick", true}, {"complete", true}};
  there["machine"] = {
      {"devices", {{{"series", "cpu"}, {"device", "A"}}, {{"series", "cuda"}, {"device", "G"}}}},
      {"measured_under_load", true}};
  there["points"] = json::array({{{"key", "cuda/x"}, {"device", "cuda"}}});
  save_study(folder.path(), there);
  json here = {{"study", "terms"}, {"version", "1"}, {"quick", true}, {"points", json::array()}};
  here["machine"] = {{"devices", {{{"series", "cpu"}, {"device", "A"}}}}, {"measured_under_load", false}};
  json other = here;
  take_up(folder.path(), study, here);
  EXPECT_EQ(here["points"], there["points"]);
  ASSERT_EQ(here["machine"]["devices"].size(), 2U) << here;
  EXPECT_EQ(here["machine"]["devices"][1]["device"], "G");
  EXPECT_TRUE(here["machine"]["measured_under_load"].get<bool>());
  other["quick"] = false;
  take_up(folder.path(), study, other);
  EXPECT_TRUE(other["points"].empty()) << "quick points are no part of a full run";
}

TEST(Lab, AllIsEveryStudy) {
  std::vector<std::string> names;
  for (const Study& study : studies()) names.push_back(study.name);
  EXPECT_EQ(names, (std::vector<std::string>{"work-precision", "stability", "terms", "validate"}));
}

// The command line knows every study by its name.
TEST(Lab, EveryStudyCanBeAskedFor) {
  for (const Study& study : studies()) {
    const char* words[] = {"pickleflight", "lab", study.name.c_str()};
    EXPECT_EQ(parse_options(3, words).options.value().lab.study, study.name);
  }
}

TEST(WorkPrecision, TheShippedTableSaysHowItWasMeasured) {
  const json table = read_accuracy_table(find_asset("lab/work-precision.json"));
  EXPECT_TRUE(table.at("complete").get<bool>());
  EXPECT_TRUE(table.at("machine").contains("measured_under_load"));
  EXPECT_FALSE(table.at("machine").at("devices").empty());
}

}  // namespace
}  // namespace pf::test
