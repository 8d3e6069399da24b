// Ranks as processes that a launcher of MPI started (mpirun, srun).
#pragma once

#include <memory>

#include "backend/domains/carrier.hpp"

namespace pf {

// Starts MPI. Throws UserError if the launcher's processes do not find each other. Ends it with the object.
std::shared_ptr<Carrier> join_mpi();

// Ends all ranks at once.
[[noreturn]] void abort_mpi(int exit_code);

}  // namespace pf
