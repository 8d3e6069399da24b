// Method `exact` on the device: the members of a cluster that a block solves, if they are at most 32, and
// predictions of their events. Each warp keeps all members, each in the registers of one lane. What the
// predictions are to compare with is loaded before an event is applied.
#pragma once

#include "cuda/exact/solve_block_predict.cuh"

namespace pf::cuda {

// All threads of the block call the functions of this class together.
template <Boundary kBoundary, bool kHasBall>
class BlockFewPredictions : protected BlockPredictions<kBoundary, kHasBall> {
 protected:
  static constexpr unsigned kMaxMembers = 32;

  __device__ __forceinline__ BlockFewPredictions(const StepContext& step, BlockSpace& space,
                                                 SliceCounts& counts)
      : Base(step, space, counts) {}

  using Base = BlockPredictions<kBoundary, kHasBall>;
  using Base::ball_, Base::c_, Base::kNoPlace, Base::members_, Base::space_, Base::step_;
  using Base::kNumChanged, Base::kTeam, Base::kTeams, Base::rank, Base::team;
  using typename Base::Body, typename Base::Cursor, typename Base::NearParcels, typename Base::Subject;

  static constexpr unsigned kNoLane = 32;

  // The members that an event changes. kNoLane: none.
  struct Turn {
    unsigned own = kNoLane, other = kNoLane;  // lanes of the members that take part
    unsigned stale = 0;                       // lanes of members whose own event it undoes, as bits

    // The members to predict have numbers: those that take part, then the others.
    __device__ __forceinline__ unsigned num() const { return kNumChanged + __popc(stale); }
    __device__ __forceinline__ unsigned lane_of(unsigned number) const {
      if (number < kNumChanged) return number == 0 ? own : other;
      unsigned left = stale;
      for (unsigned k = kNumChanged; k < number; ++k) left &= left - 1;
      return left != 0 ? __ffs(left) - 1 : kNoLane;
    }
    __device__ __forceinline__ unsigned number_of(unsigned lane) const {
      if (lane == own) return 0;
      if (lane == other) return 1;
      return (stale >> lane & 1U) != 0 ? kNumChanged + __popc(stale & ((1U << lane) - 1)) : kInvalidIndex;
    }
    // If there are few of them, two teams predict a member: one of them looks for the ball and the edge.
    __device__ __forceinline__ bool has_helpers() const { return num() <= kTeams / 2; }
  };

  // The task of a team.
  struct Task {
    unsigned number = 0, lane = kNoLane;  // of the member that it predicts
    bool with_parcels = false, with_rest = false;
    NearParcels near{};
    Body body{};  // a parcel outside, for a thread of the second warp
  };

  static __device__ __forceinline__ unsigned lane() { return threadIdx.x % 32; }
  static __device__ __forceinline__ unsigned warp() { return threadIdx.x / 32; }
  // The first warp, which keeps the tally and writes segments, belongs to the last team.
  static __device__ __forceinline__ unsigned number_of_team() { return kTeams - 1 - team(); }
  static __device__ __forceinline__ unsigned first_warp_of(unsigned number) {
    return (kTeams - 1 - number) * (kTeam / 32);
  }
  template <class T>
  static __device__ __forceinline__ T of_lane(T value, unsigned from) {
    return __shfl_sync(kWholeWarp, value, from);
  }
  static __device__ __forceinline__ Trajectory of_lane(const Trajectory& trajectory, unsigned from) {
    return cuda::of_lane(trajectory, from);
  }
  static __device__ __forceinline__ Event of_lane(const Event& event, unsigned from) {
    return {of_lane(event.tick, from), of_lane(event.partner, from), of_lane(event.partner_id, from),
            of_lane(event.generation, from)};
  }
  __device__ __forceinline__ bool is_member() const { return lane() < num_; }

  // ---- members

  __device__ __forceinline__ void take_members() {
    num_ = members_.num();
    it_ = {};
    if (is_member()) take_member(lane());
    if (members_.leads()) space_.results[0].is_crowded = space_.results[1].is_crowded = 0;
    __syncthreads();
  }

  __device__ __forceinline__ void take_member(unsigned place) {
    it_ = space_.hot[place];
    here_ = step_.start_positions()[it_.index];
  }

  __device__ __forceinline__ void flag(const Turn& turn) {
    if (!members_.leads()) return;
    const auto place_of = [](unsigned from) {
      return from == kNoLane ? kNoPlace : static_cast<std::uint16_t>(from);
    };
    for (unsigned k = 0; k < turn.num(); ++k) space_.flagged[k] = place_of(turn.lane_of(k));
    space_.num_flagged = turn.num();
  }

  // ---- predictions

