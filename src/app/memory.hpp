// Whether the memory that a run needs is there, before any of it is taken.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "backend/backend.hpp"

namespace pf {

// Most bytes that the CPU backend holds for N parcels: state twice (position and velocity of 8 bytes, an id
// of 4), a sort key of 4, and for each cell, of which there are at most 2 (N + 1), its start and a counter
// for each of at most 4 slices of the counting sort, 4 bytes each. Method exact adds, per parcel, two clocks
// twice, three words and two marks of its rounds, and what undoes a step: a line, an index and a clock.
// num_threads: 0 means all of the machine.
std::uint64_t cpu_backend_bytes(std::int64_t num_parcels, std::int64_t num_threads, Method method);

// Bytes of the draw memory that the CPU backend writes through: three regions, half as large again as N, of
// a position and a speed, 12 bytes.
std::uint64_t host_draw_bytes(std::int64_t num_parcels);

// MemAvailable of a file as /proc/meminfo, or what the process may still map (ulimit -v) if that is less; the
// largest number there is if neither says anything.
std::uint64_t available_memory_bytes(const std::filesystem::path& meminfo = "/proc/meminfo");

// Throws UserError with both figures if needed_bytes are more than what is available.
void check_memory(std::int64_t num_parcels, std::uint64_t needed_bytes, std::uint64_t available_bytes);

}  // namespace pf
