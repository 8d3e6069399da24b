// The team of threads that the CPU backend works with.
#include "core/thread_team.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <new>
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
