// Method `exact` on the device: a block solves a cluster that is too large for a warp, as the CPU's
// ClusterSolver does with one thread.
#pragma once

#include "cuda/exact/solve_block_members.cuh"

namespace pf::cuda {

// All threads of the block go through the cluster together; the first one writes.
template <Boundary kBoundary>
class BlockSolver {
 public:
  __device__ __forceinline__ BlockSolver(const StepContext& step, BlockSpace& space, BlockCounts& counts)
      : step_(step),
        memory_(step.memory),
        c_(step.c),
        state_(step.state),
        space_(space),
        members_{step, step.memory, counts, space},
        positions_(step.start_positions()) {}

  // Solves the cluster. list: slot of its first member. All threads call it with the same arguments.
  __device__ __forceinline__ void solve(std::uint32_t cluster, std::uint32_t list) {
    members_.start(cluster);
    const bool fits = members_.template load<kBoundary>(list);
    const bool solved = fits && process_events();
    __syncthreads();
    if (members_.leads()) members_.finish(list, fits, solved);
    __syncthreads();
  }

 private:
  // ---- events

  // The earliest event; its place is the slot of a member that has it.
  __device__ __forceinline__ OrderedEvent next_event() {
    OrderedEvent best;
    for (std::uint32_t k = threadIdx.x; k < members_.num(); k += kExactBlock) {
      const std::uint32_t slot = space_.table[k];
      const std::uint32_t id = members_[slot].id;
      const Event event = members_[slot].event;
      if (event.tick == kNoTick) continue;
      const OrderedEvent own{event.tick, event.generation, min(id, event.partner_id),
                             max(id, event.partner_id), slot};
      if (comes_before(own, best)) best = own;
    }
    best = members_.first_of_block(best);
    __syncthreads();
    return best;
  }

  // Applies events in their order up to the step's end. Returns false if another cluster owns a partner.
  // Everything is inlined once into this loop, so that the kernel's argument stays in the constant bank.
  __device__ __forceinline__ bool process_events() {
    while (true) {
      const OrderedEvent next = next_event();
      if (next.tick == kNoTick) return true;
      if (members_.tally.num_events == state_.max_events) {
        if (members_.leads()) stop_at(step_, next.tick);
        return true;
      }
      const Event event = members_[next.place].event;
      std::uint32_t other = kInvalidIndex;
      if (is_parcel(event.partner)) {
        other = members_.template join<kBoundary>(event.partner);
        if (other == kInvalidIndex) return false;
      }
      __syncthreads();
      if (members_.leads()) apply_event(event, next.place, other);
      record(next);
      __syncthreads();
      predict_flagged(next.place, other);
      __syncthreads();
    }
  }

  // Called by the first thread. Applies the event of member `own`, and flags the members that it changes.
  __device__ __forceinline__ void apply_event(const Event& event, std::uint32_t own, std::uint32_t other) {
    if (other != kInvalidIndex) {
      apply_pair_event(own, other, event);
    } else if (event.partner == kBallPartner) {
      apply_ball_hit(own, event);
    } else {
      apply_edge_event(own, event);
    }
    space_.num_flagged = 0;
    space_.flagged[space_.num_flagged++] = own;
    if (other != kInvalidIndex) space_.flagged[space_.num_flagged++] = other;
  }

  // Called by all threads, so that num_events is equal in all.
  __device__ __forceinline__ void record(const OrderedEvent& event) {
    members_.tally.event_hash += event_hash(step_.since_reset(event.tick), event.low_id, event.high_id);
    ++members_.tally.num_events;
  }

  __device__ __forceinline__ void set_member_trajectory(const Trajectory& now, const Event& event,
                                                        Member& member) {
    set_trajectory(step_, members_.counts, now, event, member, members_.tally);
  }

  __device__ __forceinline__ void apply_pair_event(std::uint32_t m, std::uint32_t n, const Event& event) {
    const std::uint32_t tick = event.tick;
    const bool in_order = members_[m].id < members_[n].id;
    Member &one = members_[in_order ? m : n], &two = members_[in_order ? n : m];
    Trajectory first = one.trajectory, second = two.trajectory;
    anchor_at<kBoundary>(c_, first, tick);
    anchor_at<kBoundary>(c_, second, tick);
    const bool elastic = is_in_contact(c_.plan, tick, one.last_contact_tick) ||
                         is_in_contact(c_.plan, tick, two.last_contact_tick);
    collide<kBoundary>(c_, first, second, elastic, members_.tally);
    set_member_trajectory(first, event, one);
    set_member_trajectory(second, event, two);
    one.last_contact_tick = two.last_contact_tick = c_.plan.start + tick;
  }

  __device__ __forceinline__ void apply_edge_event(std::uint32_t m, const Event& event) {
    Member& member = members_[m];
    Trajectory now = member.trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    apply_edge(c_, event.partner, now);
    if (event.partner == kExit) members_.tally.retired();
    set_member_trajectory(now, event, member);
    member.last_contact_tick = c_.plan.start + event.tick;
  }

