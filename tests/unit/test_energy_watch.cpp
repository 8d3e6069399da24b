// A gas that blows up is noticed, and nothing else is taken for one.
#include "app/energy_watch.hpp"

#include <gtest/gtest.h>

#include "support/scene_support.hpp"

namespace pf::test {
namespace {

// Flies until the flight pauses by itself, for at most that many frames of one step each.
struct Watched {
  Simulation simulation;

  explicit Watched(const Settings& settings) : simulation(settings, make_cpu_backend(1)) {}
  bool pauses_within(int num_frames) {
    for (int k = 0; k < num_frames && !view().paused; ++k) simulation.advance_frame({}, nullptr);
    return view().paused;
  }
  const FrameView& view() { return simulation.view(); }
};

// Contacts exchange more than would keep the energy.
Settings heating_gas() {
  Settings s = gas(2000, 0.4);
  s.impulse_scale = 1.15;
  return s;
}

TEST(EnergyWatch, PausesAGasThatBlowsUpOnce) {
  Watched run(heating_gas());
  const double before_j = run.simulation.backend().measure().energy_j();
  ASSERT_TRUE(run.pauses_within(1000));
  EXPECT_GT(run.simulation.backend().measure().energy_j(), EnergyWatch::kBlownUp * before_j);
  EXPECT_NE(run.view().message.find("energy has grown"), std::string::npos) << run.view().message;
  EXPECT_NE(run.view().message.find("method impulse"), std::string::npos) << run.view().message;

  Commands onward;
  onward.toggle_pause = true;
  run.simulation.advance_frame(onward, nullptr);
  // Later parcels leave the range of numbers, which is told.
  const bool pauses = run.pauses_within(30);
  EXPECT_FALSE(pauses && run.view().message.find("energy has grown") != std::string::npos)
      << "it has told so: " << run.view().message;
}

TEST(EnergyWatch, PausesAGasThatLongStepsHeat) {
  Settings s = gas(2000, 0.2);
  s.dt_s = 0.5;
  Watched run(s);
  EXPECT_TRUE(run.pauses_within(1000));
  EXPECT_NE(run.view().message.find("energy has grown"), std::string::npos) << run.view().message;
}

// In a crowd `impulse` gains energy at short steps, too, though nothing overlaps deeply.
TEST(EnergyWatch, PausesACrowdThatShortStepsHeat) {
  Settings s = gas(2000, 0.69);
  s.dt_s = 0.002;
  s.substeps = 50;
  Watched run(s);
  EXPECT_TRUE(run.pauses_within(120));
  EXPECT_NE(run.view().message.find("energy has grown"), std::string::npos) << run.view().message;
}

// It is the same gas, however often its state was saved on the way.
TEST(EnergyWatch, GoesOnFromASavedState) {
  Watched whole(heating_gas());
  ASSERT_TRUE(whole.pauses_within(1000));
  Watched first(heating_gas());
  ASSERT_FALSE(first.pauses_within(20));
  auto simulation = std::make_unique<Simulation>(heating_gas(), make_cpu_backend(1));
  RunState state;
  first.simulation.save(state);
  for (int frames = 20; frames < 1000 && !simulation->view().paused; ++frames) {
    simulation = std::make_unique<Simulation>(state, make_cpu_backend(1));
    simulation->advance_frame({}, nullptr);
    simulation->save(state);
  }
  EXPECT_NE(simulation->view().message.find("energy has grown"), std::string::npos);
  EXPECT_EQ(simulation->view().totals.num_steps, whole.view().totals.num_steps);
}

// After a reset it starts anew: there is no less reason to stop than before.
TEST(EnergyWatch, StartsAnewWithAFlight) {
  Watched run(heating_gas());
  ASSERT_TRUE(run.pauses_within(300));
  Commands reset;
  reset.reset = true;
  reset.toggle_pause = true;
  run.simulation.advance_frame(reset, nullptr);
  ASSERT_FALSE(run.view().paused);
  EXPECT_EQ(run.view().message, "");
  EXPECT_TRUE(run.pauses_within(300));
  EXPECT_NE(run.view().message.find("energy has grown"), std::string::npos) << run.view().message;
}

// `exact` and `impulse` in a dense gas, with losses, too, and deep overlaps of long steps in a thin one.
TEST(EnergyWatch, LeavesOtherGasesAlone) {
  Settings exact = gas(2000, 0.65);
  exact.method = Method::exact;
  EXPECT_FALSE(Watched(exact).pauses_within(200));
  EXPECT_FALSE(Watched(gas(2000, 0.65)).pauses_within(300));
  Settings lossy = gas(2000, 0.65);
  lossy.restitution = 0.9;
  EXPECT_FALSE(Watched(lossy).pauses_within(300));
  Settings thin = gas(2000, 0.2);
  thin.dt_s = 0.2;
  EXPECT_FALSE(Watched(thin).pauses_within(300));
}

}  // namespace
}  // namespace pf::test
