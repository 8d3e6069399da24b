#include "backend/exact/predict.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "backend/exact/chunk_reach.hpp"
#include "backend/exact/parallel_loops.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

bool is_finite(const WindowContext& window, std::size_t i) {
  const Vec2f velocity = window.trajectories.velocity[i];
  return dot(velocity, velocity) < kMaxFiniteSpeed2;
}

void report_invalid(const WindowContext& window, WorkerState& worker, std::size_t begin, std::size_t end) {
  const ParcelArrays& parcels = window.trajectories;
  for (std::size_t i = begin; i < end; ++i) {
    if (!is_retired(parcels.position[i]) && !is_finite(window, i)) worker.tally.invalid(parcels.id[i]);
  }
}

template <Boundary kBoundary>
void predict_edge(WindowContext& window, std::uint32_t i) {
  const ExactConstants& c = window.c;
  if (!may_reach_edge<kBoundary>(c, window.input.position[i])) return;
  if (is_retired(window.trajectories.position[i]) || !is_finite(window, i)) return;
  Event event;
  keep_edge_event<kBoundary>(c, window.start_trajectory(i), event);
  if (event.tick != kNoTick) window.memory.calendar.set(i, event);
}

Chunk chunk_of(const WindowContext& window, std::uint32_t k) {
  return {window.input.position, static_cast<std::uint32_t>(window.num_parcels()), k, kChunkSize};
}

// Returns whether a parcel of the chunk may reach the edge in the epoch.
template <Boundary kBoundary>
bool may_reach_edge(const WindowContext& window, const Chunk& chunk) {
  return pf::may_reach_edge<kBoundary>(window.c, chunk.low) ||
         pf::may_reach_edge<kBoundary>(window.c, chunk.high);
}

// Discs and events at an edge of the parcels of a chunk.
template <Boundary kBoundary>
void look_ahead(WindowContext& window, WorkerState& worker, const Chunk& chunk) {
  const ParcelArrays& parcels = window.trajectories;
  const std::uint32_t begin = chunk.begin, end = chunk.end;
  const StepPaths paths{window.input.position, parcels.velocity.data(), window.units_in_epoch(),
                        window.half_contact()};
  const SpeedBounds speeds = set_discs(paths, begin, end, window.memory.discs);
  worker.tally.fly(speeds.max2);
  window.memory.chunk_speed2[chunk.number] = speeds.max2;
  if (!speeds.all_finite) report_invalid(window, worker, begin, end);
  window.memory.calendar.clear(begin, end);
  if (!may_reach_edge<kBoundary>(window, chunk)) return;
  for (std::uint32_t i = begin; i < end; ++i) predict_edge<kBoundary>(window, i);
}

// Predicts the collisions of the parcels of a chunk with parcels of higher index.
template <Boundary kBoundary>
void predict_collisions(WindowContext& window, WorkerState& worker, const Chunk& chunk) {
  const ExactConstants& c = window.c;
  const Vec2i* position = window.input.position;
  const Vec2f* velocity = window.trajectories.velocity.data();
  const float contact = static_cast<float>(c.run.contact_distance), units_per_mps = window.units_in_epoch();
  Calendar& calendar = window.memory.calendar;
  DiscSpace space = window.space;
  space.reach = reach_from<kBoundary>(window.c, window.space, window.memory.chunk_speed2, chunk);
  window.search.find_pairs(space, chunk.begin, chunk.end, worker.pairs);
  for (const auto [i, j] : worker.pairs.candidates) {
    const Vec2i offset = separation<kBoundary>(c.run.physics.world, position[i], position[j]);
    if (!may_collide(offset, velocity[j] - velocity[i], contact, units_per_mps)) continue;
    const std::uint32_t tick =
        collision_tick<kBoundary>(c, window.start_trajectory(i), window.start_trajectory(j));
    if (tick == kNoTick) continue;
    calendar.lower(i, tick, j);
    calendar.lower(j, tick, i);
  }
}

// Moves the workers' selected parcels to `all`, in the order of threads.
void collect_selected(std::vector<WorkerState>& workers, std::vector<std::uint32_t>& all) {
  all.clear();
  for (WorkerState& worker : workers) {
    all.insert(all.end(), worker.selected.begin(), worker.selected.end());
    worker.selected.clear();
  }
}

// Ranges of parcels in cells near the ball.
template <Boundary kBoundary>
void list_cells_near_ball(const WindowContext& window, CandidateRanges& ranges) {
  const auto num_parcels = static_cast<std::uint32_t>(window.num_parcels());
  const auto& [centre, radius] = window.ball_neighbourhood;
  const std::int64_t farthest = std::max(std::abs(std::int64_t{centre.x}), std::abs(std::int64_t{centre.y}));
  const bool is_sorted = num_parcels > 0 && window.c.run.physics.parcels.contacts && !window.input.all_pairs;
  if (!is_sorted || farthest + radius >= INT32_MAX) return ranges.list_all(num_parcels);
  ranges.list<kBoundary>(window.input.grid, window.input.cell_start, centre, radius, num_parcels);
}

template <Boundary kBoundary>
void list_near_ball(WindowContext& window) {
  window.memory.near_ball.clear();
  if (!window.c.run.physics.ball.exists) return;
  CandidateRanges ranges;
  list_cells_near_ball<kBoundary>(window, ranges);
  for (int r = 0; r < ranges.num; ++r) {
    const auto [first, last] = ranges.at[r];
    for_each_item(window, last - first, [&, first = first](WorkerState& worker, std::size_t k) {
      const auto i = first + static_cast<std::uint32_t>(k);
      if (is_retired(window.input.position[i]) || !is_finite(window, i)) return;
      if (window.is_near_ball<kBoundary>(i)) worker.selected.push_back(i);
    });
  }
  collect_selected(window.memory.workers, window.memory.near_ball);
}

template <Boundary kBoundary>
void predict_epoch(WindowContext& window) {
  window.memory.calendar.reset(window.trajectories.id);
  for_each_chunk(window, [&](WorkerState& worker, std::uint32_t k) {
    look_ahead<kBoundary>(window, worker, chunk_of(window, k));
  });
  if (window.c.run.physics.parcels.contacts) {
    for_each_chunk(window, [&](WorkerState& worker, std::uint32_t k) {
      predict_collisions<kBoundary>(window, worker, chunk_of(window, k));
    });
  }
  list_near_ball<kBoundary>(window);
}

template <Boundary kBoundary>
void predict_frozen_ball(WindowContext& window) {
  for (const std::uint32_t i : window.memory.near_ball) {
    const Trajectory parcel = window.start_trajectory(i);
    if (is_retired(parcel.anchor)) continue;
    const std::uint32_t tick = window.ball_tick<kBoundary>(window.memory.ball.trajectory, parcel);
    if (tick != kNoTick) window.memory.calendar.lower(i, tick, kBallPartner);
  }
}

template <Boundary kBoundary>
void predict_ball_events(WindowContext& window) {
  window.memory.ball_event = {};
  if (window.has_frozen_ball()) predict_frozen_ball<kBoundary>(window);
  if (window.has_participant()) window.memory.ball_event = next_ball_event<kBoundary>(window);
}

}  // namespace

void predict_epoch(WindowContext& window) {
  for_boundary(window.c.run.physics.world.boundary,
               [&]<Boundary kBoundary>() { predict_epoch<kBoundary>(window); });
}

void predict_ball_events(WindowContext& window) {
  for_boundary(window.c.run.physics.world.boundary,
               [&]<Boundary kBoundary>() { predict_ball_events<kBoundary>(window); });
}

}  // namespace pf
