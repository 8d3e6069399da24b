// The panel's figures of accuracy, and steps of `spring` beyond their stability bound.
#include "app/live_accuracy.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "core/error.hpp"
#include "model/kinetic_theory.hpp"
#include "model/spring.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

Commands changing(const Settings& settings) {
  Commands commands;
  commands.settings = settings;
  return commands;
}

struct Followed {
  Simulation simulation;
  LiveAccuracy accuracy;
  Clock::time_point now{};  // goes on when measure() says so, however long the frames take

  explicit Followed(const Settings& settings) : simulation(settings, make_cpu_backend(1)) { frames(1); }

  void frames(int num, const Commands& first = {}) {
    for (int i = 0; i < num; ++i) {
      simulation.advance_frame(i == 0 ? first : Commands{}, nullptr);
      accuracy.follow(simulation.view(), simulation.backend(), now);
    }
  }
  // A measurement is due now.
  void measure() {
    now += std::chrono::milliseconds(250);
    frames(1);
  }
};

// An elastic gas with walls, 2000 discs, some 14,000 collisions: the rate is Enskog's within 4 standard
// errors (1 / sqrt(14000) = 0.8 %) and the 0.4 % by which 2000 discs between walls differ.
TEST(LiveAccuracy, ExactGasHasEnskogsRateAndConservesEnergy) {
  Settings settings = gas(2000, 0.2);
  settings.method = Method::exact;
  Followed run(settings);
  run.frames(300);
  run.measure();
  const AccuracyReadout& r = run.accuracy.readout();
  EXPECT_NEAR(r.rate_over_enskog, 1.0, 4.0 * r.rate_error + 0.01);
  EXPECT_LT(std::fabs(r.energy_drift), 1e-6);
  EXPECT_EQ(r.missed_fraction, 0.0);
  EXPECT_EQ(r.num_retired, 0U);
  EXPECT_NEAR(r.simulated_s, 301 * 0.035, 1e-9);
}

TEST(LiveAccuracy, LongStepsMissCollisionsAndOverlap) {
  Settings settings = gas(2000, 0.2);
  settings.dt_s = 0.5;
  Followed run(settings);
  run.frames(20);
  run.measure();
  const AccuracyReadout& r = run.accuracy.readout();
  EXPECT_GT(r.missed_fraction, 0.2);
  EXPECT_GT(r.max_overlap_diameters, 0.5);
  EXPECT_GT(std::fabs(r.energy_drift), 0.01);
  EXPECT_GT(std::fabs(r.rate_over_enskog - 1.0), 4.0 * r.rate_error);
}

TEST(LiveAccuracy, RestartsOnlyOnRelevantChanges) {
  Followed run(gas(500, 0.2));
  run.frames(5);
  run.measure();
  const double before_s = run.accuracy.readout().simulated_s;
  EXPECT_GT(before_s, 0.0);
  Settings slower = run.simulation.settings();
  slower.time_scale *= 0.5;
  run.frames(1, changing(slower));
  EXPECT_EQ(run.accuracy.readout().simulated_s, before_s) << "unchanged until the next measurement";
  Settings other = slower;
  other.method = Method::spring;
  run.frames(1, changing(other));
  EXPECT_EQ(run.accuracy.readout().simulated_s, 0.0);
}

// Relative coordinate of a pair in contact, with the constants of the method's steps.
double growth_of_spring(double restitution, double contact_s, double dt_s) {
  Settings settings = gas(2, 0.01);
  settings.restitution = restitution;
  const StepConstants c = make_step_constants(derive_physics(settings), dt_s, contact_s);
  const double spring_rate = static_cast<double>(c.spring_mps) / c.physics.world.unit_m;
  double x = 1.0;
  double v = 0.0;
  for (int i = 0; i < 20000 && std::fabs(x) < 1e6; ++i) {
    v -= 2.0 * (spring_rate * x + static_cast<double>(c.damping_share) * v);
    x += dt_s * v;
  }
  return std::fabs(x);
}

TEST(SpringStep, APairGrowsExactlyBeyondTheLimit) {
  for (const double restitution : {1.0, 0.9, 0.3, 0.0}) {
    const double contact_s = 0.02;
    const double limit_s = spring_step_limit_s(spring_contact_rates(restitution, contact_s));
    EXPECT_LT(growth_of_spring(restitution, contact_s, 0.99 * limit_s), 100.0) << restitution;
    EXPECT_GE(growth_of_spring(restitution, contact_s, 1.01 * limit_s), 1e6) << restitution;
  }
  EXPECT_NEAR(spring_step_limit_s(spring_contact_rates(1.0, 0.02)), 2.0 * 0.02 / kPi, 1e-15);
}

TEST(SpringStep, RejectsStepsBeyondTheLimitUnlessForced) {
  Settings s = gas(100);
  s.method = Method::spring;
  s.spring_contact_s = 0.05;
  s.dt_s = 0.99 * 2.0 * 0.05 / kPi;
  EXPECT_NO_THROW(derive_physics(s));
  s.dt_s = 1.01 * 2.0 * 0.05 / kPi;
  try {
    derive_physics(s);
    FAIL() << "was taken";
  } catch (const UserError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("0.03183 s"), std::string::npos) << text;
    EXPECT_NE(text.find("--force"), std::string::npos) << text;
  }
  for (auto change : {+[](Settings& o) { o.allow_unstable = true; }, +[](Settings& o) { o.contacts = false; },
                      +[](Settings& o) { o.method = Method::impulse; },
                      +[](Settings& o) { o.spring_contact_s = 0.0; }, +[](Settings& o) { o.dt_s = 0.0; }}) {
    Settings other = s;
    change(other);
    EXPECT_NO_THROW(derive_physics(other));
  }
}

// A chosen step resolves a given contact duration.
TEST(SpringStep, ChosenStepIsATwentiethOfTheContact) {
  Settings s = gas(100);
  s.method = Method::spring;
  s.dt_s = 0.0;
  s.substeps = 0;
  s.spring_contact_s = 1e-4;
  const Physics physics = derive_physics(s);
  EXPECT_LE(plan_frame(s, physics, {}).dt_s, 1e-4 / 20.0 * (1.0 + 1e-12));
}

TEST(SpringStep, RejectsSuchAChangeInARun) {
  Settings s = gas(100);
  s.spring_contact_s = 0.02;
  Simulation run(s, make_cpu_backend(1));
  Settings spring = run.settings();
  spring.method = Method::spring;
  run.advance_frame(changing(spring), nullptr);
  EXPECT_EQ(run.settings().method, Method::impulse);
  EXPECT_NE(run.view().message.find("stability bound"), std::string::npos) << run.view().message;
  spring.allow_unstable = true;
  run.advance_frame(changing(spring), nullptr);
  EXPECT_EQ(run.settings().method, Method::spring);
}

}  // namespace
}  // namespace pf::test
