// Reads what a launcher of MPI tells the processes that it starts, in their environment.
#pragma once

#include <algorithm>
#include <cstdlib>

namespace pf {

// Number of processes that it started; 0: none started this one. Known are the launchers of Open MPI, of
// MPICH and its relatives, and of Slurm with PMIx.
inline unsigned num_ranks_by_launcher() {
  const auto number = [](const char* text) {
    return static_cast<unsigned>(std::max(1L, std::strtol(text, nullptr, 10)));
  };
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"}) {
    if (const char* size = std::getenv(name); size != nullptr) return number(size);
  }
  if (std::getenv("PMIX_RANK") == nullptr) return 0;
  const char* size = std::getenv("SLURM_NTASKS");
  return size == nullptr ? 1 : number(size);
}

}  // namespace pf
