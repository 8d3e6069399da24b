// Method `exact` on the CPU: the first phase of a step, in which every parcel predicts its earliest event
// along the lines of the begin. Part of exact_stepper.cpp.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>

#include "backend/exact_stepper.hpp"

namespace pf {

template <Boundary kBoundary>
struct ExactStepper::Prediction {
  ExactStepper& self;
  const ExactProblem& problem;
  const ExactConstants& c;
  ParcelArrays& lines;
  ExactBall& ball;
  Vec2i* at_end;
  ExactStep<kBoundary> step;

  Prediction(ExactStepper& stepper, const ExactProblem& p, ParcelArrays& parcels, ExactBall& the_ball,
             Vec2i* end, bool recording)
      : self(stepper),
        problem(p),
        c(p.constants),
        lines(parcels),
        ball(the_ball),
        at_end(end),
        step{p,
             p.constants,
             parcels,
             the_ball,
             recording,
             stepper.event_key_,
             stepper.event_partner_,
             stepper.owner_,
             stepper.place_,
             stepper.ball_owner_,
             stepper.near_ball_,
             stepper.seeds_,
             stepper.ball_member_} {
    if (c.ball == BallRole::absent) return;
    const double moved = c.max_speed_mps * c.units_per_tick * c.length;
    const Vec2d centre = ball.line.anchor_units + travelled(c, ball.line.velocity_mps, -ball.line.tick);
    step.ball_centre = {saturated_units(centre.x), saturated_units(centre.y)};
    step.ball_reach = step.saturated(c.ball_contact + 2.0 * moved + kRoundingMargin);
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

  // visit(worker) for each of them, by their threads if there is much to do.
  template <class Visit>
  void each_worker(std::size_t how_much, Visit visit) {
    if (how_much < kAlone) {
      for (ExactWorker& worker : self.workers_) visit(worker);
    } else {
      self.team_.run([&](unsigned thread) { visit(self.workers_[thread]); });
    }
  }

  // The events of i with an edge and a frozen ball; those with parcels of higher index go to worker.hits.
  void predict(ExactWorker& worker, std::uint32_t i) {
    const Line here = step.line(i);
    at_end[i] = position_at<kBoundary>(c, here, static_cast<std::int32_t>(c.length));
    self.event_key_[i] = kNoEvent;
    if (is_retired(here.anchor)) return;
    const float speed2 = dot(here.velocity, here.velocity);
    if (!(speed2 < 1e30F)) {
      worker.tally.invalid(lines.id[i]);
      at_end[i] = here.anchor;
      return;
    }
    worker.tally.moved(0, speed2);
    step.search_meeting(worker, i, std::sqrt(static_cast<double>(speed2)) * (1.0 + 1e-6));
    for (const std::uint32_t j : worker.scratch.finds) {
      if (is_retired(lines.position[j])) continue;
      const std::uint32_t tick = meeting<kBoundary>(c, here, step.line(j));
      if (tick != kNoTick) worker.hits.push_back({tick, i, j});
    }
    Event best;
    if (may_reach_edge<kBoundary>(c, problem.space.position[i])) keep_edge_event<kBoundary>(c, here, best);
    if (c.ball == BallRole::frozen && step.is_near_ball(i))
      keep_earlier(best, {meeting_ball<kBoundary>(c, ball.line, here), kBallPartner, kBallPartner});
    if (best.tick == kNoTick) return;
    self.event_key_[i] = event_key(best.tick, best.partner);
    self.event_partner_[i] = best.partner;
    worker.found.push_back(i);
  }

  void keep_earliest(std::uint32_t i, std::uint64_t key) {
    std::atomic_ref<std::uint64_t> shared(self.event_key_[i]);
    std::uint64_t seen = shared.load(std::memory_order_relaxed);
    while (key < seen && !shared.compare_exchange_weak(seen, key, std::memory_order_relaxed)) {
    }
  }

  // Tells i of its partner, if what its event is was this hit.
  void set_partner(ExactWorker& worker, std::uint32_t i, std::uint32_t partner, std::uint64_t key) {
    if (self.event_key_[i] != key) return;
    self.event_partner_[i] = partner;
    worker.found.push_back(i);
  }

  // Parcels that have an event with an edge or the ball are in worker.found; of those, the ones that meet
  // another parcel earlier go.
  void predict_from_hits() {
    std::size_t num_hits = 0;
    for (const ExactWorker& worker : self.workers_) num_hits += worker.hits.size();
    each_worker(num_hits, [&](const ExactWorker& worker) {
      for (const ExactWorker::Hit& hit : worker.hits) {
        keep_earliest(hit.first, event_key(hit.tick, lines.id[hit.second]));
        keep_earliest(hit.second, event_key(hit.tick, lines.id[hit.first]));
      }
    });
    each_worker(num_hits, [&](ExactWorker& worker) {
      std::erase_if(worker.found, [&](std::uint32_t i) {
        return static_cast<std::uint32_t>(self.event_key_[i]) != self.event_partner_[i];
      });
      for (const ExactWorker::Hit& hit : worker.hits) {
        set_partner(worker, hit.first, hit.second, event_key(hit.tick, lines.id[hit.second]));
        set_partner(worker, hit.second, hit.first, event_key(hit.tick, lines.id[hit.first]));
      }
      worker.hits.clear();
    });
  }

  void collect_found(std::vector<std::uint32_t>& all) {
    all.clear();
    for (ExactWorker& worker : self.workers_) {
      all.insert(all.end(), worker.found.begin(), worker.found.end());
      worker.found.clear();
    }
  }

  void predict_all() {
    each(step.size(),
         [&](ExactWorker& worker, std::size_t i) { predict(worker, static_cast<std::uint32_t>(i)); });
    predict_from_hits();
    collect_found(self.active_);
    self.near_ball_.clear();
    if (!step.has_participant()) return;
    each(step.size(), [&](ExactWorker& worker, std::size_t k) {
      const auto i = static_cast<std::uint32_t>(k);
      if (!is_retired(problem.space.position[i]) && step.is_near_ball(i)) worker.found.push_back(i);
    });
    collect_found(self.near_ball_);
  }
};

}  // namespace pf
