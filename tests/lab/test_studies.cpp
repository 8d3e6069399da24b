// What all studies of the lab share: their list, and their threads.
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "app/options.hpp"
#include "backend/backend.hpp"
#include "lab/parallel_for.hpp"
#include "lab/study.hpp"
#include "lab/validate.hpp"

namespace pf::test {
namespace {

TEST(Lab, ParallelForCallsEachOnceAndRethrows) {
  for (const unsigned threads : {1U, 3U}) {
    std::vector<std::atomic<int>> calls(50);
    parallel_for(50, threads, [&](int k) { ++calls[static_cast<std::size_t>(k)]; });
    for (const auto& num : calls) EXPECT_EQ(num, 1);
    std::atomic<int> num_started = 0;
    const auto fail = [&](int) {
      ++num_started;
      throw std::runtime_error("failed");
    };
    EXPECT_THROW(parallel_for(50, threads, fail), std::runtime_error);
    EXPECT_LE(num_started, static_cast<int>(threads)) << "no call starts after a failure";
    parallel_for(0, threads, fail);
  }
}

TEST(Lab, ValidationIsTheSameOnAnyNumberOfThreads) {
  std::vector<double> measured;
  for (const unsigned threads : {1U, 3U}) {
    limit_parallel_threads(threads);
    for (const ValidationCase& validation : gas_cases({true})) {
      if (validation.key != "density/exact/0.2") continue;
      validation.measure([&](const ValidationRow& row) { measured.push_back(row.measured); });
    }
  }
  limit_parallel_threads(0);
  ASSERT_EQ(measured.size(), 4U) << "rate and pressure, twice";
  EXPECT_EQ(measured[0], measured[2]);
  EXPECT_EQ(measured[1], measured[3]);
}

TEST(Lab, ListsEveryStudy) {
  std::vector<std::string> names;
  for (const Study& study : studies()) names.push_back(study.name);
  EXPECT_EQ(names, (std::vector<std::string>{"work-precision", "stability", "contact-clock", "terms",
                                             "gas-dynamics", "validate"}));
}

LabContext context_of(const char* scene) {
  return {true, {{"cpu", [] { return make_cpu_backend(1); }}}, scene};
}

std::vector<std::string> terms_of(const char* scene) {
  std::vector<std::string> keys;
  for (const LabPoint& point : terms_study().plan(context_of(scene)))
    keys.push_back(point.key.substr(point.key.rfind('/') + 1));
  return keys;
}

// Parcels of `regulation` have no contacts, so that leaving them out would change nothing.
TEST(Lab, TermsAreThoseThatTheSceneHas) {
  EXPECT_EQ(terms_of("court"), (std::vector<std::string>{"all terms", "no contacts", "no friction",
                                                         "no Magnus", "air as drag", "vacuum"}));
  EXPECT_EQ(terms_of("regulation"),
            (std::vector<std::string>{"all terms", "no friction", "no Magnus", "air as drag", "vacuum"}));
}

// The mass of each parcel is given in `seed`, so that another number of them would be another air.
TEST(Lab, TermsKeepTheAirOfTheScene) {
  for (const auto& [scene, num] : {std::pair{"seed", 10000}, std::pair{"court", 4000}}) {
    const LabPoint vacuum = terms_study().plan(context_of(scene)).back();
    EXPECT_EQ(vacuum.measure().at("num_parcels"), num) << scene;
  }
}

TEST(Lab, CommandLineAcceptsEveryStudy) {
  for (const Study& study : studies()) {
    const char* words[] = {"pickleflight", "lab", study.name.c_str()};
    EXPECT_EQ(parse_options(3, words).options.value().lab.study, study.name);
  }
}

}  // namespace
}  // namespace pf::test
