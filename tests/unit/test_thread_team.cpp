// The team of threads that the CPU backend works with.
#include "core/thread_team.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <new>
#include <numeric>
#include <thread>
#include <vector>

namespace pf {
namespace {

using namespace std::chrono_literals;

TEST(ThreadTeam, DoesEachPartOfEachFunctionOnce) {
  for (const unsigned size : {1U, 2U, 3U, 8U, 33U}) {
    ThreadTeam team(size);
    std::vector<int> times_done(size, 0);
    constexpr int kFunctions = 2000;
    for (int number = 1; number <= kFunctions; ++number) {
      // A number of its own: a thread that is late must not do a part of an earlier function.
      int last = 0;
      team.run([&](unsigned part) {
        ++times_done[part];
        if (part == size - 1) last = number;
      });
      ASSERT_EQ(last, number);
    }
    EXPECT_EQ(times_done, std::vector<int>(size, kFunctions)) << size << " threads";
  }
}

TEST(ThreadTeam, SharesAreWhole) {
  const ThreadTeam team(3);
  std::size_t end = 0;
  for (unsigned part = 0; part < team.size(); ++part) {
    const ThreadTeam::Share share = team.share(part, 100);
    EXPECT_EQ(share.begin, end);
    end = share.end;
  }
  EXPECT_EQ(end, 100U);
}

TEST(ThreadTeam, PartsAreAsManyForEachThread) {
  EXPECT_EQ(ThreadTeam(1).num_parts(1'000'000, 10), 1U);
  const ThreadTeam team(3);
  EXPECT_EQ(team.num_parts(0, 10), 3U);
  EXPECT_EQ(team.num_parts(59, 10), 3U);
  EXPECT_EQ(team.num_parts(60, 10), 6U);
  const std::size_t most = team.num_parts(1'000'000, 10);
  EXPECT_GT(most, 6U);
  EXPECT_EQ(most % 3, 0U);
}

TEST(ThreadTeam, DoesEachOfManyPartsOnce) {
  for (const unsigned size : {1U, 2U, 3U, 8U}) {
    ThreadTeam team(size);
    std::vector<int> by_thread(size, 0);
    for (const std::size_t num_parts :
         {std::size_t{0}, std::size_t{1}, std::size_t{size}, std::size_t{100}}) {
      std::vector<int> times_done(num_parts, 0);
      constexpr int kFunctions = 500;
      for (int number = 0; number < kFunctions; ++number) {
        team.run_parts(num_parts, [&](unsigned thread, std::size_t part) {
          ++times_done[part];
          ++by_thread[thread];
        });
      }
      EXPECT_EQ(times_done, std::vector<int>(num_parts, kFunctions)) << size << " threads";
    }
    // Calls with the same thread have not overlapped.
    EXPECT_EQ(std::accumulate(by_thread.begin(), by_thread.end(), 0),
              500 * (1 + static_cast<int>(size) + 100));
  }
}

// The first part lasts until all others are done, which are of its thread's share, too.
TEST(ThreadTeam, ThreadsThatAreDoneTakePartsOfASlowOne) {
  ThreadTeam team(2);
  constexpr std::size_t kParts = 8;
  std::atomic<std::size_t> num_done = 0;
  bool was_left_alone = false;
  team.run_parts(kParts, [&](unsigned, std::size_t part) {
    const auto begun = std::chrono::steady_clock::now();
    while (part == 0 && num_done < kParts - 1 && !was_left_alone) {
      std::this_thread::sleep_for(1ms);
      was_left_alone = std::chrono::steady_clock::now() - begun > 60s;
    }
    ++num_done;
  });
  EXPECT_FALSE(was_left_alone);
}

// Threads that have waited for long sleep, and wake later than the calling one is done with its own part.
TEST(ThreadTeam, DoesNotWaitForAThreadThatIsLate) {
  ThreadTeam team(8);
  std::vector<std::thread::id> done_by(team.size());
  int parts_of_others = 0;
  for (int attempt = 0; attempt < 100 && parts_of_others == 0; ++attempt) {
    std::this_thread::sleep_for(5ms);
    team.run([&](unsigned part) { done_by[part] = std::this_thread::get_id(); });
    for (unsigned part = 1; part < team.size(); ++part) {
      if (done_by[part] == std::this_thread::get_id()) ++parts_of_others;
    }
  }
  EXPECT_GT(parts_of_others, 0);
}

TEST(ThreadTeam, ThrowsWhatOneOfManyPartsHasThrownAndGoesOn) {
  ThreadTeam team(3);
  EXPECT_THROW(team.run_parts(12,
                              [](unsigned, std::size_t part) {
                                if (part % 5 == 4) throw std::bad_alloc();
                              }),
               std::bad_alloc);
  std::vector<int> times_done(12, 0);
  team.run_parts(times_done.size(), [&](unsigned, std::size_t part) { ++times_done[part]; });
  EXPECT_EQ(times_done, std::vector<int>(times_done.size(), 1));
}

TEST(ThreadTeam, ThrowsWhatAPartHasThrownAndGoesOn) {
  ThreadTeam team(3);
  for (const unsigned failing : {0U, 1U, 2U}) {
    std::vector<int> times_done(team.size(), 0);
    const auto work = [&](unsigned part) {
      ++times_done[part];
      if (part == failing) throw std::bad_alloc();
    };
    EXPECT_THROW(team.run(work), std::bad_alloc) << failing;
    EXPECT_EQ(times_done, std::vector<int>(team.size(), 1)) << failing;
    int last = 0;
    team.run([&](unsigned part) {
      if (part == 0) ++last;
    });
    EXPECT_EQ(last, 1);
  }
}

}  // namespace
}  // namespace pf
