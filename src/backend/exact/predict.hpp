// Method `exact` on the CPU: the first phase of a step, in which every parcel predicts its earliest event
// along the lines of the begin. Part of exact_stepper.cpp.
#pragma once

#include <algorithm>
#include <atomic>

#include "backend/exact/stepper.hpp"
#include "backend/exact/positions_at.hpp"

namespace pf {

template <Boundary kBoundary>
struct ExactStepper::Prediction {
  ExactStepper& self;
  const StepInput& problem;
  const ExactConstants& c;
  ParcelArrays& trajectories;
  ExactBall& ball;
  Vec2i* end_position;
  ExactStep<kBoundary> step;
  float units_in_step = static_cast<float>(c.plan.units_per_tick * c.plan.length);  // that a speed of 1 m/s covers
  float contact = static_cast<float>(c.run.contact_distance);

  Prediction(ExactStepper& stepper, const StepInput& p, ParcelArrays& parcels, ExactBall& the_ball,
             Vec2i* end, bool recording)
      : self(stepper),
        problem(p),
        c(p.constants),
        trajectories(parcels),
        ball(the_ball),
        end_position(end),
        step{p,
             p.constants,
             parcels,
             the_ball,
             recording,
             stepper.event_key_,
             stepper.event_partner_,
             stepper.owner_,
             stepper.member_slot_,
             stepper.ball_owner_,
             stepper.near_ball_,
             stepper.seeds_,
             stepper.ball_member_} {
    set_space();
    if (c.plan.ball == BallRole::absent) return;
    const double moved = c.plan.max_speed_mps * c.plan.units_per_tick * c.plan.length;
    const Vec2d centre = ball.trajectory.anchor_units + displacement_units(c, ball.trajectory.velocity_mps, -ball.trajectory.tick);
    step.ball_centre = {saturated_units(centre.x), saturated_units(centre.y)};
    step.ball_reach = saturated_reach(c.run.ball_contact + 2.0 * moved + kRoundingMargin);
  }

  void set_space() {
    DiscSpace& space = step.space;
    space.x = self.discs_.x.data();
    space.y = self.discs_.y.data();
    space.radius = self.discs_.radius.data();
    space.owner = self.owner_.data();
    space.cell_start = problem.cell_start;
    space.grid = problem.grid;
    space.num_parcels = static_cast<std::uint32_t>(step.size());
    space.all_pairs = problem.all_pairs;
    set_reaches(c, problem.fastest_mps, problem.max_displacement, space);
  }

  // Fewer items than this are worked through by the calling thread: waking the others costs more.
  static constexpr std::size_t kAlone = 256;

  // visit(worker, item) for the items 0 .. count - 1, shared among the threads if there are many.
  template <class Visit>
  void each(std::size_t count, Visit visit) {
    if (count < kAlone) {
      for (std::size_t k = 0; k < count; ++k) visit(self.workers_[0], k);
      return;
    }
    self.team_.run([&](unsigned thread) {
      const auto [begin, end] = self.team_.share(thread, count);
      for (std::size_t k = begin; k < end; ++k) visit(self.workers_[thread], k);
    });
  }

  // visit(worker, begin, end) for parcels begin .. end - 1, until all had their turn; few enough at a time to
  // stay near at hand.
  template <class Visit>
  void each_chunk(Visit visit) {
    constexpr std::size_t kAtATime = 256;
    const auto visit_all = [&](WorkerState& worker, std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; k += kAtATime) visit(worker, k, std::min(k + kAtATime, end));
    };
    if (step.size() < kAlone) return visit_all(self.workers_[0], 0, step.size());
    self.team_.run([&](unsigned thread) {
      const auto [begin, end] = self.team_.share(thread, step.size());
      visit_all(self.workers_[thread], begin, end);
    });
  }

  // visit(worker) for each of them, by their threads if there is much to do.
  template <class Visit>
  void each_worker(std::size_t how_much, Visit visit) {
    if (how_much < kAlone) {
      for (WorkerState& worker : self.workers_) visit(worker);
    } else {
      self.team_.run([&](unsigned thread) { visit(self.workers_[thread]); });
    }
  }

  // Where parcels begin .. end - 1 will be at the end of the step, their discs, and their events with an edge
  // or a frozen ball.
  void look_ahead(WorkerState& worker, std::size_t begin, std::size_t end) {
    positions_at(c, trajectories.position.data(), trajectories.velocity.data(), trajectories.tick.data(),
                 static_cast<std::int32_t>(c.plan.length), begin, end, end_position);
    const Speeds speeds = set_discs(problem.present, trajectories.velocity.data(), units_in_step, 0.5F * contact,
                                    begin, end, self.discs_);
    worker.tally.moved(0, speeds.largest2);
    if (!speeds.all_finite) report_invalid(worker, begin, end);
    if (kBoundary == Boundary::periodic && c.plan.ball != BallRole::frozen) return;
    for (std::size_t i = begin; i < end; ++i) predict_edge_and_ball(worker, static_cast<std::uint32_t>(i));
  }

