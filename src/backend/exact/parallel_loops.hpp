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

// Calls visit(worker, chunk) for the chunks of all parcels, which stay in the cache. Chunk k has the parcels
// from kChunkSize k on.
template <class Visit>
void for_each_chunk(WindowContext& window, const Visit& visit) {
  std::vector<WorkerState>& workers = window.memory.workers;
  const std::size_t num_chunks = (window.num_parcels() + kChunkSize - 1) / kChunkSize;
  const auto visit_chunks = [&](WorkerState& worker, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) visit(worker, static_cast<std::uint32_t>(k));
  };
  if (num_chunks == 1) return visit_chunks(workers[0], 0, 1);
  window.team.run([&](unsigned thread) {
    const auto [begin, end] = window.team.share(thread, num_chunks);
    visit_chunks(workers[thread], begin, end);
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
