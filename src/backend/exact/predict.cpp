#include "backend/exact/predict.hpp"

#include <algorithm>
#include <atomic>

#include "backend/exact/parallel_loops.hpp"
#include "backend/exact/positions_at.hpp"
#include "model/for_boundary.hpp"

namespace pf {
namespace {

bool is_finite(const StepContext& step, std::size_t i) {
  const Vec2f velocity = step.trajectories.velocity[i];
  return dot(velocity, velocity) < kMaxFiniteSpeed2;
}

void report_invalid(const StepContext& step, WorkerState& worker, std::size_t begin, std::size_t end) {
  const ParcelArrays& parcels = step.trajectories;
  for (std::size_t i = begin; i < end; ++i) {
    if (!is_retired(parcels.position[i]) && !is_finite(step, i)) worker.tally.invalid(parcels.id[i]);
  }
}

// Predicts an event with an edge or a frozen ball.
template <Boundary kBoundary>
void predict_edge_and_ball(StepContext& step, WorkerState& worker, std::uint32_t i) {
  const ExactConstants& c = step.c;
  if (is_retired(step.trajectories.position[i]) || !is_finite(step, i)) return;
  const bool near_edge = may_reach_edge<kBoundary>(c, step.input.position[i]);
  const bool near_ball = c.plan.ball == BallRole::frozen && step.is_near_ball<kBoundary>(i);
  if (!near_edge && !near_ball) return;
  const Trajectory trajectory = step.start_trajectory(i);
  Event best;
  if (near_edge) keep_edge_event<kBoundary>(c, trajectory, best);
  if (near_ball) {
    const std::uint32_t tick = ball_collision_tick<kBoundary>(c, step.ball.trajectory, trajectory);
    keep_earlier(best, {tick, kBallPartner, kBallPartner});
  }
  if (best.tick == kNoTick) return;
  step.memory.event_key[i] = event_key(best.tick, best.partner);
  step.memory.event_partner[i] = best.partner;
  worker.selected.push_back(i);
}

// Looks ahead for parcels begin .. end - 1: end positions, discs, and events with an edge or a frozen ball.
template <Boundary kBoundary>
void look_ahead(StepContext& step, WorkerState& worker, std::size_t begin, std::size_t end) {
  const ExactConstants& c = step.c;
  const ParcelArrays& parcels = step.trajectories;
  positions_at(c, {parcels.position.data(), parcels.velocity.data(), parcels.tick.data()},
               static_cast<std::int32_t>(c.plan.length), begin, end, step.end_position);
  const StepPaths paths{step.input.position, parcels.velocity.data(), step.units_in_step(),
                        step.half_contact()};
  const SpeedBounds speeds = set_discs(paths, begin, end, step.memory.discs);
  worker.tally.moved(0, speeds.max2);
  if (!speeds.all_finite) report_invalid(step, worker, begin, end);
  if (kBoundary == Boundary::periodic && c.plan.ball != BallRole::frozen) return;
  for (std::size_t i = begin; i < end; ++i)
    predict_edge_and_ball<kBoundary>(step, worker, static_cast<std::uint32_t>(i));
}

// Appends to worker.collisions those of parcels begin .. end - 1 with parcels of higher index.
template <Boundary kBoundary>
void predict_collisions(StepContext& step, WorkerState& worker, std::uint32_t begin, std::uint32_t end) {
  const ExactConstants& c = step.c;
  const Vec2i* position = step.input.position;
  const Vec2f* velocity = step.trajectories.velocity.data();
  const float contact = static_cast<float>(c.run.contact_distance), units_per_mps = step.units_in_step();
  step.search.find_pairs(step.space, begin, end, worker.pairs);
  for (const auto [i, j] : worker.pairs.candidates) {
    const Vec2i offset = separation<kBoundary>(c.run.physics.world, position[i], position[j]);
    if (!may_collide(offset, velocity[j] - velocity[i], contact, units_per_mps)) continue;
    const std::uint32_t tick =
        collision_tick<kBoundary>(c, step.start_trajectory(i), step.start_trajectory(j));
    if (tick != kNoTick) worker.collisions.push_back({tick, i, j});
  }
}

void lower_to(std::uint64_t& shared_key, std::uint64_t key) {
  std::atomic_ref<std::uint64_t> shared(shared_key);
  std::uint64_t seen = shared.load(std::memory_order_relaxed);
  while (key < seen && !shared.compare_exchange_weak(seen, key, std::memory_order_relaxed)) {
  }
}

// Stores the partner if this collision is the parcel's earliest event.
void set_partner(StepMemory& memory, WorkerState& worker, std::uint32_t i, std::uint32_t partner,
                 std::uint64_t key) {
  if (memory.event_key[i] != key) return;
  memory.event_partner[i] = partner;
  worker.selected.push_back(i);
}

// Every parcel keeps its earliest event. worker.selected holds parcels with an event at an edge or the ball;
// it loses those that collide with a parcel earlier, which set_partner selects again.
void keep_earliest_events(StepContext& step) {
  StepMemory& memory = step.memory;
  const std::vector<std::uint32_t>& id = step.trajectories.id;
  std::size_t num_collisions = 0;
  for (const WorkerState& worker : memory.workers) num_collisions += worker.collisions.size();
  for_each_worker(step, num_collisions, [&](const WorkerState& worker) {
    for (const auto& [tick, first, second] : worker.collisions) {
      lower_to(memory.event_key[first], event_key(tick, id[second]));
      lower_to(memory.event_key[second], event_key(tick, id[first]));
    }
  });
  for_each_worker(step, num_collisions, [&](WorkerState& worker) {
    std::erase_if(worker.selected, [&](std::uint32_t i) {
      return is_parcel(static_cast<std::uint32_t>(memory.event_key[i]));
    });
    for (const auto& [tick, first, second] : worker.collisions) {
      set_partner(memory, worker, first, second, event_key(tick, id[second]));
      set_partner(memory, worker, second, first, event_key(tick, id[first]));
    }
    worker.collisions.clear();
  });
}

// Moves the workers' selected parcels to `all`, in the order of threads.
void collect_selected(std::vector<WorkerState>& workers, std::vector<std::uint32_t>& all) {
  all.clear();
  for (WorkerState& worker : workers) {
    all.insert(all.end(), worker.selected.begin(), worker.selected.end());
    worker.selected.clear();
  }
}

template <Boundary kBoundary>
void list_near_ball(StepContext& step) {
  step.memory.near_ball.clear();
  if (!step.has_participant()) return;
  for_each_item(step, step.num_parcels(), [&](WorkerState& worker, std::size_t k) {
    const auto i = static_cast<std::uint32_t>(k);
    if (!is_retired(step.input.position[i]) && step.is_near_ball<kBoundary>(i)) worker.selected.push_back(i);
  });
  collect_selected(step.memory.workers, step.memory.near_ball);
}

template <Boundary kBoundary>
void predict(StepContext& step) {
  for_each_chunk(step, [&](WorkerState& worker, std::size_t begin, std::size_t end) {
    look_ahead<kBoundary>(step, worker, begin, end);
  });
  if (step.c.run.physics.parcels.contacts) {
    for_each_chunk(step, [&](WorkerState& worker, std::size_t begin, std::size_t end) {
      predict_collisions<kBoundary>(step, worker, static_cast<std::uint32_t>(begin),
                                    static_cast<std::uint32_t>(end));
    });
  }
  keep_earliest_events(step);
  collect_selected(step.memory.workers, step.memory.active);
  list_near_ball<kBoundary>(step);
}

}  // namespace

void predict(StepContext& step) {
  for_boundary(step.c.run.physics.world.boundary, [&]<Boundary kBoundary>() { predict<kBoundary>(step); });
}

}  // namespace pf
