// Method `exact` on the device: lists of the parcels outside a block's cluster that its members may meet in
// the window. Each list is built once.
#pragma once

#include "cuda/exact/solve_block_ball.cuh"

namespace pf::cuda {

// All threads of the block call the functions of this class together, unless noted.
template <Boundary kBoundary>
class BlockLists {
 protected:
  __device__ __forceinline__ BlockLists(const StepContext& step, BlockSpace& space, SliceCounts& counts)
      : step_(step),
        c_(step.c),
        space_(space),
        members_{step, step.memory, counts, space},
        window_begin_(static_cast<std::int32_t>(step.state.window_begin)) {}

  // Lists what is near the members that have no list yet, each by a warp: all of them at once takes no longer
  // than each of them before its first event.
  __device__ __forceinline__ void list_members() {
    if (!c_.run.physics.parcels.contacts) return;
    const unsigned num = min(members_.num(), BlockSpace::kHot);
    for (unsigned place = threadIdx.x / 32; place < num; place += BlockSpace::kWarps) {
      if (space_.num_near[place] == BlockSpace::kNotListed) list_by_warp(place);
    }
  }

  static constexpr std::uint16_t kNoPlace = 0xFFFF;
  static constexpr unsigned kNumChanged = BlockSpace::kNumChanged;
  static constexpr unsigned kTeam = BlockSpace::kTeam, kTeams = BlockSpace::kTeams;
  using Cursor = CandidateCursor<kTeam, 1>;

  // The member that a team predicts.
  struct Subject {
    std::uint32_t place = kNoPlace;  // kNoPlace: none
    std::uint32_t index = 0, id = 0;
    bool is_there = false;     // there is one, and it has not retired
    bool has_changed = false;  // it is on a new trajectory
    bool just_hit = false;     // by the ball
    Trajectory now{};
    std::uint32_t next_generation = 0;
    Vec2i here{};  // position at the step's start
  };

  // A body that a thread compares the subject with. kNoPartner: none.
  struct Body {
    std::uint32_t partner = kNoPartner, id = kNoPartner;  // as in Event
    std::uint32_t next_generation = 0;
    Trajectory trajectory{};
  };

  // Parcels outside that are near a subject: a part of them, or all.
  struct NearParcels {
    std::uint32_t* entries;
    unsigned num;
    bool is_kept;  // in the member's list
  };

  // The search for these.
  struct Search {
    Vec2i here;  // the subject's position at the step's start, and its velocity then
    Vec2f velocity;
    float units;    // position units covered at 1 m/s until the window's start
    float radius2;  // of the circle around its position then
    SearchBox box;
  };

  static __device__ __forceinline__ unsigned team() { return threadIdx.x / kTeam; }
  static __device__ __forceinline__ unsigned rank() { return threadIdx.x % kTeam; }
  static __device__ __forceinline__ void team_barrier() { __barrier_sync_count(1 + team(), kTeam); }

  __device__ __forceinline__ Subject subject_at(std::uint32_t place, bool has_changed) const {
    const Member& member = members_[place];
    return {place,
            member.index,
            member.id,
            !is_retired(member.trajectory.anchor),
            has_changed,
            member.has_changed == kHitBall,
            member.trajectory,
            member.next_generation,
            step_.start_positions()[member.index]};
  }

  // The list that the subject has.
  __device__ __forceinline__ NearParcels kept_list(const Subject& it) const {
    if (!it.is_there) return {nullptr, 0, true};
    if (it.place < BlockSpace::kHot && space_.num_near[it.place] != BlockSpace::kNotListed)
      return {space_.near[it.place], space_.num_near[it.place], true};
    return {space_.piece[team()], 0, false};
  }

  // The search for the parcels that the subject may meet in the window, however fast it becomes: a window in
  // which the bound on speeds is too low counts for nothing. They lie in a circle around its position at the
  // window's start.
  __device__ __forceinline__ Search search_around(const Subject& it, bool is_wanted) const {
    Search search{};
    if (!is_wanted) return search;
    const double closing_mps = 2.0 * c_.plan.max_speed_mps;
    const double before = c_.plan.units_per_tick * window_begin_;
    const double radius = search_radius(c_, closing_mps);
    search.box = box_around<kBoundary>(step_.launch.space, it.here, step_.search_reach(radius));
    search.here = it.here;
    search.velocity = step_.memory.trajectories.velocity[it.index];
    search.units = static_cast<float>(before);
    search.radius2 = static_cast<float>((radius - closing_mps * before) * (radius - closing_mps * before));
    return search;
  }