  void report_invalid(WorkerState& worker, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!is_retired(trajectories.position[i]) && !is_finite(i)) worker.tally.invalid(trajectories.id[i]);
    }
  }
  bool is_finite(std::size_t i) const { return dot(trajectories.velocity[i], trajectories.velocity[i]) < kMaxFiniteSpeed2; }

  void predict_edge_and_ball(WorkerState& worker, std::uint32_t i) {
    if (is_retired(trajectories.position[i]) || !is_finite(i)) return;
    const bool near_edge = may_reach_edge<kBoundary>(c, problem.present[i]);
    const bool near_ball = c.plan.ball == BallRole::frozen && step.is_near_ball(i);
    if (!near_edge && !near_ball) return;
    const Trajectory here = step.trajectory(i);
    Event best;
    if (near_edge) keep_edge_event<kBoundary>(c, here, best);
    if (near_ball)
      keep_earlier(best, {ball_collision_tick<kBoundary>(c, ball.trajectory, here), kBallPartner, kBallPartner});
    if (best.tick == kNoTick) return;
    self.event_key_[i] = event_key(best.tick, best.partner);
    self.event_partner_[i] = best.partner;
    worker.found.push_back(i);
  }

  // To worker.hits the meetings of parcels begin .. end - 1 with those of higher index.
  void predict_meetings(WorkerState& worker, std::uint32_t begin, std::uint32_t end) {
    step.discs.overlaps(step.space, begin, end, worker.pairs);
    for (const auto [i, j] : worker.pairs.found) {
      const Vec2i offset =
          separation<kBoundary>(c.run.physics.world, problem.present[i], problem.present[j]);
      if (!may_collide(offset, trajectories.velocity[j] - trajectories.velocity[i], contact, units_in_step)) continue;
      const std::uint32_t tick = collision_tick<kBoundary>(c, step.trajectory(i), step.trajectory(j));
      if (tick != kNoTick) worker.hits.push_back({tick, i, j});
    }
  }

  void predict_meetings() {
    if (!c.run.physics.parcels.contacts) return;
    each_chunk([&](WorkerState& worker, std::size_t begin, std::size_t end) {
      predict_meetings(worker, static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end));
    });
  }

  void keep_earliest(std::uint32_t i, std::uint64_t key) {
    std::atomic_ref<std::uint64_t> shared(self.event_key_[i]);
    std::uint64_t seen = shared.load(std::memory_order_relaxed);
    while (key < seen && !shared.compare_exchange_weak(seen, key, std::memory_order_relaxed)) {
    }
  }

  // Tells i of its partner, if what its event is was this hit.
  void set_partner(WorkerState& worker, std::uint32_t i, std::uint32_t partner, std::uint64_t key) {
    if (self.event_key_[i] != key) return;
    self.event_partner_[i] = partner;
    worker.found.push_back(i);
  }

  // Parcels that have an event with an edge or the ball are in worker.found; of those, the ones that meet
  // another parcel earlier go.
  void predict_from_hits() {
    std::size_t num_hits = 0;
    for (const WorkerState& worker : self.workers_) num_hits += worker.hits.size();
    each_worker(num_hits, [&](const WorkerState& worker) {
      for (const WorkerState::Hit& hit : worker.hits) {
        keep_earliest(hit.first, event_key(hit.tick, trajectories.id[hit.second]));
        keep_earliest(hit.second, event_key(hit.tick, trajectories.id[hit.first]));
      }
    });
    each_worker(num_hits, [&](WorkerState& worker) {
      std::erase_if(worker.found, [&](std::uint32_t i) {
        return is_parcel(static_cast<std::uint32_t>(self.event_key_[i]));
      });
      for (const WorkerState::Hit& hit : worker.hits) {
        set_partner(worker, hit.first, hit.second, event_key(hit.tick, trajectories.id[hit.second]));
        set_partner(worker, hit.second, hit.first, event_key(hit.tick, trajectories.id[hit.first]));
      }
      worker.hits.clear();
    });
  }

  void collect_found(std::vector<std::uint32_t>& all) {
    all.clear();
    for (WorkerState& worker : self.workers_) {
      all.insert(all.end(), worker.found.begin(), worker.found.end());
      worker.found.clear();
    }
  }

  void predict_all() {
    each_chunk(
        [&](WorkerState& worker, std::size_t begin, std::size_t end) { look_ahead(worker, begin, end); });
    predict_meetings();
    predict_from_hits();
    collect_found(self.active_);
    self.near_ball_.clear();
    if (!step.has_participant()) return;
    each(step.size(), [&](WorkerState& worker, std::size_t k) {
      const auto i = static_cast<std::uint32_t>(k);
      if (!is_retired(problem.present[i]) && step.is_near_ball(i)) worker.found.push_back(i);
    });
    collect_found(self.near_ball_);
  }
};

}  // namespace pf
