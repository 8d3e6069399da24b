// Errors of the work-precision study, and choices by its shipped table against theory and the reference.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "app/accuracy.hpp"
#include "app/accuracy_table.hpp"
#include "app/scene_run.hpp"
#include "core/error.hpp"
#include "lab/flight_case.hpp"
#include "lab/gas_case.hpp"
#include "lab/mean_error.hpp"
#include "lab/path_case.hpp"
#include "lab/reference.hpp"
#include "lab/study.hpp"
#include "lab/study_files.hpp"
#include "lab/theory.hpp"
#include "lab/work_precision_errors.hpp"
#include "model/kinetic_theory.hpp"
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

TEST(WorkPrecision, ComparesWithTheoryAndMarksTheFront) {
  const double expected = theory::collision_rate_per_s(0.2, 1.0, 0.5);
  json result = {{"points",
                  {gas_row("impulse", 0.9 * expected, 10.0), gas_row("spring", 0.8 * expected, 20.0),
                   gas_row("exact", expected * 1.0002, 30.0)}}};
  conclude_work_precision(result);
  const auto error = [&](int k) { return result["points"][k]["errors"]["rate"]; };
  EXPECT_NEAR(error(0)["value"].get<double>(), 0.1, 1e-12);
  EXPECT_FALSE(error(0)["bound"].get<bool>());
  EXPECT_TRUE(error(0)["front"].get<bool>());
  EXPECT_FALSE(error(1)["front"].get<bool>()) << "costs more and is less accurate";
  EXPECT_TRUE(error(2)["bound"].get<bool>()) << "0.02 % with a statistical error of 0.08 %";
  EXPECT_NEAR(error(2)["value"].get<double>(), 0.0002 + 2.0 * 0.001 / expected, 1e-9);
}