  __device__ __forceinline__ void apply_ball_hit(std::uint32_t m, const Event& event) {
    Member& member = members_[m];
    Trajectory now = member.trajectory;
    anchor_at<kBoundary>(c_, now, event.tick);
    hit_ball<kBoundary>(step_, member,
                        {event.tick, member.id, members_.cluster, members_.counts.round * kMaxAttemptsInRound,
                         member.trajectory, member.next_generation},
                        now, members_.tally);
    set_member_trajectory(now, event, member);
    member.has_changed = kHitBall;
  }

  // ---- predictions

  // A member whose event is predicted, loaded once: stores to memory would make the compiler load it again.
  struct Subject {
    std::uint32_t slot, index, id;
    Trajectory now;
    std::uint32_t next_generation;
    float fastest_mps;
    bool is_gone, has_changed;
    std::uint32_t partner;  // slot of the member that changed as well, and is predicted on its own
  };

  // Calls visit(j, owner) for the parcels outside the cluster that member `it` may collide with: free ones on
  // their start trajectories, those of other clusters on any.
  template <class Visit>
  __device__ __forceinline__ void search_others(const Subject& it, Visit visit) {
    if (!c_.run.physics.parcels.contacts) return;
    constexpr float kAll = 3.4e38F;  // no filter inside the search: owner and velocity are loaded before it
    const std::uint32_t i = it.index;
    const auto near = MemberSearch::around<kBoundary>(step_, positions_[i], it.now, it.fastest_mps);
    const DeviceSearch& space = step_.launch.space;
    search<kBoundary, false, kExactBlock>(
        space, positions_, {near.position, kInvalidIndex, near.reach, kAll}, [&](std::uint32_t j) {
          const std::uint32_t owner = step_.owner_of(j);
          const Vec2i there = positions_[j];
          const Vec2f velocity = memory_.trajectories.velocity[j];
          if (!near.template holds<kBoundary>(space.world, there) || owner == members_.cluster || j == i)
            return;
          if (owner == kInvalidIndex && !near.template may_hit<kBoundary>(step_, there, velocity)) return;
          visit(j, owner);
        });
  }

  // Predicts the flagged members. Those that the event changed come first: `own` and `other`, unless that is
  // kInvalidIndex. More are flagged on the way.
  __device__ __forceinline__ void predict_flagged(std::uint32_t own, std::uint32_t other) {
    const std::uint32_t num_changed = other != kInvalidIndex ? 2U : 1U;
    for (std::uint32_t k = 0; k < space_.num_flagged; ++k)
      predict(space_.flagged[k], k < num_changed, k == 0 ? other : own);
  }

  // Predicts the next event of member m. If it has a new trajectory, the other members learn of earlier
  // events with it; those whose partner left the trajectory of their event are flagged. partner: slot of the
  // member that changed as well, and is predicted on its own.
  __device__ __forceinline__ void predict(std::uint32_t m, bool has_changed, std::uint32_t partner) {
    const Member& member = members_[m];
    const Subject it{m,
                     member.index,
                     member.id,
                     member.trajectory,
                     member.next_generation,
                     member.fastest_mps,
                     is_retired(member.trajectory.anchor),
                     has_changed,
                     partner};
    Event best;
    search_others(it, [&](std::uint32_t j, std::uint32_t owner) {
      const Trajectory there = step_.start_trajectory(j);
      if (it.is_gone || is_retired(there.anchor)) return;
      if (owner != kInvalidIndex && has_changed) add_neighbour_pair(step_, members_.counts, it.index, j);
      const std::uint32_t tick = collision_tick<kBoundary>(c_, it.now, there);
      step_.keep_collision(tick, j, best, generation_of(step_, tick, it.now, it.next_generation));
    });
    if (c_.run.physics.parcels.contacts) predict_with_members(it, best);
    best = members_.earliest(best);
    if (members_.leads()) {
      if (!it.is_gone)
        keep_edge_and_ball<kBoundary>(step_, positions_[it.index], near_ball(members_[m]), best);
      members_[m].event = best;
    }
    __syncthreads();
  }

  __device__ __forceinline__ void predict_with_members(const Subject& it, Event& best) {
    for (std::uint32_t k = threadIdx.x; k < members_.num(); k += kExactBlock) {
      const std::uint32_t n = space_.table[k];
      Member& other = members_[n];
      if (n == it.slot || is_retired(other.trajectory.anchor)) continue;
      const std::uint32_t tick =
          it.is_gone ? kNoTick : collision_tick<kBoundary>(c_, it.now, other.trajectory);
      const std::uint32_t generation =
          max(generation_of(step_, tick, it.now, it.next_generation),
              generation_of(step_, tick, other.trajectory, other.next_generation));
      if (tick != kNoTick) keep_earlier(best, {tick, other.index, other.id, generation});
      if (!it.has_changed || n == it.partner) continue;
      if (other.event.partner == it.index) {
        other.event = {};
        space_.flagged[atomicAdd(&space_.num_flagged, 1U)] = n;
      } else {
        keep_earlier(other.event, {tick, it.index, it.id, generation});
      }
    }
  }

  const StepContext& step_;
  const StepMemory& memory_;
  const ExactConstants& c_;
  ExactState& state_;
  BlockSpace& space_;
  BlockMembers members_;
  const Vec2i* positions_;  // at the step's start
};

}  // namespace pf::cuda
