// The report of a run, with a backend that returns fixed values.
#include "app/report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Answers only the calls of RunRecord::finish.
class StubBackend : public Backend {
 public:
  Measures measures;
  std::uint64_t hash = 0;

  std::string name() const override { return "cpu"; }
  std::string device() const override { return "told"; }
  void reset(const Physics&, const SpawnPlan&, const BallState&) override {}
  void set_physics(const Physics&) override {}
  void set_ball(const BallState&) override {}
  void restore(const ParcelSnapshot&) override {}
  void submit(const StepRequest&) override {}
  StepReport collect() override { return {}; }
  double min_bytes_moved(const StepTotals&) const override { return 0.0; }
  double measure_copy_bandwidth(std::size_t) override { return 0.0; }
  void draw(const DrawBuffers&) override {}
  ParcelSnapshot snapshot() override { return {}; }
  void save(BackendState&) override {}
  void resume(const Physics&, const BackendState&) override {}
  Measures measure() override { return measures; }
  std::uint64_t state_hash() override { return hash; }
  std::uint64_t memory_bytes() const override { return 0; }
};

// 100 parcels of 2 kg and radius 0.5 m in a box of 20 m by 20 m: area fraction pi / 16.
Physics hundred_parcels() {
  Physics physics;
  physics.world = make_world(20.0, 20.0, Boundary::walls);
  physics.parcels.num = 100;
  physics.parcels.radius_m = 0.5;
  physics.parcels.mass_kg = 2.0;
  physics.parcels.restitution = 0.75;
  return physics;
}

Measures measures_of(double parcel_energy_j, double ball_energy_j, Vec2d momentum, double scale) {
  Measures measures;
  measures.parcel_energy_j = parcel_energy_j;
  measures.ball_energy_j = ball_energy_j;
  measures.momentum_kg_mps = measures.ball_momentum_kg_mps = momentum;
  measures.momentum_scale_kg_mps = scale;
  return measures;
}

StepTotals totals_of(std::uint64_t num_steps, std::uint64_t num_collisions, double impulse_sum_mps) {
  StepTotals totals;
  totals.num_steps = num_steps;
  totals.num_collisions = num_collisions;
  totals.impulse_sum_mps = impulse_sum_mps;
  totals.max_overlap_diameters = 0.01;
  return totals;
}

// Two frames, of 10 steps of 0.01 s and 20 of 0.02 s: 0.5 s. K / (N m) is 1 at the start and 3 at the end:
// c^2 = 2.
class Report : public testing::Test {
 protected:
  Report() : record_(physics_, measures_of(200.0, 50.0, {1.0, 2.0}, 400.0), "a device") {
    backend_.measures = measures_of(600.0, 25.0, {4.0, -2.0}, 500.0);
    backend_.hash = 0xABCULL;
    PhaseTimes times;
    times[Phase::sort] = 1.0;
    times[Phase::grid] = 2.0;
    times[Phase::collide_integrate] = 3.0;
    times[Phase::ball] = 4.0;
    times[Phase::draw] = 100.0;
    StepTotals first = totals_of(10, 40, 30.0);
    first.num_ball_hits = 3;
    first.num_retired = 2;
    first.ball_impulse_kg_mps = {0.5, -0.5};
    record_.add_frame(times, first, 0.01);
    times[Phase::sort] = 5.0;
    record_.add_frame(times, totals_of(20, 60, 70.0), 0.02);
  }

  nlohmann::json finish() {
    const BallState ball{{1.0, 2.0}, {3.0, 4.0}, 5.0, 6.0};
    return record_.finish(settings_, physics_, backend_, ball, 7.5);
  }

  Settings settings_;
  Physics physics_ = hundred_parcels();
  StubBackend backend_;
  RunRecord record_;
};

TEST_F(Report, HasTheDocumentedKeys) {
  const nlohmann::json report = finish();
  std::string keys;  // nlohmann sorts them
  for (const auto& [key, value] : report.items()) keys += key + " ";
  EXPECT_EQ(
      keys,
      "area_fraction ball collisions compressibility device domain_link dt_s energy exact frame_ms gpu_ms "
      "host_ms max_overlap_diameters memory_bytes method momentum neighbors ns_per_parcel_step num_parcels "
      "num_retired parcel_steps_per_s phase_ms restitution scene simulated_s state_hash steps version "
      "wall_s ");
}

