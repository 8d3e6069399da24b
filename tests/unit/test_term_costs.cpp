// The cost of each term, measured beside the run: it becomes known, and the run does not notice.
#include "app/term_costs.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/methods.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr int kEnoughFrames = 260;  // settling, copies, four terms of 34 pairs

Settings court_by(Method method) {
  Settings settings = court(400);
  settings.method = method;
  settings.threads = 1;
  settings.time_scale = 0.01;  // one step a frame, and the ball does not leave
  return settings;
}

std::unique_ptr<Backend> make_copy(const std::string&, std::int64_t) { return make_cpu_backend(1); }

struct Measured {
  Simulation simulation;
  TermCosts costs{make_copy};

  explicit Measured(const Settings& settings) : simulation(settings, make_cpu_backend(1)) {}

  void frames(int num, const Commands& first = {}) {
    for (int i = 0; i < num; ++i) {
      simulation.advance_frame(i == 0 ? first : Commands{}, nullptr);
      costs.follow(simulation.view(), simulation.backend());
    }
  }
  // Under sanitizers steps are slow: the budget must not decide.
  void frames_on_request(int num) {
    frames(1);
    costs.request();
    frames(num);
  }
};

class EveryMethod : public testing::TestWithParam<Method> {};

TEST_P(EveryMethod, CostsBecomeKnownWithoutASwitch) {
  Measured run(court_by(GetParam()));
  run.frames_on_request(kEnoughFrames);
  ASSERT_EQ(run.costs.state(), TermCosts::State::known) << run.costs.text();
  for (std::size_t k = 0; k < kNumTerms; ++k) {
    const TermCost& cost = run.costs.cost(static_cast<Term>(k));
    EXPECT_TRUE(cost.applies && cost.is_on && cost.is_known) << kTermNames[k];
    EXPECT_GE(cost.error_ms, 0.0) << kTermNames[k];
  }
  EXPECT_GT(run.costs.cost(Term::parcels).ms, 0.0) << "nearly all of a step, also on a busy machine";
}

TEST_P(EveryMethod, TheFlightIsTheSameToTheBit) {
  const Settings settings = court_by(GetParam());
  Measured measured(settings);
  measured.frames_on_request(kEnoughFrames);
  Simulation plain(settings, make_cpu_backend(1));
  for (int i = 0; i < kEnoughFrames + 1; ++i) plain.advance_frame({}, nullptr);
  EXPECT_EQ(measured.costs.state(), TermCosts::State::known);
  EXPECT_EQ(measured.simulation.backend().state_hash(), plain.backend().state_hash());
  EXPECT_EQ(measured.simulation.view().totals.num_collisions, plain.view().totals.num_collisions);
  EXPECT_EQ(measured.simulation.view().totals.event_hash, plain.view().totals.event_hash);
}

INSTANTIATE_TEST_SUITE_P(TermCosts, EveryMethod,
                         testing::Values(Method::impulse, Method::spring, Method::exact),
                         [](const auto& method) { return method_name(method.param); });

// 20 frames until it has settled, then the state and two copies in a frame each.
TEST(TermCosts, WaitUntilNothingChanges) {
  Measured run(court_by(Method::impulse));
  run.frames(TermCosts::kSettlingFrames);
  EXPECT_EQ(run.costs.state(), TermCosts::State::settling);
  EXPECT_NE(run.costs.text().find("contacts measuring"), std::string::npos) << run.costs.text();
  Commands warmer;
  warmer.settings = run.simulation.settings();
  warmer.settings->restitution = 0.5;
  run.frames(TermCosts::kSettlingFrames, warmer);
  EXPECT_EQ(run.costs.state(), TermCosts::State::settling) << "begins anew";
}

TEST(TermCosts, StartOverWhenTheWorkChanges) {
  Measured run(court_by(Method::impulse));
  run.frames_on_request(kEnoughFrames);
  ASSERT_TRUE(run.costs.cost(Term::contacts).is_known);
  Commands aim;  // the next launch changes no step
  aim.settings = run.simulation.settings();
  aim.settings->ball_vx_mps = 20.0;
  run.frames(1, aim);
  EXPECT_TRUE(run.costs.cost(Term::contacts).is_known);
  Commands fewer;
  fewer.settings = run.simulation.settings();
  fewer.settings->num_parcels = 300;
  run.frames(1, fewer);
  EXPECT_FALSE(run.costs.cost(Term::contacts).is_known);
}

