#include "ranks.hpp"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/random.hpp"
#include "mpi/launcher.hpp"
#include "process.hpp"
#if PF_HAVE_MPI
#include "mpi/mpi_carrier.hpp"
#endif

namespace pf {
namespace {

std::shared_ptr<Carrier> join() {
  if (num_ranks_by_launcher() == 0) return std::make_shared<LocalCarrier>();
#if PF_HAVE_MPI
  return join_mpi();
#else
  if (num_ranks_by_launcher() == 1) return std::make_shared<LocalCarrier>();
  throw UserError(
      "mpirun: this program was built without MPI; install libopenmpi-dev and build it again, or give "
      "--domains without mpirun");
#endif
}

std::uint64_t hash_of(const std::string& text, std::uint64_t hash) {
  for (const char letter : text) hash = mix64(hash ^ static_cast<unsigned char>(letter));
  return mix64(hash);
}

}  // namespace

Ranks::Ranks(int argc, const char* const* argv) : carrier_(join()) {
  std::uint64_t mine = hash_of(PF_VERSION, 1);
  for (int k = 1; k < argc; ++k) mine = hash_of(argv[k], mine);
  std::vector<std::uint64_t> all(num());
  carrier_->all_gather(&mine, sizeof(mine), all.data());
  for (const std::uint64_t other : all) are_alike_ = are_alike_ && other == all[0];
  if (!are_alike_ && leads())
    throw UserError(
        "mpirun: its processes differ in version or arguments; start the same program with the same "
        "arguments everywhere");
}

Ranks::~Ranks() {
  if (leads()) end_domains(*carrier_);
}

// The first rank ends a run in its own time, so the others heed no signal that the launcher hands on.
int Ranks::serve(const std::function<void()>& other_work, const FindDomainGpus& find_gpus) {
  if (!are_alike_) return 0;  // the first rank says so
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  std::signal(SIGHUP, SIG_IGN);
  std::string error;
  try {
    while (serve_domains(*carrier_, find_gpus) == Served::asked_to_leave) other_work();
    return 0;
  } catch (const std::bad_alloc&) {
    error = "out of memory; give fewer parcels (-p)";
  } catch (const std::system_error& failed) {
    error = text_of(failed);
  } catch (const std::exception& other) {
    error = other.what();
  }
  announce(fmt::format("pickleflight: rank {}: {}", carrier_->rank(), error));
  return fail(3);
}

int Ranks::fail(int exit_code) const {
#if PF_HAVE_MPI
  if (num() > 1) abort_mpi(exit_code);
#endif
  return exit_code;
}

}  // namespace pf
