// The cost of each term, measured beside the run: it becomes known, and the run does not notice.
#include "app/term_costs.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/methods.hpp"
#include "support/scene_support.hpp"

namespace pf::test {
namespace {

constexpr int kEnoughFrames = 260;  // settling, copies, four terms in four rounds of 10 pairs

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
  EXPECT_EQ(text(0.4123, 0.0003), "0.4123 \u00b1 0.0009");
  EXPECT_EQ(text(0.4123, 0.003), "0.412 \u00b1 0.009");
  EXPECT_EQ(text(12.34, 0.1), "12.3 \u00b1 0.3");
  EXPECT_EQ(text(0.002, 0.002), "< 0.01");
  EXPECT_EQ(text(-0.002, 0.002), "< 0.01");
  EXPECT_EQ(text(-0.2, 0.01), "-0.20 \u00b1 0.03");
  EXPECT_EQ(text(0.0, 0.0), "< 0.0001");
}

// A machine whose load comes and goes. Times are scripted: a step has a known amount of work, other programs
// slow it down sixfold for a quarter of the requests on end, and now and then it stands still for a moment.
class LoadedBackend final : public Backend {
 public:
  static constexpr double kParcels_ms = 0.2, kContacts_ms = 0.05, kFriction_ms = 0.00001;

  std::string name() const override { return real_->name(); }
  std::string device() const override { return real_->device(); }
  void reset(const Physics& p, const SpawnPlan& plan, const BallState& b) override {
    physics_ = p;
    real_->reset(p, plan, b);
  }
  void set_physics(const Physics& p) override {
    physics_ = p;
    real_->set_physics(p);
  }
  void set_ball(const BallState& b) override { real_->set_ball(b); }
  void restore(const ParcelSnapshot& s) override { real_->restore(s); }
  void submit(const StepRequest& r) override { real_->submit(r); }
  StepReport collect() override {
    StepReport report = real_->collect();
    double work_ms = 0.1;
    if (physics_.parcels.num > 0) work_ms += kParcels_ms;
    if (physics_.parcels.num > 0 && physics_.parcels.contacts) work_ms += kContacts_ms;
    if (physics_.parcels.num > 0 && physics_.ball.friction > 0.0) work_ms += kFriction_ms;
    const bool is_loaded = num_requests / 80 % 4 == 1;
    const bool stands_still = ++num_requests % 23 == 0;
    work_ms *= (is_loaded ? 6.0 : 1.0) * (1.0 + 0.002 * static_cast<double>(num_requests * 7 % 11));
    report.times = {};
    report.times[Phase::collide_integrate] =
        work_ms * static_cast<double>(report.totals.num_steps) + (stands_still ? 30.0 : 0.0);
    return report;
  }
  void draw(const DrawBuffers& b) override { real_->draw(b); }
  ParcelSnapshot snapshot() override { return real_->snapshot(); }
  void save(BackendState& state) override { real_->save(state); }
  void resume(const Physics& p, const BackendState& state) override {
    physics_ = p;
    real_->resume(p, state);
  }
  Measures measure() override { return real_->measure(); }
  std::uint64_t state_hash() override { return real_->state_hash(); }
  std::uint64_t memory_bytes() const override { return real_->memory_bytes(); }
  double min_bytes_moved(const StepTotals& t) const override { return real_->min_bytes_moved(t); }
  double measure_copy_bandwidth(std::size_t n) override { return real_->measure_copy_bandwidth(n); }

  static inline int num_requests = 0;  // of both copies

 private:
  std::unique_ptr<Backend> real_ = make_cpu_backend(1);
  Physics physics_;
};

// The load lasts as long as the pairs of one term: measured one term after the other, one cost would be six
// times too high.
TEST(TermCosts, ALoadThatComesAndGoesDoesNotShow) {
  for (const int begin : {0, 40, 80, 160, 240}) {
    LoadedBackend::num_requests = begin;
    Measured run(court_by(Method::impulse));
    run.costs = TermCosts([](const std::string&, std::int64_t) { return std::make_unique<LoadedBackend>(); });
    run.frames_on_request(kEnoughFrames);
    ASSERT_EQ(run.costs.state(), TermCosts::State::known);
    const TermCost& contacts = run.costs.cost(Term::contacts);
    EXPECT_NEAR(contacts.ms, LoadedBackend::kContacts_ms, 0.2 * LoadedBackend::kContacts_ms) << begin;
    EXPECT_NEAR(run.costs.cost(Term::parcels).ms, 0.25, 0.05) << begin;
    const std::string friction = cost_text(run.costs.cost(Term::friction));
    EXPECT_EQ(friction.substr(0, 2), "< ") << "below the noise: " << friction;
  }
}

}  // namespace
}  // namespace pf::test