TEST_F(Report, NamesTheRun) {
  settings_.method = Method::spring;
  settings_.neighbors = Neighbors::all_pairs;
  const nlohmann::json report = finish();
  EXPECT_EQ(report["version"], PF_VERSION);
  EXPECT_EQ(report["device"], "a device");
  EXPECT_EQ(report["scene"], "court");
  EXPECT_EQ(report["method"], "spring");
  EXPECT_EQ(report["neighbors"], "all-pairs");
  EXPECT_EQ(report["num_parcels"], 100);
  EXPECT_EQ(report["restitution"], 0.75);
  EXPECT_EQ(report["steps"], 30);
  EXPECT_EQ(report["num_retired"], 2);
  EXPECT_EQ(report["dt_s"], 0.02);
  EXPECT_DOUBLE_EQ(report["simulated_s"], 0.5);
  EXPECT_EQ(report["state_hash"], "0000000000000abc");
  EXPECT_EQ(report["max_overlap_diameters"], 0.01);
  EXPECT_NEAR(report["area_fraction"], kPi / 16.0, 1e-6);  // the box is rounded to position units
}

TEST_F(Report, DriftsAreRelativeToTheStart) {
  const nlohmann::json report = finish();
  EXPECT_EQ(report["energy"]["initial_j"], 250.0);
  EXPECT_EQ(report["energy"]["final_j"], 625.0);
  EXPECT_DOUBLE_EQ(report["energy"]["relative_drift"], 1.5);
  EXPECT_EQ(report["momentum"]["initial"], nlohmann::json({1.0, 2.0}));
  EXPECT_EQ(report["momentum"]["final"], nlohmann::json({4.0, -2.0}));
  EXPECT_DOUBLE_EQ(report["momentum"]["relative_drift"], 5.0 / 400.0);
}

TEST_F(Report, CollisionFiguresFollowTheFormulas) {
  const nlohmann::json report = finish();
  EXPECT_EQ(report["collisions"]["count"], 100);
  EXPECT_DOUBLE_EQ(report["collisions"]["rate_per_parcel_per_s"], 2.0 * 100.0 / (100.0 * 0.5));
  const double enskog = enskog_rate_per_s(area_fraction_of(physics_), std::sqrt(2.0), 0.5);
  EXPECT_NEAR(report["collisions"]["enskog_rate_per_parcel_per_s"], enskog, 1e-12 * enskog);
  // Z = 1 + sigma sum|J|/m / (2 N c^2 t) = 1 + 1 * 100 / (2 * 100 * 2 * 0.5)
  EXPECT_DOUBLE_EQ(report["compressibility"], 1.5);
}

TEST_F(Report, RatesCountStepsOnly) {
  const nlohmann::json report = finish();
  const double seconds = (1.0 + 2.0 + 3.0 + 4.0 + 5.0 + 2.0 + 3.0 + 4.0) * 1e-3;
  EXPECT_NEAR(report["ns_per_parcel_step"], 1e9 * seconds / 3000.0, 1e-6);
  EXPECT_NEAR(report["parcel_steps_per_s"], 3000.0 / seconds, 1e-6);
}

// Method exact spends its step in phases of its own.
TEST(ReportPhases, StepTimeIncludesThePhasesOfExact) {
  const Settings settings;
  const Physics physics = hundred_parcels();
  RunRecord record(physics, {}, "d");
  PhaseTimes times;
  times[Phase::predict] = times[Phase::solve] = times[Phase::reconcile] = times[Phase::commit] = 0.25;
  record.add_frame(times, totals_of(10, 0, 0.0), 0.1);
  StubBackend backend;
  const nlohmann::json report = record.finish(settings, physics, backend, {}, 0.0);
  EXPECT_DOUBLE_EQ(report["parcel_steps_per_s"], 1e6);
  EXPECT_EQ(report["phase_ms"]["reconcile"]["median"], 0.25);
  EXPECT_EQ(record.frame_report()["physics_ms"], 1.0);
}