TEST(TermCosts, APausedRunIsLeftAlone) {
  Measured run(court_by(Method::impulse));
  Commands pause;
  pause.toggle_pause = true;
  run.frames(1, pause);
  run.costs.request();
  run.frames(kEnoughFrames);
  EXPECT_EQ(run.costs.state(), TermCosts::State::settling);
  EXPECT_TRUE(run.costs.text().empty());
}

TEST(TermCosts, ManyParcelsAreMeasuredOnRequestOnly) {
  Settings settings = court_by(Method::impulse);
  settings.num_parcels = TermCosts::kMaxParcels + 1;
  Measured run(settings);
  run.frames(TermCosts::kSettlingFrames + 2);
  EXPECT_EQ(run.costs.state(), TermCosts::State::on_request);
  EXPECT_NE(run.costs.text().find("press E"), std::string::npos) << run.costs.text();
  run.costs.request();
  run.frames(1);
  EXPECT_EQ(run.costs.state(), TermCosts::State::measuring);
}

TEST(TermCosts, WithoutMemoryForACopyTheRunGoesOn) {
  Measured run(court_by(Method::impulse));
  run.costs =
      TermCosts([](const std::string&, std::int64_t) -> std::unique_ptr<Backend> { throw std::bad_alloc(); });
  run.frames_on_request(5);
  EXPECT_EQ(run.costs.state(), TermCosts::State::failed);
  EXPECT_NE(run.costs.text().find("cannot be measured: std::bad_alloc"), std::string::npos)
      << run.costs.text();
  EXPECT_GT(run.simulation.view().totals.num_steps, 0U);
}

// Drag needs no parcels: nothing to touch, nothing to rub.
TEST(TermCosts, TermsWithoutAnObjectAreLeftOut) {
  Settings settings = court_by(Method::impulse);
  settings.air = Air::drag;
  EXPECT_FALSE(unknown_cost(settings, Term::contacts).applies);
  EXPECT_FALSE(unknown_cost(settings, Term::friction).applies);
  EXPECT_TRUE(unknown_cost(settings, Term::magnus).applies);
  EXPECT_TRUE(unknown_cost(settings, Term::parcels).applies);
  EXPECT_FALSE(unknown_cost(settings, Term::parcels).is_on);
}

TEST(TermCosts, ATermThatIsOffIsMeasuredToo) {
  Settings settings = court_by(Method::impulse);
  settings.air = Air::vacuum;
  Measured run(settings);
  run.frames_on_request(kEnoughFrames);
  const TermCost& parcels = run.costs.cost(Term::parcels);
  ASSERT_TRUE(parcels.is_known) << run.costs.text();
  EXPECT_FALSE(parcels.is_on);
  EXPECT_GT(parcels.ms, 0.0) << "a step with parcels less one without";
  EXPECT_NE(run.costs.text().find("(off)"), std::string::npos) << run.costs.text();
}

TEST(TermCosts, SwitchingTwiceIsTheSettingsAgain) {
  const Settings settings = court(100);
  for (std::size_t k = 0; k < kNumTerms; ++k) {
    const Term term = static_cast<Term>(k);
    EXPECT_FALSE(switched(settings, term) == settings) << kTermNames[k];
    EXPECT_TRUE(switched(switched(settings, term), term) == settings) << kTermNames[k];
  }
}

// Three standard errors decide between a figure and a bound.
TEST(TermCosts, AreWrittenAsFarAsTheyAreKnown) {
  const auto text = [](double ms, double error_ms) {
    return cost_text({.applies = true, .is_on = true, .is_known = true, .ms = ms, .error_ms = error_ms});
  };
  EXPECT_EQ(text(0.4123, 0.0003), "0.4123");
  EXPECT_EQ(text(0.4123, 0.003), "0.412");
  EXPECT_EQ(text(12.34, 0.1), "12.3");
  EXPECT_EQ(text(0.002, 0.002), "< 0.01");
  EXPECT_EQ(text(-0.002, 0.002), "< 0.01");
  EXPECT_EQ(text(-0.2, 0.01), "-0.20");
  EXPECT_EQ(text(0.0, 0.0), "< 0.0001");
}

}  // namespace
}  // namespace pf::test
