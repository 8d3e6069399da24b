// Domains on GPUs, whose kernels the CPU runs, end in the bits of the CPU backend.
#include <cstdlib>

#include "domains/domain_pair.hpp"

namespace pf::test {
namespace {

class DomainKernels : public Domains {
 protected:
  void TearDown() override {
    ::unsetenv("PICKLEFLIGHT_DEVICE_LIMITS");
    Domains::TearDown();
  }
  // A thread looks around one parcel, or around two, among which there may be ghosts.
  template <class Test>
  static void in_both_ways(const Test& test) {
    for (const char* limits : {"", "many_for_two=1"}) {
      SCOPED_TRACE(limits);
      ::setenv("PICKLEFLIGHT_DEVICE_LIMITS", limits, 1);
      test();
    }
  }
};

void expect_the_bits_of_the_cpu() {
  for (const Boundary boundary : {Boundary::open, Boundary::walls, Boundary::periodic}) {
    for (const Method method : {Method::impulse, Method::spring}) {
      for (const unsigned num : {2U, 3U, 7U}) {
        Settings s = busy_court(boundary, 1450);
        s.method = method;
        Pair pair(s, domains(num));
        EXPECT_GT(pair.expect_same_steps(30, 2e-4).num_collisions, 0U);
        pair.set_radius(1.1);
        pair.expect_same_steps(10, 2e-4);
      }
    }
  }
}

TEST_F(DomainKernels, GiveTheBitsOfTheCpu) { in_both_ways(expect_the_bits_of_the_cpu); }

void expect_the_bits_of_the_cpu_in_a_crowd() {
  for (const Boundary boundary : {Boundary::walls, Boundary::periodic}) {
    Settings s = busy_court(boundary, 1450);
    s.area_fraction = 0.65;
    Pair pair(s, domains(4));
    EXPECT_GT(pair.expect_same_steps(30, 1e-3).num_collisions, 0U);
  }
}

// Parcels that touch several others at once, on both sides of a border.
TEST_F(DomainKernels, GiveTheBitsOfTheCpuInACrowd) { in_both_ways(expect_the_bits_of_the_cpu_in_a_crowd); }

TEST_F(DomainKernels, GiveTheGoldenStates) {
  expect_golden_states([] { return domains(3); });
}

}  // namespace
}  // namespace pf::test
