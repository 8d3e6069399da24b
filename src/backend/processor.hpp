// Describes the processor for the backends that run on it.
#pragma once

#include <cstddef>
#include <string>

#include "core/thread_team.hpp"
#include "model/measures.hpp"

namespace pf {

// Its name, with a number of threads.
std::string processor_with_threads(unsigned num_threads);

// See Backend.
double min_step_bytes(std::size_t num_parcels, std::size_t num_cells, const StepTotals& totals);
double measure_copy_bandwidth(ThreadTeam& team, std::size_t num_bytes);

}  // namespace pf
