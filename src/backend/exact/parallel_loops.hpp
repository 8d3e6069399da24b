// Loops of a window whose work its threads share.
#pragma once

#include <cstddef>

#include "backend/exact/window.hpp"

namespace pf {

// With fewer items than this the calling thread works alone: waking the others would cost more.
constexpr std::size_t kMinSharedItems = 256;

// Calls visit(worker, begin, end) for shares of the items 0 .. num - 1, in the order of workers.
template <class Visit>
void for_each_share(WindowContext& window, std::size_t num, const Visit& visit) {
  std::vector<WorkerState>& workers = window.memory.workers;
  if (num < kMinSharedItems) return visit(workers[0], 0, num);
  window.team.run([&](unsigned thread) {
    const auto [begin, end] = window.team.share(thread, num);
    visit(workers[thread], begin, end);
  });
}

// Calls visit(worker, item) for the items 0 .. num - 1. Shares are contiguous and in the order of workers.
template <class Visit>
void for_each_item(WindowContext& window, std::size_t num, const Visit& visit) {
  for_each_share(window, num, [&](WorkerState& worker, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) visit(worker, k);
  });
}

// The same, but a worker that is done early takes items of others: what it visits is not contiguous.
// With fewer than min_shared items the calling thread works alone. min_together: items that a worker takes at
// a time, at least, if it has more than one such part.
template <class Visit>
void for_each_item_by_any(WindowContext& window, std::size_t num, std::size_t min_shared,
                          std::size_t min_together, const Visit& visit) {
  std::vector<WorkerState>& workers = window.memory.workers;
  const std::size_t num_parts = num < min_shared ? 1 : window.team.num_parts(num, min_together);
  const auto visit_part = [&](unsigned thread, std::size_t part) {
    const auto [begin, end] = ThreadTeam::share(part, num_parts, num);
    for (std::size_t k = begin; k < end; ++k) visit(workers[thread], k);
  };
  if (num_parts == 1) return visit_part(0, 0);
  window.team.run_parts(num_parts, visit_part);
}

// Calls visit(worker, chunk) for the chunks of all parcels, which stay in the cache. Chunk k has the parcels
// from kChunkSize k on.
template <class Visit>
void for_each_chunk(WindowContext& window, const Visit& visit) {
  constexpr std::size_t kMinChunks = 4;
  const std::size_t num_chunks = (window.num_parcels() + kChunkSize - 1) / kChunkSize;
  for_each_item_by_any(window, num_chunks, 2, kMinChunks, [&](WorkerState& worker, std::size_t k) {
    visit(worker, static_cast<std::uint32_t>(k));
  });
}

// Calls visit(worker) for each worker. num_items: size of the whole work.
template <class Visit>
void for_each_worker(WindowContext& window, std::size_t num_items, const Visit& visit) {
  std::vector<WorkerState>& workers = window.memory.workers;
  if (num_items < kMinSharedItems) {
    for (WorkerState& worker : workers) visit(worker);
  } else {
    window.team.run([&](unsigned thread) { visit(workers[thread]); });
  }
}

}  // namespace pf