  // Finds what is near the member that a team predicts, and loads it. base: number of the first team's.
  __device__ __forceinline__ Task prepare(const Turn& turn, unsigned base) {
    Task task;
    const unsigned number = number_of_team();
    const bool helps = turn.has_helpers() && number >= kTeams / 2;
    task.number = helps ? number - kTeams / 2 : base + number;
    task.lane = turn.lane_of(task.number);
    task.with_parcels = !helps && task.lane != kNoLane && c_.run.physics.parcels.contacts;
    task.with_rest = (helps || !turn.has_helpers()) && task.lane != kNoLane;
    if (!task.with_parcels) return task;
    Subject it;
    it.place = task.lane;
    it.index = of_lane(it_.index, task.lane);
    it.has_changed = task.number < kNumChanged;
    if (space_.num_near[it.place] == BlockSpace::kNotListed) {
      it.here = {of_lane(here_.x, task.lane), of_lane(here_.y, task.lane)};
      list_near_subject(it);
    }
    if (space_.num_near[it.place] != BlockSpace::kNotListed)
      task.near = {space_.near[it.place], space_.num_near[it.place], true};
    if (rank() >= 32) task.body = load_outside(it, task.near, lane());
    return task;
  }

  // The k-th parcel of a list. Loads begin here, and nothing waits for them.
  __device__ __forceinline__ Body load_outside(const Subject& it, const NearParcels& near, unsigned k) const {
    const std::uint32_t entry = k < near.num ? near.entries[k] : kInvalidIndex;
    const std::uint32_t j = entry != kInvalidIndex ? entry & kIndexBits : it.index;
    Body body{kNoPartner, step_.id(j), 0, step_.start_trajectory(j)};
    if (entry == kInvalidIndex) return body;
    body.partner = j;
    if ((entry & kForeign) != 0 && (entry & kNoted) == 0 && it.has_changed) {
      add_neighbour_pair(step_, members_.counts, it.index, j);
      near.entries[k] = entry | kNoted;
    }
    return body;
  }

  __device__ __forceinline__ void list_near_subject(const Subject& it) {
    NearParcels near{space_.piece[team()], 0, false};
    const auto search = this->search_around(it, true);
    Cursor cursor(step_.launch.space, search.box);
    this->list_near(it, search, cursor, near);
    if (!cursor.has_more()) this->keep_list(it, near);
    Base::team_barrier();
    if (space_.num_near[it.place] == BlockSpace::kNotListed) space_.results[parity_].is_crowded = 1;
  }

  // Predicts the members that the event changes or leaves without an event. Returns false, with nothing done
  // that cannot be done again, if a list has no room.
  __device__ __forceinline__ bool predict(const Turn& turn, Task& task) {
    for (unsigned base = 0;;) {
      find_first(turn, task, base);
      __syncthreads();
      if (space_.results[parity_].is_crowded != 0) return false;
      learn(turn, base);
      parity_ ^= 1U;
      base += kTeams;
      if (base >= turn.num()) return true;
      task = prepare(turn, base);
    }
  }

  __device__ __forceinline__ Subject subject_of(const Task& task) const {
    if (task.lane == kNoLane) return {};
    Subject it;
    it.place = task.lane;
    it.index = of_lane(it_.index, task.lane);
    it.id = of_lane(it_.id, task.lane);
    it.now = of_lane(it_.trajectory, task.lane);
    it.is_there = !is_retired(it.now.anchor);
    it.has_changed = task.number < kNumChanged;
    it.just_hit = of_lane(it_.has_changed, task.lane) == kHitBall;
    it.next_generation = of_lane(it_.next_generation, task.lane);
    it.here = {of_lane(here_.x, task.lane), of_lane(here_.y, task.lane)};
    return it;
  }

  // Each warp finds the first event of its team's member with its share of bodies.
  __device__ __forceinline__ void find_first(const Turn& turn, const Task& task, unsigned base) {
    WarpResults& results = space_.results[parity_];
    const Subject it = subject_of(task);
    Event best, at_ball;
    if (task.with_parcels) best = compare_with_parcels(task, it, results);
    if (task.with_rest && rank() >= 32) keep_rest(it, best);
    if constexpr (kHasBall) {
      if (base == 0 && warp() < kBallWarps) at_ball = Base::first_in_warp(first_ball_hit());
    }
    best = Base::first_in_warp(best);
    if (lane() != 0) return;
    results.best[warp()] = best;
    results.at_ball[warp()] = at_ball;
  }