// At e = 0.9 `exact` is what the others are measured against. Of Z = 1.5 only 0.5 scatters: with n = 5,000
// collisions the error of a difference is 2 sqrt(2 / (pi n)) 0.5 / 1.5.
TEST(WorkPrecision, InACoolingGasExactIsTheReference) {
  json result = {{"points", {gas_row("impulse", 1.0, 10.0), gas_row("exact", 1.0, 30.0)}}};
  for (json& row : result["points"]) row["restitution"] = 0.9;
  result["points"][0]["compressibility"] = 1.5 * 1.1;
  conclude_work_precision(result);
  for (const char* error : {"rate", "pressure", "energy"})
    EXPECT_EQ(result["points"][1]["errors"][error].value("yardstick", false), true) << error;
  const json& pressure = result["points"][0]["errors"]["pressure"];
  EXPECT_NEAR(pressure["value"].get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(pressure["sigma"].get<double>(), 2.0 * std::sqrt(2.0 / (kPi * 5000.0)) / 3.0, 1e-9);
}

// A method that misses a tenth of the collisions keeps the gas hotter, so that their number is right.
TEST(WorkPrecision, TheRateOfACoolingGasIsThatAtItsTemperature) {
  json result = {{"points", {gas_row("impulse", 0.9, 10.0), gas_row("exact", 1.0, 30.0)}}};
  for (json& row : result["points"]) row["restitution"] = 0.9;
  result["points"][0]["energy_ratio"] = 1.2;
  conclude_work_precision(result);
  const json& rate = result["points"][0]["errors"]["rate"];
  EXPECT_NEAR(rate["value"].get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(rate["sigma"].get<double>(), std::sqrt(2.0 / 5000.0), 1e-9);
}

// Flights whose speed at the end is 10 - 4 / sqrt(N), give or take 0.01: the largest number has an error,
// too.
TEST(WorkPrecision, NumbersOfParcelsAreComparedWithTheLimitOfMany) {
  json points = json::array();
  for (const double num : {1600.0, 6400.0, 25600.0}) {
    const double speed = 10.0 - 4.0 / std::sqrt(num);
    json ends = json::array();
    for (const double off : {-0.01, 0.01, -0.01, 0.01}) ends.push_back({5.0, 0.0, speed + off});
    points.push_back({{"group", "parcels"},
                      {"device", "cpu"},
                      {"method", "exact"},
                      {"area_fraction", 0.1},
                      {"restitution", 0.9},
                      {"num_parcels", num},
                      {"dt", 0.1},
                      {"ns_per_disc_time", 1.0},
                      {"ends", ends},
                      {"start", {0.0, 0.0, 12.0}}});
  }
  json result = {{"points", points}};
  conclude_work_precision(result);
  // Each mean has the standard error 0.01 / sqrt(3). The limit is twice the last one less the one before.
  const double sigma_of_mean = 0.5 * 0.01 / std::sqrt(3.0);
  const double sigmas[] = {std::sqrt(6.0), std::sqrt(8.0), std::sqrt(2.0)};
  std::size_t number = 0;
  for (const json& row : result["points"]) {
    const json& drag = row["errors"]["drag"];
    EXPECT_NEAR(drag["shift"].get<double>(), -2.0 / std::sqrt(row["num_parcels"].get<double>()), 1e-12);
    EXPECT_NEAR(drag["scatter"].get<double>(), 0.5 * 0.01 * std::sqrt(4.0 / 3.0), 1e-12);
    EXPECT_NEAR(drag["shift_sigma"].get<double>(), sigmas[number++] * sigma_of_mean, 1e-12);
  }
  const json& first = result["points"][0]["errors"]["drag"];
  EXPECT_NEAR(first["value"].get<double>(), std::hypot(0.05, first["scatter"].get<double>()), 1e-12);
}

// A file of results that somebody has edited.
TEST(WorkPrecision, ARowWithoutItsFiguresIsNoResult) {
  for (const char* key : {"rate", "compressibility_sigma", "collisions"}) {
    json result = {{"points", {gas_row("impulse", 1.0, 10.0), gas_row("exact", 1.0, 30.0)}}};
    result["points"][0].erase(key);
    EXPECT_THROW(conclude_work_precision(result), json::exception) << key;
    result["points"][0][key] = nullptr;
    EXPECT_THROW(conclude_work_precision(result), json::exception) << key;
  }
}

// A method reaches an error with a step if all shorter steps reach it too. A step whose error crosses
// zero by chance, with larger errors at shorter steps, does not count. The other device has its own series.
TEST(WorkPrecision, SummaryNamesTheCheapestMethodOfEachDevice) {
  const double expected = theory::collision_rate_per_s(0.2, 1.0, 0.5);
  const auto row = [&](const char* device, const char* method, double dt, double error, double cost) {
    json entry = gas_row(method, expected * (1.0 + error), cost);
    entry["device"] = device;
    entry["dt"] = dt;
    entry["rate_sigma"] = 1e-6;
    return entry;
  };
  json result = {{"points",
                  {row("cpu", "impulse", 0.4, 0.0, 1.0), row("cpu", "impulse", 0.2, 0.1, 10.0),
                   row("cpu", "impulse", 0.1, 0.03, 20.0), row("cpu", "spring", 0.01, 0.05, 15.0),
                   row("cpu", "exact", 0.1, 0.0, 30.0), row("cuda", "impulse", 0.2, 0.1, 10.0),
                   row("cuda", "exact", 0.1, 0.0, 5.0)}}};
  conclude_work_precision(result);
  std::map<std::string, std::string> rate;
  for (const std::string text : result["words"]) {
    if (text.find("collision rate") != std::string::npos) rate[text.substr(0, text.find(','))] = text;
  }
  EXPECT_NE(rate["cpu"].find("exact below 3 %, then impulse up to 5 %, then spring up to 10 %, then impulse"),
            std::string::npos)
      << rate["cpu"];
  EXPECT_NE(rate["cuda"].find("area fraction 0.2: exact; impulse and spring never"), std::string::npos)
      << rate["cuda"];
}

// First order: a quarter of the step has about a quarter of the error. `exact` deviates by rounding alone:
// 2^-26 diameters in positions, amplified about ten times in a collision.
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

json shipped_table() { return read_accuracy_table(find_asset("lab/work-precision.json")); }

struct Target {
  const char* quantity;
  double error, area_fraction, restitution;
};
void PrintTo(const Target& target, std::ostream* out) {
  *out << target.quantity << " " << target.area_fraction;
}

class GasTarget : public testing::TestWithParam<Target> {};

// A gas between two cases of the table, with another seed. Method and step are chosen by the shipped table.
// The result is compared with the reference from the same start and, in equilibrium, with theory. 4,000 discs
// and 30 collisions each give a sigma of 0.4 % for the rate, 0.3 % for the pressure, and 0.6 % for their
// difference from the reference.
TEST_P(GasTarget, ChoiceByTheShippedTableKeepsItsError) {
  const Target& target = GetParam();
  const GasCase gas{4000, target.area_fraction, target.restitution, 77};
  const AccuracyChoice choice =
      choose_by_accuracy(shipped_table(), gas_settings(gas), {target.error, target.quantity, true}, "cpu");
  const bool is_rate = std::string(target.quantity) == "rate";
  const double length = target.restitution == 1.0 ? 30.0 : 15.0;  // before a cooling gas clusters
  GasSteps steps{choice.settings.method, choice.settings.displacement_per_step / 2.5};
  steps.collisions = length;
  steps.warmup = target.restitution == 1.0 ? 1.0 : 0.0;
  const json row = measure_gas(gas, steps, make_cpu_backend(2));
  const double time = row.at("duration").get<double>();

  const Physics physics = derive_physics(choice.settings);
  Reference reference(physics, reference_parcels(physics.world, equilibrated(gas)), BallState{});
  // In blocks, as the temperature that the run divides by is that of its blocks.
  double rate = 0.0, z = 0.0;
  constexpr int kBlocks = 16;
  for (int k = 1; k <= kBlocks; ++k) {
    const ReferenceTotals before = reference.totals();
    const double c2_before = 2.0 * reference.measure().parcel_energy_j / (2.0 * 3999.0);
    reference.run_until(time * k / kBlocks);
    const double c2 = 0.5 * (c2_before + reference.measure().parcel_energy_j / 3999.0);
    const ReferenceTotals& after = reference.totals();
    rate += 2.0 * static_cast<double>(after.num_collisions - before.num_collisions) /
            (4000.0 * time * std::sqrt(c2));
    z += measured_compressibility(after.impulse_sum_mps - before.impulse_sum_mps, time / kBlocks, 4000.0, c2,
                                  1.0) /
         kBlocks;
  }
  const double measured = row.at(is_rate ? "rate" : "compressibility").get<double>();
  const double off = measured / (is_rate ? rate : z) - 1.0;
  constexpr double kSigma = 0.006;
  EXPECT_LT(std::fabs(off), target.error + 3.0 * kSigma);
  // The expected error is realistic.
  EXPECT_LT(std::fabs(off), choice.expected_error + 3.0 * kSigma);
  if (target.restitution < 1.0) return;
  const double expected =
      is_rate ? theory_rate(target.area_fraction) : theory::compressibility(target.area_fraction);
  EXPECT_NEAR(measured / expected, 1.0, target.error);
}

INSTANTIATE_TEST_SUITE_P(WorkPrecision, GasTarget,
                         testing::Values(Target{"rate", 0.05, 0.3, 1.0}, Target{"rate", 0.1, 0.12, 1.0},
                                         Target{"pressure", 0.05, 0.3, 1.0},
                                         Target{"pressure", 0.03, 0.12, 1.0},
                                         Target{"pressure", 0.1, 0.4, 0.95}, Target{"rate", 0.02, 0.05, 0.9},
                                         Target{"rate", 0.05, 0.3, 0.95}));

// A flight of 0.6 s over the court. The ball spins, but without the Magnus term, which the reference lacks.
struct Flight {
  double across_m, length_m, speed_lost_mps;
};

Flight flight_of(const BallState& start, const BallState& end) {
  return {end.position_m.y - start.position_m.y, end.position_m.x - start.position_m.x,
          speed_of(start) - speed_of(end)};
}

class BallTarget : public testing::TestWithParam<Target> {};

// A court between two cases of the table against the reference from the same air, mean over 24 seeds. The
// statistical error follows from the scatter of the differences.
TEST_P(BallTarget, ChoiceByTheShippedTableKeepsItsError) {
  const Target& target = GetParam();
  Settings s = court_settings({2000, target.area_fraction, target.restitution});
  s.magnus = false;
  const AccuracyChoice choice =
      choose_by_accuracy(shipped_table(), s, {target.error, target.quantity, true}, "cpu");
  const bool is_path = std::string(target.quantity) == "path";
  std::vector<double> off;
  double scale = 0.0;
  for (int seed = 501; seed <= 524; ++seed) {
    s = choice.settings;
    s.seed = seed;
    const auto backend = make_cpu_backend(1);
    const SpawnedScene scene = spawn_scene(s, *backend);
    Reference reference(scene.physics, reference_parcels(scene.physics.world, backend->snapshot()),
                        scene.ball);
    reference.run_until(kCourtFlight_s);
    const Flight expected = flight_of(scene.ball, reference.ball());
    const Flight flight = flight_of(scene.ball, fly_scene(s, kCourtFlight_s, *backend).ball);
    off.push_back(is_path ? flight.across_m - expected.across_m
                          : flight.speed_lost_mps - expected.speed_lost_mps);
    scale += (is_path ? expected.length_m : expected.speed_lost_mps) / 24.0;
  }
  const MeanError mean = mean_and_error(off);
  EXPECT_LT(mean.sigma / scale, 0.5 * target.error) << "enough seeds to resolve the error";
  std::printf("%s %g: off by %.4f +- %.4f\n", target.quantity, target.error, mean.mean / scale,
              mean.sigma / scale);
  EXPECT_LT(std::fabs(mean.mean) / scale, target.error + 2.0 * mean.sigma / scale)
      << method_name(choice.settings.method) << ", " << choice.settings.displacement_per_step
      << " diameters per step, sigma " << mean.sigma / scale;
}

INSTANTIATE_TEST_SUITE_P(WorkPrecision, BallTarget,
                         testing::Values(Target{"path", 0.004, 0.1, 0.95}, Target{"path", 0.02, 0.35, 0.9},
                                         Target{"drag", 0.1, 0.1, 0.95}, Target{"drag", 0.15, 0.35, 0.9}));

// A series that is not measured now stays in the folder, with its device.
TEST(Lab, ResumeKeepsTheSeriesOfAnotherMachine) {
  const TemporaryFolder folder;
  const Study study = terms_study();
  json old = {{"study", "terms"}, {"version", "1"}, {"quick", true}, {"complete", true}};
  old["machine"] = {
      {"devices", {{{"series", "cpu"}, {"device", "A"}}, {{"series", "cuda"}, {"device", "G"}}}},
      {"measured_under_load", true}};
  old["points"] = json::array({{{"key", "cuda/x"}, {"device", "cuda"}}});
  save_study(folder.path(), old);
  json result = {{"study", "terms"}, {"version", "1"}, {"quick", true}, {"points", json::array()}};
  result["machine"] = {{"devices", {{{"series", "cpu"}, {"device", "A"}}}}, {"measured_under_load", false}};
  json full = result;
  resume_study(folder.path(), study, result);
  EXPECT_EQ(result["points"], old["points"]);
  ASSERT_EQ(result["machine"]["devices"].size(), 2U) << result;
  EXPECT_EQ(result["machine"]["devices"][1]["device"], "G");
  EXPECT_TRUE(result["machine"]["measured_under_load"].get<bool>());
  const json here = {{{"series", "cpu"}, {"device", "B"}}, {{"series", "cuda"}, {"device", "G"}}};
  add_device(here, "cuda", result["machine"]);
  EXPECT_EQ(result["machine"]["devices"], old["machine"]["devices"]) << "this processor has measured nothing";
  add_device(here, "cpu", result["machine"]);
  ASSERT_EQ(result["machine"]["devices"].size(), 3U) << result;
  EXPECT_EQ(result["machine"]["devices"][2], here[0]);
  full["quick"] = false;
  EXPECT_THROW(resume_study(folder.path(), study, full), UserError) << "a full run takes no quick points";
  full["quick"] = true;
  full["version"] = "2";
  EXPECT_THROW(resume_study(folder.path(), study, full), UserError);
}

// A table that lacks points says so.
TEST(WorkPrecision, ShippedTableDescribesItsMeasurement) {
  const json table = read_accuracy_table(find_asset("lab/work-precision.json"));
  std::set<std::string> measured;
  for (const json& row : table.at("points")) measured.insert(row.at("key"));
  const LabContext whole{false, {{"cpu", {}}, {"cuda", {}}}};
  std::size_t num_missing = 0;
  for (const LabPoint& point : work_precision_study().plan(whole))
    num_missing += 1 - measured.count(point.key);
  EXPECT_EQ(table.at("complete").get<bool>(), num_missing == 0) << num_missing << " points are missing";
  EXPECT_LT(num_missing * 10, measured.size());
  EXPECT_TRUE(table.at("machine").contains("measured_under_load"));
  EXPECT_FALSE(table.at("machine").at("devices").empty());
}

}  // namespace
}  // namespace pf::test
