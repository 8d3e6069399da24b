// Needed and available memory.
#include <gtest/gtest.h>

#include <limits>

#include "app/memory.hpp"
#include "core/error.hpp"
#include "support/scene_support.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

std::string refusal(std::int64_t num_parcels, std::uint64_t needed, std::uint64_t available) {
  try {
    check_memory(num_parcels, needed, available);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

// The bound covers the memory of the backend in flight, for any density, method and number of threads. It is
// at most 2.5 times that memory: with few cells (a dense gas), unused slices of the sort, or few events in a
// window of `exact`, which needs most where many parcels collide. A thread that has done a whole window while
// others were put aside keeps room for it.
TEST(Memory, BoundHoldsForTheBackend) {
  constexpr std::int64_t kNum = 10000;
  for (const Method method : {Method::impulse, Method::exact}) {
    for (const double area_fraction : {0.01, 0.1, 0.5, 0.65}) {
      for (const unsigned threads : {1U, 2U, 6U}) {
        Settings settings = test::gas(kNum, area_fraction);
        settings.method = method;
        SceneRun run(settings, threads);
        const std::uint64_t law = cpu_backend_bytes(kNum, threads, method);
        const std::uint64_t whole_windows = method == Method::exact ? (threads - 1) * 100 * kNum : 0;
        for (int step = 0; step < 20; ++step) {
          run.advance(1);
          const std::uint64_t held = run.backend->memory_bytes();
          EXPECT_GE(law + whole_windows + 4096, held)
              << area_fraction << " " << threads << " " << step;  // padding
          EXPECT_LE(2 * law, 5 * held) << area_fraction << " " << threads << " " << step;
        }
      }
    }
  }
}

TEST(Memory, RefusalNamesBothFigures) {
  EXPECT_EQ(refusal(1000, 2ULL << 30, 2ULL << 30), "accepted");
  EXPECT_EQ(
      refusal(200000000, 24ULL << 30, 6ULL << 30),
      "air.num_parcels: 200000000 parcels need 24.00 GiB of memory, but 6.00 GiB are available; give at "
      "most about 4.8e+07 parcels (-p)");
}

TEST(Memory, ReadsAvailableMemoryFromProc) {
  TemporaryFolder folder;
  const auto table = folder.write("meminfo",
                                  "MemTotal:       32000000 kB\nMemFree:        1000 kB\n"
                                  "MemAvailable:   2048 kB\nSwapFree: 5 kB\n");
  EXPECT_EQ(available_memory_bytes(table), 2048U * 1024U);
  EXPECT_EQ(available_memory_bytes(folder.path() / "none"), std::numeric_limits<std::uint64_t>::max());
  const std::uint64_t here = available_memory_bytes();
  EXPECT_GT(here, 1U << 20);
  EXPECT_LT(here, 1ULL << 50);
}

}  // namespace
}  // namespace pf
