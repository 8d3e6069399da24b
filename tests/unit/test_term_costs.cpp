#include <gtest/gtest.h>

#include "view/term_costs.hpp"

namespace pf {
namespace {

// One frame of ten steps of ms_a_step each.
void add_frame(TermCosts& costs, const Settings& settings, double ms_a_step) {
  FrameView frame;
  frame.settings = &settings;
  frame.frame_totals.num_steps = 10;
  frame.times[Phase::collide_integrate] = 10.0 * ms_a_step;
  costs.add_frame(frame);
}

TEST(TermCosts, AreKnownOnceATermWasSeenOnAndOff) {
  TermCosts costs;
  Settings settings;
  settings.contacts = true;
  add_frame(costs, settings, 0.5);
  EXPECT_FALSE(costs.cost_ms(Term::contacts));
  settings.contacts = false;
  add_frame(costs, settings, 0.2);
  ASSERT_TRUE(costs.cost_ms(Term::contacts));
  EXPECT_NEAR(*costs.cost_ms(Term::contacts), 0.3, 1e-12);
  EXPECT_NEAR(costs.step_ms(), 0.2, 1e-12);
  EXPECT_FALSE(costs.cost_ms(Term::magnus)) << "never switched";
}

TEST(TermCosts, StartAnewWhenTheWorkChanges) {
  TermCosts costs;
  Settings settings;
  settings.num_parcels = 1000;
  add_frame(costs, settings, 0.5);
  settings.contacts = false;
  add_frame(costs, settings, 0.2);
  settings.num_parcels = 2000;
  add_frame(costs, settings, 0.4);
  EXPECT_FALSE(costs.cost_ms(Term::contacts));
}

}  // namespace
}  // namespace pf
