// Points of a study shared out over ranks: every point once, on whichever rank, with the same rows.
#include "lab/lab_ranks.hpp"

#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "core/error.hpp"
#include "domains/thread_ranks.hpp"

namespace pf {
namespace {

using nlohmann::json;

const std::atomic<bool> kGoOn = false, kStop = true;

// Ranks as threads. The others help with the studies of this program.
class Helpers {
 public:
  Helpers(unsigned num_ranks, const LabContext& context) : mail_(std::make_shared<test::Mail>()) {
    first = std::make_shared<test::ThreadCarrier>(mail_, 0, num_ranks);
    for (unsigned rank = 1; rank < num_ranks; ++rank) {
      threads_.emplace_back([this, rank, num_ranks, context] {
        test::ThreadCarrier carrier(mail_, rank, num_ranks);
        while (serve_domains(carrier) == Served::asked_to_leave) help_lab(carrier, context, 2);
      });
    }
  }
  ~Helpers() { end_domains(*first); }

  std::shared_ptr<test::ThreadCarrier> first;

 private:
  std::shared_ptr<test::Mail> mail_;
  std::vector<std::jthread> threads_;
};

LabContext quick_context() {
  return {true, {{"cpu", [] { return make_cpu_backend(1); }}}, "court"};
}

// The cheap points of study gas-dynamics.
std::vector<LabPoint> some_points() {
  std::vector<LabPoint> points = gas_dynamics_study().plan(quick_context());
  std::erase_if(points, [](const LabPoint& point) {
    return point.key.find("/layer/") == std::string::npos || point.key.find("spring") != std::string::npos;
  });
  return points;
}

json without_times(json row) {
  row.erase("ns_per_disc_time");
  return row;
}

std::map<std::string, json> measured(unsigned num_ranks, bool in_parallel) {
  Helpers helpers(num_ranks, quick_context());
  LabRanks ranks(helpers.first, 1, kGoOn);
  const LabRanks::Work work{"gas-dynamics", some_points(), in_parallel};
  std::mutex guard;
  std::map<std::string, json> rows;
  std::multiset<std::size_t> begun;
  const auto before = [&](std::size_t k) {
    const std::lock_guard lock(guard);
    begun.insert(k);
  };
  const auto keep = [&](std::size_t k, json row) {
    const std::lock_guard lock(guard);
    EXPECT_TRUE(rows.emplace(work.points[k].key, without_times(row)).second) << "twice";
  };
  ranks.measure(work, before, keep);
  EXPECT_EQ(begun.size(), work.points.size());
  EXPECT_EQ(rows.size(), work.points.size());
  return rows;
}

TEST(LabRanks, GiveTheSameRowsOnAnyNumberOfRanks) {
  const std::map<std::string, json> alone = measured(1, true);
  ASSERT_GE(alone.size(), 3U);
  EXPECT_EQ(measured(2, true), alone);
  EXPECT_EQ(measured(3, false), alone);
}

// While this rank waits for the others, they do all the rest.
TEST(LabRanks, OthersMeasureToo) {
  Helpers helpers(3, quick_context());
  LabRanks ranks(helpers.first, 1, kGoOn);
  LabRanks::Work work{"gas-dynamics", some_points(), true};
  std::atomic<int> num_others = 0, num_here = 0;
  const int num_points = static_cast<int>(work.points.size());
  for (LabPoint& point : work.points) {  // here alone: the others plan on their own
    point.measure = [&] {
      ++num_here;
      while (num_others < num_points - 1) std::this_thread::yield();
      return json::object();
    };
  }
  ranks.measure(
      work, [](std::size_t) {}, [&](std::size_t, const json& row) { num_others += row.empty() ? 0 : 1; });
  EXPECT_LE(num_here, 1);
  EXPECT_EQ(num_here + num_others, num_points);
}

TEST(LabRanks, AStopBeginsNothing) {
  Helpers helpers(3, quick_context());
  LabRanks ranks(helpers.first, 1, kStop);
  int num = 0;
  ranks.measure(
      {"gas-dynamics", some_points(), true}, [&](std::size_t) { ++num; }, [](std::size_t, const json&) {});
  EXPECT_EQ(num, 0);
}

TEST(LabRanks, AnErrorNamesItsRankAndEndsTheWork) {
  Helpers helpers(2, quick_context());
  LabRanks ranks(helpers.first, 1, kGoOn);
  LabRanks::Work work{"gas-dynamics",
                      {{"cuda/unknown", [] { return json(1); }}, {"cuda/unknown", [] { return json(1); }}},
                      true};
  std::atomic<int> num_taken = 0;
  work.points[0].measure = work.points[1].measure = [&] {  // of this rank: leaves the other one a point
    while (num_taken < 2) std::this_thread::yield();
    return json(1);
  };
  try {
    ranks.measure(
        work, [&](std::size_t) { ++num_taken; }, [](std::size_t, const json&) {});
    ADD_FAILURE() << "a rank knows the point cuda/unknown";
  } catch (const UserError& error) {
    EXPECT_EQ(std::string(error.what()),
              "rank 1: has no point cuda/unknown; do all processes have the same devices?");
  }
}

// As a full disk where rows are saved. The first point here waits for it, and no other one begins.
TEST(LabRanks, ARowThatCannotBeKeptEndsTheWork) {
  Helpers helpers(2, quick_context());
  LabRanks ranks(helpers.first, 1, kGoOn);
  LabRanks::Work work{"gas-dynamics", some_points(), false};
  std::atomic<bool> has_thrown = false;
  std::atomic<int> num_here = 0;
  for (LabPoint& point : work.points) {
    point.measure = [&] {
      ++num_here;
      while (!has_thrown) std::this_thread::yield();
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      return json::object();
    };
  }
  const auto keep = [&](std::size_t, const json& row) {
    if (row.empty()) return;
    has_thrown = true;
    throw UserError("the disk is full");
  };
  EXPECT_THROW(ranks.measure(
                   work, [](std::size_t) {}, keep),
               UserError);
  EXPECT_LE(num_here, 1);
}

TEST(LabRanks, AnErrorHereIsThrownWhenTheOthersHaveEnded) {
  const auto nothing = [](std::size_t) {};
  const auto keep = [](std::size_t, const json&) {};
  for (const unsigned num_ranks : {1U, 2U}) {
    Helpers helpers(num_ranks, quick_context());
    LabRanks ranks(helpers.first, 1, kGoOn);
    LabRanks::Work work{"gas-dynamics", {some_points()[0], some_points()[1]}, false};
    for (LabPoint& point : work.points) point.measure = []() -> json { throw UserError("here"); };
    EXPECT_THROW(ranks.measure(work, nothing, keep), UserError) << num_ranks;
  }
}

}  // namespace
}  // namespace pf