  // Lists the next parcels of the search: at least one team's worth of candidates, and as many as there are
  // room for.
  __device__ __forceinline__ void list_near(const Subject& it, const Search& search, Cursor& cursor,
                                            NearParcels& near) {
    std::uint32_t& num = space_.num_in_piece[team()];
    if (rank() == 0) num = 0;
    team_barrier();
    near.num = 0;
    while (cursor.has_more() && near.num + kTeam <= BlockSpace::kMaxPiece) {
      std::uint32_t candidate[1];
      cursor.next(candidate);
      if (candidate[0] != kInvalidIndex) {
        const std::uint32_t j = candidate[0], owner = step_.owner_of(j);
        if (is_outside(owner, step_.start_positions()[j], step_.memory.trajectories.velocity[j], search))
          near.entries[atomicAdd(&num, 1U)] = entry_of(j, owner);
      }
      team_barrier();
      near.num = num;
      team_barrier();
    }
  }

  // Lists what is near a member.
  __device__ __forceinline__ void list_by_warp(unsigned place) {
    constexpr unsigned kAhead = 2;
    const Subject it = subject_at(place, false);
    if (!it.is_there) return;
    const Search search = search_around(it, true);
    std::uint32_t(&entries)[BlockSpace::kMaxNear] = space_.near[place];
    const unsigned before = (1U << threadIdx.x % 32) - 1;
    unsigned num = 0;
    for (CandidateCursor<32, kAhead> cursor(step_.launch.space, search.box); cursor.has_more();) {
      Candidates<kAhead> found;
      found.load_next(step_, step_.start_positions(), cursor);
      for (unsigned u = 0; u < kAhead; ++u) {
        const bool is_near = found.index[u] != kInvalidIndex &&
                             is_outside(found.owner[u], found.position[u], found.velocity[u], search);
        const unsigned lanes = __ballot_sync(kWholeWarp, is_near), k = num + __popc(lanes & before);
        if (is_near && k < BlockSpace::kMaxNear) entries[k] = entry_of(found.index[u], found.owner[u]);
        num += __popc(lanes);
      }
    }
    if (threadIdx.x % 32 == 0 && num <= BlockSpace::kMaxNear)
      space_.num_near[place] = static_cast<std::uint16_t>(num);
  }

  // Returns whether a parcel belongs to no member and lies in the circle of a search. there: its position at
  // the step's start. What it moves is rounded by less than kRoundingMargin, which the circle has in
  // addition.
  __device__ __forceinline__ bool is_outside(std::uint32_t owner, Vec2i there, Vec2f velocity,
                                             const Search& search) const {
    if (owner == members_.cluster || is_retired(there)) return false;
    const Vec2i offset = separation<kBoundary>(step_.world(), search.here, there);
    Vec2f now{static_cast<float>(offset.x) + (velocity.x - search.velocity.x) * search.units,
              static_cast<float>(offset.y) + (velocity.y - search.velocity.y) * search.units};
    if constexpr (kBoundary == Boundary::periodic) {
      const auto width = 2.0F * static_cast<float>(step_.world().half.x);
      const auto height = 2.0F * static_cast<float>(step_.world().half.y);
      now = {fminf(fabsf(now.x), width - fabsf(now.x)), fminf(fabsf(now.y), height - fabsf(now.y))};
    }
    return dot(now, now) < search.radius2;
  }

  static __device__ __forceinline__ std::uint32_t entry_of(std::uint32_t j, std::uint32_t owner) {
    return j | (owner != kInvalidIndex ? kForeign : 0U);
  }

  // Makes the parcels found the member's list.
  __device__ __forceinline__ void keep_list(const Subject& it, const NearParcels& near) {
    if (it.place >= BlockSpace::kHot || near.num > BlockSpace::kMaxNear) return;
    if (rank() < near.num) space_.near[it.place][rank()] = near.entries[rank()];
    if (rank() == 0) space_.num_near[it.place] = static_cast<std::uint16_t>(near.num);
  }

  const StepContext& step_;
  const ExactConstants& c_;
  BlockSpace& space_;
  BlockMembers members_;

 private:
  std::int32_t window_begin_;
};

}  // namespace pf::cuda