// Three frames, the first of them warm-up: means of the two others.
TEST(ReportFrames, MeansExcludeTheWarmUp) {
  const Settings settings;
  const Physics physics = hundred_parcels();
  RunRecord record(physics, {}, "d");
  record.set_warmup(1);
  EXPECT_TRUE(record.frame_report()["frame_ms"].is_null());
  const auto add_after = [&record](double wait_ms, double sort_ms, double draw_ms) {
    for (const auto start = Clock::now(); milliseconds_since(start) < wait_ms;) continue;
    PhaseTimes times;
    times[Phase::sort] = sort_ms;
    times[Phase::draw] = draw_ms;
    times[Phase::panel] = 0.25;
    record.add_frame(times, {}, 0.1);
  };
  constexpr double kWarmUp_ms = 50.0;
  const auto start = Clock::now();
  record.start_clock();
  add_after(kWarmUp_ms, 1000.0, 1000.0);
  EXPECT_TRUE(record.frame_report()["physics_ms"].is_null());
  add_after(3.0, 1.0, 0.5);
  add_after(3.0, 2.0, 0.0);
  const double rest_ms = milliseconds_since(start) - kWarmUp_ms;  // at most
  const nlohmann::json frames = record.frame_report();
  EXPECT_EQ(frames["num"], 2);
  EXPECT_EQ(frames["warmup"], 1);
  EXPECT_EQ(frames["physics_ms"], 1.5);
  EXPECT_EQ(frames["render_ms"], 0.25);
  EXPECT_GE(frames["frame_ms"], 3.0);
  EXPECT_LE(frames["frame_ms"], 0.5 * rest_ms);
  EXPECT_NEAR(frames["overhead_ms"].get<double>(), frames["frame_ms"].get<double>() - 1.75, 1e-9);
}

TEST_F(Report, BallIsReported) {
  const nlohmann::json ball = finish()["ball"];
  EXPECT_EQ(ball["x_m"], 1.0);
  EXPECT_EQ(ball["y_m"], 2.0);
  EXPECT_EQ(ball["vx_mps"], 3.0);
  EXPECT_EQ(ball["vy_mps"], 4.0);
  EXPECT_EQ(ball["spin_radps"], 5.0);
  EXPECT_EQ(ball["distance_m"], 7.5);
  EXPECT_EQ(ball["hits"], 3);
  EXPECT_EQ(ball["impulse_x_kg_mps"], 0.5);
  EXPECT_EQ(ball["impulse_y_kg_mps"], -0.5);
  physics_.ball.exists = false;
  EXPECT_TRUE(finish()["ball"].is_null());
}

// The GL device's time comes a frame late; a time that is not known yet does not count as 0.
TEST(ReportPhases, BothClocksOfDrawing) {
  const Settings settings;
  const Physics physics = hundred_parcels();
  RunRecord record(physics, {}, "d");
  record.add_frame({}, {}, 0.1, {4.0, DrawTimes::kUnknown, 2.0, DrawTimes::kUnknown});
  for (int i = 0; i < 4; ++i) record.add_frame({}, {}, 0.1, {4.0, 3.0, 2.0, DrawTimes::kUnknown});
  StubBackend backend;
  const nlohmann::json report = record.finish(settings, physics, backend, {}, 0.0);
  EXPECT_EQ(report["host_ms"]["draw"]["median"], 4.0);
  EXPECT_EQ(report["host_ms"]["panel"]["median"], 2.0);
  EXPECT_EQ(report["gpu_ms"]["draw"]["median"], 3.0);
  EXPECT_EQ(report["gpu_ms"]["draw"]["p99"], 3.0);
  EXPECT_TRUE(report["gpu_ms"]["panel"]["median"].is_null());
}

TEST(ReportPhases, MedianAndP99) {
  const Settings settings;
  const Physics physics = hundred_parcels();
  RunRecord record(physics, {}, "d");
  for (int i = 200; i >= 1; --i) {
    PhaseTimes times;
    times[Phase::sort] = i;
    record.add_frame(times, {}, 0.1);
  }
  StubBackend backend;
  const nlohmann::json phases = record.finish(settings, physics, backend, {}, 0.0)["phase_ms"];
  EXPECT_EQ(phases["sort"]["median"], 100.5);
  EXPECT_EQ(phases["sort"]["p99"], 198.0);
  EXPECT_EQ(phases["encode"]["median"], 0.0);
  EXPECT_EQ(phases.size(), kNumPhases);
}

