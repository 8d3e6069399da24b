// Checks, before any allocation, that a run has enough memory.
#pragma once

#include <cstdint>
#include <filesystem>

#include "backend/backend.hpp"
#include "scene/settings.hpp"

namespace pf {

// Upper bound on the bytes that the CPU backend holds for N parcels. Per parcel: state twice (position and
// velocity of 8 bytes, id of 4, a mark of 1), a sort key of 4, and 16 of the fast loop of a time step. Per
// cell, of which there are at most 2 (N + 1): its start and a counter for each of at most 4 slices of the
// counting sort, 4 bytes each. Method exact adds, per parcel, two ticks twice, a bounding disc of 12, a kept
// event of 8, owner and slot, and what clusters, members and segments of a window take where many parcels
// collide in it, if the threads share them. num_threads: 0 means all of the machine.
std::uint64_t cpu_backend_bytes(std::int64_t num_parcels, std::int64_t num_threads, Method method);

// Upper bound on the bytes that any backend holds in this machine's memory.
std::uint64_t host_bytes_here(const Backend& backend, const Settings& settings);

// Bytes of the draw memory that the CPU backend writes to: three regions, each 1.5 N entries of a position
// and a speed, 12 bytes.
std::uint64_t host_draw_bytes(std::int64_t num_parcels);

// The smaller of MemAvailable in a file like /proc/meminfo and the address space left to the process (ulimit
// -v). The largest 64-bit number if neither is known.
std::uint64_t available_memory_bytes(const std::filesystem::path& meminfo = "/proc/meminfo");

// Throws UserError with both figures if needed_bytes exceed available_bytes.
void check_memory(std::int64_t num_parcels, std::uint64_t needed_bytes, std::uint64_t available_bytes);

}  // namespace pf