  // The subject's hit on the ball's path, and the edge. The second warp of a team calls it: each lane looks
  // at a segment. The first segment with a hit has the earliest. See hit_on_path for knows_hit.
  __device__ __forceinline__ void keep_rest(const Subject& it, Event& best) const {
    if (!it.is_there) return;
    const ParcelNearBall parcel{it.now, it.id, it.next_generation, it.just_hit};
    if (lane() == 0) keep_edge<kBoundary>(step_, it.here, parcel, best);
    if (kHasBall || c_.plan.ball == BallRole::absent || !step_.template is_near_ball<kBoundary>(it.here))
      return;
    const BallPath path = assumed_path(step_);
    bool knows_hit = !it.just_hit || !step_.has_participant();
    Event at_ball;
    for (unsigned s = lane(); s < path.num; s += 32) {
      keep_hit(hit_on_segment<kBoundary>(step_, path, s, parcel), at_ball);
      if (s > 0 && begins_with_hit_of(step_, path.segments[s], parcel)) knows_hit = true;
    }
    if (__any_sync(kWholeWarp, knows_hit)) keep_earlier(best, at_ball);
  }

  // The first warp of a team compares with members, the second one with parcels outside.
  __device__ __forceinline__ Event compare_with_parcels(const Task& task, const Subject& it,
                                                        WarpResults& results) {
    Body body = task.body;
    if (rank() < 32 && is_member() && lane() != it.place)
      body = {it_.index, it_.id, it_.next_generation, it_.trajectory};
    Event best = this->compare(it, body);
    if (rank() < 32) {
      if (task.number < kNumChanged)
        results.told[task.number][lane()] =
            best.tick == kNoTick ? Event{} : Event{best.tick, it.index, it.id, best.generation};
      return best;
    }
    for (unsigned k = 32 + lane(); k < task.near.num; k += 32)
      keep_earlier(best, this->compare(it, load_outside(it, task.near, k)));
    return best;
  }

  // This thread's part of the search for the ball's next hit. The first warp compares it with members.
  __device__ __forceinline__ Event first_ball_hit() const {
    Event best;
    if (warp() == 0) {
      if (is_member()) ball_.keep_hit_by({it_.index, it_.id, it_.next_generation, it_.trajectory}, best);
      return best;
    }
    const bool is_listed = ball_.is_listed();
    const std::uint32_t num = ball_.num_outside(is_listed);
    for (std::uint32_t k = threadIdx.x - 32; k < num; k += 32 * (kBallWarps - 1))
      ball_.keep_hit_by(ball_.outside(k, is_listed, members_.cluster), best);
    return best;
  }

  // All warps take the events that were found.
  __device__ __forceinline__ void learn(const Turn& turn, unsigned base) {
    const WarpResults& results = space_.results[parity_];
    const unsigned number = turn.number_of(lane());
    const bool is_predicted = number >= base && number - base < kTeams;
    const bool is_told = !is_predicted && base == 0 && c_.run.physics.parcels.contacts;
    const unsigned w = is_predicted ? first_warp_of(number - base) : 0U;
    const unsigned helper = turn.has_helpers() && is_predicted ? first_warp_of(number + kTeams / 2) + 1 : w;
    const Event one = is_predicted ? results.best[w] : results.told[0][lane()];
    const Event two = is_predicted ? results.best[w + 1] : results.told[1][lane()];
    const Event three = results.best[helper];
    Event& event = it_.event;
    if (is_predicted) event = three;
    event = earlier_of(event, one, is_predicted || (is_told && turn.own != kNoLane));
    event = earlier_of(event, two, is_predicted || (is_told && turn.other != kNoLane));
    if constexpr (kHasBall) {
      if (base != 0) return;
      Event hit;
      for (unsigned k = 0; k < kBallWarps; ++k) keep_earlier(hit, results.at_ball[k]);
      ball_event_ = next_ball_event<kBoundary>(c_, space_.ball.now, hit);
    }
  }

  // The earlier one of two events; the other one counts if it is real. No branch, which takes longer.
  static __device__ __forceinline__ Event earlier_of(const Event& event, const Event& other, bool is_real) {
    const bool takes = is_real && other.tick != kNoTick && comes_before(other, event);
    return {takes ? other.tick : event.tick, takes ? other.partner : event.partner,
            takes ? other.partner_id : event.partner_id, takes ? other.generation : event.generation};
  }

  static constexpr unsigned kBallWarps = 4;  // that look for the ball's next hit, from the first one on

  unsigned num_ = 0;     // members
  Member it_;            // of this lane; its latest segment only in the first warp
  Vec2i here_{};         // its position at the step's start
  Event ball_event_;     // the next one; its partner is a parcel or a wall
  unsigned parity_ = 0;  // of predictions: a warp may write the next results while another reads these
};

}  // namespace pf::cuda
