#include "app/memory.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <thread>

#include "backend/cell_sort.hpp"
#include "core/error.hpp"
#include "model/parcel.hpp"

namespace pf {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

double gib(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 30); }

std::uint64_t free_memory_bytes(const std::filesystem::path& meminfo) {
  std::ifstream lines(meminfo);
  for (std::string name; lines >> name;) {
    std::uint64_t kib = 0;
    if (name == "MemAvailable:" && lines >> kib) return kib * 1024;
    lines.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return kNoLimit;
}

std::uint64_t address_space_left_bytes() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoLimit;
  std::uint64_t mapped_pages = 0;
  std::ifstream("/proc/self/statm") >> mapped_pages;
  const std::uint64_t mapped = mapped_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return limit.rlim_cur > mapped ? limit.rlim_cur - mapped : 0;
}

}  // namespace

std::uint64_t cpu_backend_bytes(std::int64_t num_parcels, std::int64_t num_threads, Method method) {
  const std::uint64_t machine = std::max(1U, std::thread::hardware_concurrency());
  const std::uint64_t threads = num_threads > 0 ? static_cast<std::uint64_t>(num_threads) : machine;
  const auto n = static_cast<std::uint64_t>(num_parcels);
  const std::uint64_t num_cells = 2 * (n + 1);
  constexpr std::uint64_t kWindow = 100;  // 10 to 95 measured at area fractions of 0.01 to 0.65
  const std::uint64_t of_method = method == Method::exact ? 2 * 8 + 3 * 4 + 4 * 4 + kWindow : 0;
  return n * (2 * 21 + 4 + 12 + 4 + of_method) +
         num_cells * 4 * (1 + std::min<std::uint64_t>(threads, CellSort::kMaxCounts));
}

std::uint64_t host_bytes_here(const Backend& backend, const Settings& settings) {
  constexpr double kSpawned = 2.0 * sizeof(Parcel);  // in vectors that have grown, on their way to GPUs
  if (backend.name() != "cpu")
    return static_cast<std::uint64_t>(kSpawned * backend.share_here() *
                                      static_cast<double>(settings.num_parcels));
  constexpr double kOfDomains = 1.5;  // 1.0 to 1.4 measured: copies of neighbours' parcels, and room to grow
  const std::uint64_t all = cpu_backend_bytes(settings.num_parcels, settings.threads, settings.method);
  if (backend.num_domains() == 1) return all;
  return static_cast<std::uint64_t>(kOfDomains * backend.share_here() * static_cast<double>(all));
}

std::uint64_t host_draw_bytes(std::int64_t num_parcels) {
  return static_cast<std::uint64_t>(num_parcels) * 3 * 12 * 3 / 2;
}

std::uint64_t available_memory_bytes(const std::filesystem::path& meminfo) {
  return std::min(free_memory_bytes(meminfo), address_space_left_bytes());
}

void check_memory(std::int64_t num_parcels, std::uint64_t needed_bytes, std::uint64_t available_bytes) {
  if (needed_bytes <= available_bytes) return;
  const double max_parcels = static_cast<double>(num_parcels) * gib(available_bytes) / gib(needed_bytes);
  throw UserError(
      fmt::format("air.num_parcels: {} parcels need {:.2f} GiB of memory, but {:.2f} GiB are "
                  "available; give at most about {:.2g} parcels (-p)",
                  num_parcels, gib(needed_bytes), gib(available_bytes), 0.95 * max_parcels));
}

}  // namespace pf
