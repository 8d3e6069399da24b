// Errors of the work-precision study, and a choice by its shipped table held against theory and the
// reference.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "app/accuracy.hpp"
#include "app/options.hpp"
#include "app/scene_run.hpp"
#include "lab/flight_case.hpp"
#include "lab/gas_case.hpp"
#include "lab/mean_error.hpp"
#include "lab/path_case.hpp"
#include "lab/reference.hpp"
#include "lab/parallel_for.hpp"
#include "lab/study.hpp"
#include "lab/study_files.hpp"
#include "lab/theory.hpp"
#include "lab/validate.hpp"
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

// impulse is cheaper from the longest step on that holds; a step whose error crosses zero by chance, with
// worse ones below it, does not count; the other device has a series of its own.
TEST(WorkPrecision, WordsSayWhichMethodIsTheCheapestOnEachDevice) {
  const double truth = theory::collision_rate_per_s(0.2, 1.0, 0.5);
  const auto row = [&](const char* device, const char* method, double dt, double error, double cost) {
    json made = gas_row(method, truth * (1.0 + error), cost);
    made["device"] = device;
    made["dt"] = dt;
    made["rate_sigma"] = 1e-6;
    return made;
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
  EXPECT_NE(rate["cuda"].find("area fraction 0.2: exact; impulse and spring nowhere"), std::string::npos)
      << rate["cuda"];
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

json shipped_table() { return read_accuracy_table(find_asset("lab/work-precision.json")); }

struct Target {
  const char* of;
  double error, area_fraction, restitution;
};
void PrintTo(const Target& target, std::ostream* out) { *out << target.of << " " << target.area_fraction; }

class GasTarget : public testing::TestWithParam<Target> {};

// A gas between two cases of the table, from a seed of its own: method and step chosen by the shipped table,
// against the reference from the same start and, in equilibrium, against theory. 4,000 discs and 30
// collisions each: sigma 0.4 % of the rate and 0.3 % of the pressure, 0.6 % of their difference from the
// reference.
TEST_P(GasTarget, AChoiceByTheShippedTableHolds) {
  const Target& target = GetParam();
  const GasCase gas{4000, target.area_fraction, target.restitution, 77};
  const AccuracyChoice choice =
      choose_by_accuracy(shipped_table(), gas_settings(gas), {target.error, target.of, true}, "cpu");
  const bool is_rate = std::string(target.of) == "rate";
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
    z += theory::measured_compressibility(after.impulse_sum_mps - before.impulse_sum_mps, time / kBlocks,
                                          4000.0, c2, 1.0) /
         kBlocks;
  }
  const double found = row.at(is_rate ? "rate" : "compressibility").get<double>();
  const double off = found / (is_rate ? rate : z) - 1.0;
  constexpr double kSigma = 0.006;
  EXPECT_LT(std::fabs(off), target.error + 3.0 * kSigma);
  // What it expects is honest: the error is not far above it.
  EXPECT_LT(std::fabs(off), choice.expected_error + 3.0 * kSigma);
  if (target.restitution < 1.0) return;
  const double truth =
      is_rate ? theory_rate(target.area_fraction) : theory::compressibility(target.area_fraction);
  EXPECT_NEAR(found / truth, 1.0, target.error);
}

INSTANTIATE_TEST_SUITE_P(WorkPrecision, GasTarget,
                         testing::Values(Target{"rate", 0.05, 0.3, 1.0}, Target{"rate", 0.1, 0.12, 1.0},
                                         Target{"pressure", 0.05, 0.3, 1.0},
                                         Target{"pressure", 0.03, 0.12, 1.0},
                                         Target{"pressure", 0.1, 0.4, 0.95}));

// The ball of a court, which spins, without the Magnus term, which the reference does not know, for 0.6 s.
struct Flight {
  double across_m, length_m, speed_lost_mps;
};

Flight flight_of(const BallState& start, const BallState& end) {
  return {end.position_m.y - start.position_m.y, end.position_m.x - start.position_m.x,
          speed_of(start) - speed_of(end)};
}

class BallTarget : public testing::TestWithParam<Target> {};

// A court between two cases of the table, against the reference from the same air, mean over 24 seeds: the
// statistical error comes of the differences themselves.
TEST_P(BallTarget, AChoiceByTheShippedTableHolds) {
  const Target& target = GetParam();
  Settings s = court_settings({2000, target.area_fraction, target.restitution});
  s.magnus = false;
  const AccuracyChoice choice =
      choose_by_accuracy(shipped_table(), s, {target.error, target.of, true}, "cpu");
  const bool is_path = std::string(target.of) == "path";
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
    const Flight truth = flight_of(scene.ball, reference.ball());
    const Flight found = flight_of(scene.ball, fly_scene(s, kCourtFlight_s, *backend).ball);
    off.push_back(is_path ? found.across_m - truth.across_m : found.speed_lost_mps - truth.speed_lost_mps);
    scale += (is_path ? truth.length_m : truth.speed_lost_mps) / 24.0;
  }
  const MeanError mean = mean_and_error(off);
  EXPECT_LT(mean.sigma / scale, 0.5 * target.error) << "seeds enough to tell";
  std::printf("%s %g: off by %.4f +- %.4f\n", target.of, target.error, mean.mean / scale, mean.sigma / scale);
  EXPECT_LT(std::fabs(mean.mean) / scale, target.error + 2.0 * mean.sigma / scale)
      << method_name(choice.settings.method) << ", " << choice.settings.displacement_per_step
      << " diameters a step, sigma " << mean.sigma / scale;
}

INSTANTIATE_TEST_SUITE_P(WorkPrecision, BallTarget,
                         testing::Values(Target{"path", 0.004, 0.1, 0.95}, Target{"path", 0.02, 0.35, 0.9},
                                         Target{"drag", 0.1, 0.1, 0.95}, Target{"drag", 0.15, 0.35, 0.9}));

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

TEST(Lab, SideBySideIsOnceEachAndPassesOnWhatIsThrown) {
  for (const unsigned threads : {1U, 3U}) {
    std::vector<std::atomic<int>> calls(50);
    parallel_for(50, threads, [&](int k) { ++calls[static_cast<std::size_t>(k)]; });
    for (const auto& num : calls) EXPECT_EQ(num, 1);
    std::atomic<int> num_begun = 0;
    const auto stumble = [&](int) {
      ++num_begun;
      throw std::runtime_error("no");
    };
    EXPECT_THROW(parallel_for(50, threads, stumble), std::runtime_error);
    EXPECT_LE(num_begun, static_cast<int>(threads)) << "nothing begins after it";
    parallel_for(0, threads, stumble);
  }
}

// What validate finds does not depend on the number of threads.
TEST(Lab, AYardstickIsTheSameOnAnyNumberOfThreads) {
  std::vector<double> measured;
  for (const unsigned threads : {1U, 3U}) {
    for (const ValidationCase& rung : gas_rungs({true, threads})) {
      if (rung.key != "density/exact/0.2") continue;
      rung.measure([&](const ValidationRow& row) { measured.push_back(row.measured); });
    }
  }
  ASSERT_EQ(measured.size(), 4U) << "rate and pressure, twice";
  EXPECT_EQ(measured[0], measured[2]);
  EXPECT_EQ(measured[1], measured[3]);
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