TEST(ReportNulls, WithoutParcelsOrFrames) {
  Settings settings;
  Physics physics;
  StubBackend backend;
  const RunRecord record(physics, {}, "d");
  const nlohmann::json report = record.finish(settings, physics, backend, {}, 0.0);
  for (const char* key : {"area_fraction", "ns_per_parcel_step", "parcel_steps_per_s", "compressibility",
                          "max_overlap_diameters"}) {
    EXPECT_TRUE(report.at(key).is_null()) << key << " is " << report.at(key);
  }
  EXPECT_TRUE(report["energy"]["relative_drift"].is_null());
  EXPECT_TRUE(report["momentum"]["relative_drift"].is_null());
  EXPECT_TRUE(report["collisions"]["rate_per_parcel_per_s"].is_null());
  EXPECT_TRUE(report["collisions"]["enskog_rate_per_parcel_per_s"].is_null());
  EXPECT_TRUE(report["phase_ms"]["sort"]["median"].is_null());
  EXPECT_TRUE(report["phase_ms"]["sort"]["p99"].is_null());
  EXPECT_EQ(report["collisions"]["count"], 0);
  EXPECT_EQ(report["simulated_s"], 0.0);
}

TEST(ReportNulls, NanBecomesNull) {
  Settings settings;
  const Physics physics = hundred_parcels();
  StubBackend backend;
  backend.measures = measures_of(kNan, HUGE_VAL, {kNan, HUGE_VAL}, kNan);
  RunRecord record(physics, measures_of(1.0, 0.0, {}, 1.0), "d");
  PhaseTimes times;
  times[Phase::sort] = kNan;
  record.add_frame(times, totals_of(1, 1, kNan), kNan);
  const BallState ball{{kNan, -HUGE_VAL}, {}, 0.0, 0.0};
  const nlohmann::json report = record.finish(settings, physics, backend, ball, HUGE_VAL);
  const nlohmann::json flat = report.flatten();
  for (const auto& [key, value] : flat.items()) {
    EXPECT_TRUE(!value.is_number_float() || std::isfinite(value.get<double>())) << key;
  }
  EXPECT_TRUE(report["ball"]["x_m"].is_null());
  EXPECT_TRUE(report["ball"]["distance_m"].is_null());
  EXPECT_TRUE(report["energy"]["final_j"].is_null());
  EXPECT_TRUE(report["compressibility"].is_null());
}

TEST(ReportClock, WallTimeCountsFromStartClock) {
  Settings settings;
  const Physics physics = hundred_parcels();
  StubBackend backend;
  RunRecord record(physics, {}, "d");
  const auto wait = [](double ms) {
    for (const auto start = Clock::now(); milliseconds_since(start) < ms;) continue;
  };
  const auto start = Clock::now();
  wait(30.0);
  record.start_clock();
  wait(5.0);
  const double wall_s = record.finish(settings, physics, backend, {}, 0.0)["wall_s"];
  EXPECT_GE(wall_s, 5e-3);
  EXPECT_LE(wall_s, 1e-3 * milliseconds_since(start) - 30e-3);
}

TEST(WriteReport, WritesJsonThatReadsBack) {
  TemporaryFolder folder;
  const auto file = folder.write("r.json", std::string(1000, 'x'));
  write_report(file, {{"a", 1.5}, {"b", nullptr}});
  const std::string text = contents_of(file);
  EXPECT_EQ(nlohmann::json::parse(text), nlohmann::json({{"a", 1.5}, {"b", nullptr}}));
  EXPECT_EQ(text, "{\n  \"a\": 1.5,\n  \"b\": null\n}\n");
  EXPECT_NO_THROW(write_report(file, {{"name", "\xff"}}));
}

TEST(WriteReport, RejectsAnUnwritableFile) {
  TemporaryFolder folder;
  try {
    write_report(folder.path() / "no" / "r.json", {});
    FAIL() << "was written";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("r.json': the report cannot be written"), std::string::npos);
  }
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_THROW(write_report("/dev/full", {{"a", 1}}), UserError);  // opens, but is always full
  }
}

}  // namespace
}  // namespace pf
