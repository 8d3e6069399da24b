#include "exact_kernel.cuh"

#include <algorithm>

#include "check.cuh"
#include "exact_solver.cuh"
#include "tally.cuh"

namespace pf {
namespace {

constexpr unsigned kBlock = kExactBlock;
constexpr unsigned kPredictBlocksPerSm = 5;  // ms at 10^7: 0.63; with 4 0.74, with 3 0.93
constexpr std::uint32_t kParcelsPerSegment = 1024;  // fewer blocks for few parcels: the barrier is cheaper

// So many threads solve a cluster together, and so many blocks share a multiprocessor. Where parcels are few, what
// counts is how long one cluster takes; where they are many, how many are solved at a time. Gps at 10^5, 10^6, 10^7 on
// an H200 with 2 threads and 4 blocks: 0.45 1.32 3.99; 4, 4: 0.64 2.07 4.28; 8, 2: 0.74 2.24 3.76; 8, 4: 0.70 2.25 4.02;
// 16, 3: 0.66 2.18 3.67; 32, 2: 0.50 1.51 2.67.
constexpr unsigned kTogether = 8, kBlocksPerSm = 2;
constexpr unsigned kTogetherIfMany = 4, kBlocksPerSmIfMany = 4;
constexpr std::uint32_t kMany = 4000000;

// With at most so many conflicts left, one block solves the rest alone: its barrier costs a tenth.
constexpr std::uint32_t kAlone = 64;

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

__device__ bool reaches_end(const ExactState& state, std::uint64_t until) {
  return state.progress.now + state.plan.length == until;
}

// Where the parcel will be at the end of the step if nothing happens to it any more.
template <Boundary kBoundary>
__device__ void write_end(const ExactConstants& c, const ExactLaunch& launch, const ExactState& state,
                          std::uint32_t i, const Line& line) {
  const Vec2i end = position_at<kBoundary>(c, line, static_cast<std::int32_t>(c.length));
  launch.arrays.present[state.parity ^ 1U][i] = end;
  if (launch.draw.position_m != nullptr && reaches_end(state, launch.until))
    draw_parcel(launch.draw, c.step.physics.world, i, end, line.velocity);
}

// First prediction of parcel i, on the line that it has at the begin.
template <Boundary kBoundary, bool kReadOnly>
__device__ Event predict_first(const ExactConstants& c, const ExactLaunch& launch, const ExactState& state,
                               std::uint32_t i, DeviceTally& tally) {
  const ExactArrays& a = launch.arrays;
  const Line here = line_of(a, i);
  Event best;
  const float speed2 = dot(here.velocity, here.velocity);
  if (!(speed2 < 1e30F)) {
    tally.invalid(a.lines.id[i]);
    a.present[state.parity ^ 1U][i] = here.anchor;
    return best;
  }
  write_end<kBoundary>(c, launch, state, i, here);
  if (is_retired(here.anchor)) return best;
  tally.moved(0, speed2);
  const Vec2i* present = a.present[state.parity];
  const Vec2i at = present[i];
  if (c.step.physics.parcels.contacts) {
    const double in_step = c.units_per_tick * c.length;
    const double moved = (sqrtf(speed2) * (1.0F + 1e-6F) + state.progress.fastest_mps) * in_step;
    const double distance = c.step.contact_distance + moved + kRoundingMargin;
    const auto contact = static_cast<float>(c.step.contact_distance);
    const auto per_mps = static_cast<float>(in_step);
    FindList finds;
    const auto find = [&](auto found) {
      search<kBoundary, kReadOnly>(launch.space, present, at, i,
                                   saturated(distance + static_cast<double>(state.progress.travel)),
                                   filter_of(distance), found);
    };
    const auto meet = [&](std::uint32_t j) {
      keep_meeting(best, meeting<kBoundary>(c, here, line_of(a, j)), j, a.lines.id);
    };
    const auto may = [&](std::uint32_t j, Vec2i offset) {
      return may_meet(offset, a.lines.velocity[j] - here.velocity, contact, per_mps);
    };
    find([&](std::uint32_t j, Vec2i offset) {
      if (may(j, offset)) finds.push(j);
    });
    if (finds.num > FindList::kMost) {
      find([&](std::uint32_t j, Vec2i offset) {
        if (may(j, offset)) meet(j);
      });
    } else {
      while (finds.num > 0) meet(finds.pop());
    }
  }
  if (may_reach_edge<kBoundary>(c, at)) keep_edge_event<kBoundary>(c, here, best);
  if (c.ball == BallRole::frozen && is_near_ball<kBoundary>(c.step.physics.world, state, at))
    keep_earlier(best, {meeting_ball<kBoundary>(c, state.ball.line, here), kBallPartner, kBallPartner});
  return best;
}

// Adds items to a segment of the list; all threads of the block call it. Items of one call may land in any
// order.
__device__ void append(const SegmentedList& list, std::uint32_t segment, std::uint32_t item, bool wanted,
                       ExactState& state) {
  __shared__ std::uint32_t num, base;
  __syncthreads();
  if (threadIdx.x == 0) num = 0;
  __syncthreads();
  const std::uint32_t place = wanted ? atomicAdd(&num, 1U) : 0U;
  __syncthreads();
  if (threadIdx.x == 0 && num > 0) base = atomicAdd(&list.counts[segment], num);
  __syncthreads();
  if (!wanted) return;
  if (base + place < list.capacity) {
    list.items[static_cast<std::size_t>(segment) * list.capacity + base + place] = item;
  } else {
    state.failed = 1;
  }
}

template <Boundary kBoundary, bool kReadOnly>
__device__ void predict_tile(const ExactConstants& c, const ExactLaunch& launch, std::uint32_t i,
                             std::uint32_t segment, DeviceTally& tally) {
  ExactState& state = *launch.state;
  const ExactArrays& a = launch.arrays;
  bool active = false;
  if (i < launch.space.num_parcels) {
    const Event event = predict_first<kBoundary, kReadOnly>(c, launch, state, i, tally);
    active = event.tick != kNoTick;
    a.event_tick[i] = event.tick;
    a.event_partner[i] = event.partner;
    a.owner[i] = kNone;
    if (active) a.list_head[i] = kNone;
    if (c.ball == BallRole::participant) {
      const Vec2i at = a.present[state.parity][i];
      if (!is_retired(at) && is_near_ball<kBoundary>(c.step.physics.world, state, at)) {
        const std::uint32_t place = atomicAdd(&state.num_near_ball, 1U);
        if (place < a.near_ball.capacity) {
          a.near_ball.items[place] = i;
        } else {
          state.failed = 1;
        }
      }
    }
  }
  append(a.active, segment, i, active, state);
}

template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kPredictBlocksPerSm)
    predict_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ TallySlot block_tally;
  if (threadIdx.x == 0) block_tally = {};
  __syncthreads();
  const ExactConstants& plan = launch.state->plan;
  ExactConstants c = launch.constants;
  c.begin = plan.begin;
  c.length = plan.length;
  c.max_speed_mps = plan.max_speed_mps;
  c.ball = plan.ball;
  DeviceTally tally{&block_tally};
  predict_tile<kBoundary, true>(c, launch, blockIdx.x * kBlock + threadIdx.x,
                                blockIdx.x % launch.arrays.num_segments, tally);
  reduce_warp(tally, block_tally);
  __syncthreads();
  if (threadIdx.x == 0) add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
}

// Plans the step from now on: its length, the bound, the ball, and empty counters. One thread.
__device__ void plan_next(const ExactConstants& constants, std::uint64_t until, ExactState& state) {
  state.plan = constants;
  plan_step(state.progress, until, state.longest, state.plan);
  const ExactConstants& c = state.plan;
  state.ball = ball_in_step(c, state.progress);
  if (c.ball != BallRole::absent) {
    const Vec2d centre =
        state.ball.line.anchor_units +
        travelled(c, state.ball.line.velocity_mps, -static_cast<std::int64_t>(state.ball.line.tick));
    state.ball_centre = {saturated_units(centre.x), saturated_units(centre.y)};
    const double moved = c.max_speed_mps * c.units_per_tick * c.length;
    state.ball_reach = saturated(c.ball_contact + 2.0 * moved + kRoundingMargin);
  }
  state.failed = 0;
  state.too_fast_bits = 0;
  state.fastest_after_bits = 0;
  state.num_near_ball = 0;
  state.num_conflicts = 0;
  state.num_todo = 0;
  state.num_events = 0;
  state.ball_owner = kBallCluster;
  state.ball_has_changed = 0;
}

// What one block's threads know of solving the step's clusters, each by kTeam of them.
template <Boundary kBoundary, unsigned kTeam>
struct Clusters {
  const ExactLaunch& launch;
  const ExactConstants& c;
  ExactState& state;
  TeamSpace& space;
  BlockCounts& counts;
  const ExactArrays& a = launch.arrays;
  cg::grid_group grid = cg::this_grid();
  bool alone = false;  // one block, which does what is left

  __device__ void barrier() {
    if (alone) {
      __syncthreads();
    } else {
      grid.sync();
    }
  }
  __device__ unsigned rank() const { return alone ? threadIdx.x : static_cast<unsigned>(grid.thread_rank()); }
  __device__ unsigned num_threads() const { return alone ? kBlock : static_cast<unsigned>(grid.size()); }
  __device__ unsigned block() const { return alone ? 0U : blockIdx.x; }
  __device__ unsigned num_blocks() const { return alone ? 1U : gridDim.x; }
  template <class T>
  __device__ T* segment(T* items, std::uint32_t capacity) const {
    return items + static_cast<std::size_t>(blockIdx.x) * capacity;
  }
  __device__ static std::uint32_t at_most(std::uint32_t count, std::uint32_t capacity) {
    return count < capacity ? count : capacity;
  }

  // The parcel that the cluster of i is called by. Earliest events lead from parcel to parcel, each to an earlier
  // one, and end with two that are each other's or with a parcel's own.
  __device__ std::uint32_t leader_of(std::uint32_t i) const {
    while (true) {
      const std::uint32_t partner = a.event_partner[i];
      if (!is_parcel(partner)) return i;
      if (a.event_partner[partner] == i) return i < partner ? i : partner;
      i = partner;
    }
  }

  // Makes a member of each of the block's active parcels, and a cluster of those that hang together.
  __device__ void form() {
    const std::uint32_t num = at_most(counts.active, a.active.capacity);
    for (std::uint32_t k = threadIdx.x; k < num; k += kBlock) {
      const std::uint32_t i = segment(a.active.items, a.active.capacity)[k];
      const std::uint32_t place = blockIdx.x * a.member_capacity + k;
      const std::uint32_t leader = leader_of(i);
      a.owner[i] = leader;
      a.place[i] = place;
      a.members[place].index = i;
      a.members[place].next = atomicExch(&a.list_head[leader], place);
      if (leader != i) continue;
      begin_record(a.records[place], i);
      segment(a.leaders.items, a.leaders.capacity)[atomicAdd(&counts.leaders, 1U)] = i;
    }
    if (threadIdx.x == 0) counts.members = num;
    if (grid.thread_rank() == 0 && c.ball == BallRole::participant)
      begin_record(record_of(a, kBallCluster), kBallCluster);
  }
  __device__ static void begin_record(ClusterRecord& record, std::uint32_t name) {
    record = {};
    record.members = record.merged = kNone;
    record.toward = name;
    record.claimed = kNone;
  }

  __device__ bool is_for_block(std::uint32_t cluster) const {
    return record_of(a, cluster).wants_block != 0 || load_shared(&state.ball_owner) == cluster;
  }

  // In the first round the block's own clusters, and the ball's; later those that were merged.
  __device__ void solve(bool is_first) {
    {
      TeamSolver<kBoundary, kBlock> large(launch, c, state, space, counts);
      const bool has_ball = blockIdx.x == 0 && c.ball == BallRole::participant;
      const std::uint32_t num = is_first ? (has_ball ? 1U : 0U) : at_most(load_shared(&state.num_todo), a.todo.capacity);
      for (std::uint32_t k = is_first ? 0U : block(); k < num; k += num_blocks()) {
        const std::uint32_t cluster = is_first ? kBallCluster : a.todo.items[k];
        if (is_first || is_for_block(cluster))
          large.solve(cluster, is_first ? kNone : record_of(a, cluster).merged);
      }
    }
    __syncthreads();
    {
      constexpr unsigned kTeams = kBlock / kTeam;
      TeamSolver<kBoundary, kTeam> small(launch, c, state, space, counts);
      const std::uint32_t num = is_first ? counts.leaders : at_most(load_shared(&state.num_todo), a.todo.capacity);
      const std::uint32_t team = threadIdx.x / kTeam;
      for (std::uint32_t k = is_first ? team : block() + num_blocks() * team; k < num;
           k += is_first ? kTeams : num_blocks() * kTeams) {
        const std::uint32_t cluster = is_first ? segment(a.leaders.items, a.leaders.capacity)[k] : a.todo.items[k];
        if (is_first || !is_for_block(cluster))
          small.solve(cluster, is_first ? a.list_head[cluster] : record_of(a, cluster).merged);
      }
    }
  }

  // visit(line, end) for the lines that events of the step led a parcel to, until it returns true.
  template <class Visit>
  __device__ bool any_line(std::uint32_t i, Visit visit) const {
    const ClusterMember& member = a.members[a.place[i]];
    if (!member.has_changed) return false;
    if (!is_retired(member.line.anchor) && visit(member.line, c.length)) return true;
    for (std::uint32_t s = member.segments; s != kNone; s = a.segments[s].before) {
      if (visit(a.segments[s].line, a.segments[s].end)) return true;
    }
    return false;
  }

  __device__ static bool is_within(std::uint32_t tick, std::uint32_t one_end, std::uint32_t other_end) {
    return tick != kNoTick && tick <= (one_end < other_end ? one_end : other_end);
  }

  __device__ bool would_have_met(std::uint32_t i, std::uint32_t j) const {
    return any_line(i, [&](const Line& p, std::uint32_t p_end) {
      return any_line(j, [&](const Line& q, std::uint32_t q_end) {
        return is_within(meeting<kBoundary>(c, p, q), p_end, q_end);
      });
    });
  }

  __device__ bool would_have_met_ball(std::uint32_t i) const {
    return any_line(i, [&](const Line& line, std::uint32_t end) {
      if (is_within(meeting_ball<kBoundary>(c, state.ball_now.line, line), end, c.length)) return true;
      for (std::uint32_t s = 0; s < state.num_ball_segments; ++s) {
        const BallLineSegment segment = a.ball_segments[s];
        if (is_within(meeting_ball<kBoundary>(c, segment.line, line), end, segment.end)) return true;
      }
      return false;
    });
  }

  // Finds the clusters whose new lines would have met.
  __device__ void compare() {
    const std::uint32_t num = at_most(counts.border, a.border_capacity);
    for (std::uint32_t k = threadIdx.x; k < num; k += kBlock) {
      const uint2 pair = segment(a.border, a.border_capacity)[k];
      const std::uint32_t p = a.owner[pair.x], q = a.owner[pair.y];
      if (p != q && record_of(a, p).is_solved && record_of(a, q).is_solved && would_have_met(pair.x, pair.y))
        add_conflict(a, state, p, q);
    }
    __syncthreads();
    if (threadIdx.x == 0) counts.border = 0;
    if (c.ball != BallRole::participant || !state.ball_has_changed) return;
    const std::uint32_t with_ball = state.ball_owner;
    if (!record_of(a, with_ball).is_solved) return;
    for (std::uint32_t k = rank(); k < at_most(state.num_near_ball, a.near_ball.capacity); k += num_threads()) {
      const std::uint32_t i = a.near_ball.items[k], owner = a.owner[i];
      if (owner != kNone && owner != with_ball && record_of(a, owner).is_solved && would_have_met_ball(i))
        add_conflict(a, state, with_ball, owner);
    }
  }

  // Gives the cluster's members to the root of its set.
  __device__ void take_over(std::uint32_t cluster, std::uint32_t round) {
    ClusterRecord& record = record_of(a, cluster);
    if (atomicExch(&record.claimed, round) == round) return;
    const std::uint32_t root = root_of(a, cluster);
    ClusterRecord& into = record_of(a, root);
    std::uint32_t last = kNone;
    for (std::uint32_t m = record.members; m != kNone; m = a.members[m].next) {
      a.owner[a.members[m].index] = root;
      last = m;
    }
    if (last != kNone) a.members[last].next = atomicExch(&into.merged, record.members);
    if (record.wants_block) into.wants_block = 1;
    if (state.ball_owner == cluster && root != cluster) state.ball_owner = root;
    if (root != cluster) return;
    const std::uint32_t place = atomicAdd(&state.num_todo, 1U);
    if (place < a.todo.capacity) {
      a.todo.items[place] = root;
    } else {
      state.failed = 1;
    }
  }

  // Solves all clusters. Blocks that leave the rest to the first one return earlier.
  __device__ void run() {
    form();
    barrier();
    for (std::uint32_t round = 0;; ++round) {
      solve(round == 0);
      if (rank() == 0) state.num_rounds += 1;
      barrier();
      if (rank() == 0) state.num_todo = 0;
      compare();
      barrier();
      const std::uint32_t num = load_shared(&state.num_conflicts);
      if (num == 0 || load_shared(&state.failed) != 0) return;
      if (!alone && num <= kAlone) {
        if (blockIdx.x != 0) return;
        alone = true;
      }
      for (std::uint32_t k = rank(); k < num; k += num_threads()) unite(a, a.conflicts[k].x, a.conflicts[k].y);
      barrier();
      if (rank() == 0) state.num_conflicts = 0;
      for (std::uint32_t k = rank(); k < 2 * num; k += num_threads()) {
        const uint2 pair = a.conflicts[k / 2];
        take_over(k % 2 == 0 ? pair.x : pair.y, round);
      }
      barrier();
    }
  }

  // What was solved becomes the parcels' state.
  __device__ void commit(const ExactLaunch& to_draw, TallySlot& tally) {
    const std::uint32_t num = at_most(counts.members, a.member_capacity);
    std::uint32_t num_events = 0;
    for (std::uint32_t k = threadIdx.x; k < num; k += kBlock) {
      const std::uint32_t place = blockIdx.x * a.member_capacity + k;
      const ClusterMember member = a.members[place];
      const std::uint32_t i = member.index;
      if (a.owner[i] == i) num_events += add(a.records[place], tally);
      if (!member.has_changed) continue;
      a.lines.position[i] = member.line.anchor;
      a.lines.velocity[i] = member.line.velocity;
      a.lines.tick[i] = member.line.tick;
      if (a.lines.clock) a.lines.clock[i] = member.clock;
      write_end<kBoundary>(c, to_draw, state, i, member.line);
    }
    if (grid.thread_rank() == 0 && c.ball == BallRole::participant && state.ball_owner == kBallCluster)
      num_events += add(record_of(a, kBallCluster), tally);
    if (num_events > 0) atomicAdd(&state.num_events, static_cast<unsigned long long>(num_events));
  }

  __device__ static std::uint32_t add(const ClusterRecord& record, TallySlot& tally) {
    if (record.num_collisions > 0) {
      atomicAdd(&tally.num_collisions, static_cast<unsigned long long>(record.num_collisions));
      atomicAdd(&tally.impulse_sum, static_cast<unsigned long long>(record.impulse_sum));
      atomicMax(&tally.max_overlap_bits, __float_as_uint(record.max_overlap));
    }
    if (record.num_hits > 0) {
      atomicAdd(&tally.num_hits, record.num_hits);
      atomicAdd(&tally.ball_x, static_cast<unsigned long long>(record.ball_x));
      atomicAdd(&tally.ball_y, static_cast<unsigned long long>(record.ball_y));
      atomicAdd(&tally.ball_torque, static_cast<unsigned long long>(record.ball_torque));
    }
    if (record.num_retired > 0) atomicAdd(&tally.num_retired, record.num_retired);
    if (record.num_events > 0) atomicAdd(&tally.event_hash, record.event_hash);
    return record.num_events;
  }
};

__device__ double fastest_after_mps(const ExactState& state) {
  return sqrt(static_cast<double>(__uint_as_float(load_shared(&state.fastest_after_bits))));
}
__device__ double fastest_of_all_mps(const ExactState& state) {
  const double parcels = fastest_after_mps(state);
  const double ball = static_cast<double>(__uint_as_float(load_shared(&state.too_fast_bits)));
  return parcels > ball ? parcels : ball;
}

// After solving, one warp: totals, the ball and the time move on, or the step is planned anew.
__device__ void finish_step_on_device(const ExactLaunch& launch, bool finished) {
  ExactState& state = *launch.state;
  const TallySlot sum = sum_slots(launch.slots[threadIdx.x]);
  launch.slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  if (finished) {
    add_to_totals(sum, *launch.step_state);
    state.event_hash += sum.event_hash;
    const std::int64_t travel = state.progress.travel;
    const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                        static_cast<std::int64_t>(sum.ball_torque)};
    const double at_begin = sqrt(static_cast<double>(__uint_as_float(sum.max_speed2_bits)));
    const ExactConstants plan = state.plan;
    ExactProgress progress = state.progress;
    const ExactBall ball = plan.ball == BallRole::participant ? state.ball_now : state.ball;
    end_step(plan, ball, hits, at_begin, fastest_after_mps(state), state.num_events, progress);
    state.progress = progress;
    state.last_travel = progress.travel - travel;
    state.parity ^= 1U;
    state.longest = static_cast<std::uint32_t>(kAnchorPeriod);
    launch.step_state->ball = progress.ball;
  } else {
    state.num_redone += 1;
    const double needed = fastest_of_all_mps(state);
    if (needed > state.plan.max_speed_mps) {
      state.progress.raised_bound_mps = kSpeedMargin * needed;
    } else {
      state.longest = state.plan.length / 2 > 1 ? state.plan.length / 2 : 1;
    }
  }
}

__device__ void anchor_parcel(const ExactArrays& a, const ExactState& state, std::uint32_t i) {
  const auto now = static_cast<std::uint32_t>(state.progress.now);
  a.lines.position[i] = a.present[state.parity][i];
  a.lines.tick[i] = now;
  if (a.lines.clock && now - a.lines.clock[i] > kAnchorPeriod)
    a.lines.clock[i] = now - static_cast<std::uint32_t>(kAnchorPeriod);
}

// Solves the clusters of one step, until its end: parts of it that must be redone, too.
template <Boundary kBoundary, unsigned kTeam, unsigned kBlocks>
__global__ void __launch_bounds__(kBlock, kBlocks)
    solve_kernel(const __grid_constant__ ExactLaunch launch) {
  __shared__ ExactConstants c;
  __shared__ TallySlot block_tally;
  __shared__ TeamSpace space;
  __shared__ BlockCounts counts;
  cg::grid_group grid = cg::this_grid();
  ExactState& state = *launch.state;
  if (threadIdx.x == 0) block_tally = {};
  while (true) {
    if (threadIdx.x == 0) {
      c = state.plan;
      counts = {};
      counts.active = launch.arrays.active.counts[blockIdx.x];
    }
    __syncthreads();
    Clusters<kBoundary, kTeam> clusters{launch, c, state, space, counts};
    if (state.failed == 0) clusters.run();
    grid.sync();
    const bool finished = load_shared(&state.failed) == 0 && fastest_of_all_mps(state) <= c.max_speed_mps;
    if (finished) clusters.commit(launch, block_tally);
    __syncthreads();
    if (threadIdx.x == 0) {
      add_slot(launch.slots[blockIdx.x % kNumSlots], block_tally);
      block_tally = {};
      launch.arrays.active.counts[blockIdx.x] = 0;
    }
    grid.sync();
    if (blockIdx.x == 0 && threadIdx.x < kNumSlots) finish_step_on_device(launch, finished);
    grid.sync();
    const bool anchoring = finished && state.progress.now % kAnchorPeriod == 0;
    if (anchoring) {
      for (std::uint32_t i = grid.thread_rank(); i < launch.space.num_parcels; i += grid.size())
        anchor_parcel(launch.arrays, state, i);
    }
    const bool done = state.progress.now >= launch.until;
    grid.sync();
    if (grid.thread_rank() == 0) {
      const std::uint64_t until = done ? launch.next_until : launch.until;
      if (until > state.progress.now) plan_next(launch.constants, until, state);
    }
    if (done) return;
    grid.sync();
    if (threadIdx.x == 0) c = state.plan;
    __syncthreads();
    DeviceTally tally{&block_tally};
    for (std::uint32_t tile = blockIdx.x; tile * kBlock < launch.space.num_parcels; tile += gridDim.x) {
      predict_tile<kBoundary, false>(c, launch, tile * kBlock + threadIdx.x, blockIdx.x, tally);
      reduce_warp(tally, block_tally);
      tally = DeviceTally{&block_tally};
    }
    grid.sync();
  }
}

__global__ void begin_request_kernel(const __grid_constant__ ExactLaunch launch) {
  ExactState& state = *launch.state;
  if (threadIdx.x < kNumSlots) launch.slots[threadIdx.x] = {};
  for (std::uint32_t s = threadIdx.x; s < launch.arrays.num_segments; s += blockDim.x)
    launch.arrays.active.counts[s] = 0;
  if (threadIdx.x != 0) return;
  launch.step_state->totals = {};
  state.num_rounds = 0;
  state.num_redone = 0;
  state.event_hash = 0;
  state.progress.ball = launch.step_state->ball;
  if (launch.ball_was_set) state.progress.ball_follows = false;
  state.longest = static_cast<std::uint32_t>(kAnchorPeriod);
  if (launch.until > state.progress.now) plan_next(launch.constants, launch.until, state);
}

__global__ void enter_kernel(const __grid_constant__ ExactLaunch launch, std::uint64_t now) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  const ExactArrays& a = launch.arrays;
  float speed2 = 0.0F;
  if (i < launch.space.num_parcels) {
    a.lines.tick[i] = static_cast<std::uint32_t>(now);
    if (a.lines.clock) a.lines.clock[i] = static_cast<std::uint32_t>(now - kAnchorPeriod);
    a.present[0][i] = a.lines.position[i];
    speed2 = dot(a.lines.velocity[i], a.lines.velocity[i]);
  }
  const unsigned fastest = __reduce_max_sync(0xFFFFFFFFU, __float_as_uint(speed2));
  if (threadIdx.x % 32 == 0) atomicMax(&launch.state->fastest_after_bits, fastest);
}

__global__ void enter_state_kernel(ExactState* state, std::uint64_t now) {
  *state = {};
  state->progress.now = now;
}

__global__ void enter_done_kernel(ExactState* state) {
  state->progress.fastest_mps = sqrt(static_cast<double>(__uint_as_float(state->fastest_after_bits)));
}

template <Boundary kBoundary>
__global__ void find_present_kernel(const __grid_constant__ ExactLaunch launch) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  ExactState& state = *launch.state;
  if (i == 0) state.progress.travel = 0;
  if (i >= launch.space.num_parcels) return;
  ExactConstants c = launch.constants;
  c.begin = static_cast<std::uint32_t>(state.progress.now);
  launch.arrays.present[state.parity][i] = position_at<kBoundary>(c, line_of(launch.arrays, i), 0);
}

__global__ void key_kernel(const __grid_constant__ ExactLaunch launch, const SortKeys keys) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= launch.space.num_parcels) return;
  keys.key[i] = cell_key(launch.space.grid, launch.arrays.present[launch.state->parity][i]);
  keys.index[i] = i;
}

__global__ void copy_present_kernel(const __grid_constant__ ExactLaunch launch, Vec2i* out) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i < launch.space.num_parcels) out[i] = launch.arrays.present[launch.state->parity][i];
}

template <class Function>
void for_boundary(Boundary boundary, Function function) {
  switch (boundary) {
    case Boundary::walls:
      return function.template operator()<Boundary::walls>();
    case Boundary::periodic:
      return function.template operator()<Boundary::periodic>();
    default:
      return function.template operator()<Boundary::open>();
  }
}

template <Boundary kBoundary>
auto solve_kernel_for(std::uint32_t num_parcels) {
  return num_parcels < kMany ? solve_kernel<kBoundary, kTogether, kBlocksPerSm>
                             : solve_kernel<kBoundary, kTogetherIfMany, kBlocksPerSmIfMany>;
}

std::uint32_t most_segments(std::uint32_t num_parcels) {
  int device = 0, num_sms = 0, blocks = 0;
  PF_CUDA(cudaGetDevice(&device));
  PF_CUDA(cudaDeviceGetAttribute(&num_sms, cudaDevAttrMultiProcessorCount, device));
  int least = num_parcels < kMany ? kBlocksPerSm : kBlocksPerSmIfMany;
  for (const auto kernel : {solve_kernel_for<Boundary::open>(num_parcels), solve_kernel_for<Boundary::walls>(num_parcels),
                            solve_kernel_for<Boundary::periodic>(num_parcels)}) {
    PF_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kBlock, 0));
    least = std::min(least, blocks);
  }
  return static_cast<std::uint32_t>(num_sms * least);
}

}  // namespace

std::uint32_t exact_num_segments(std::uint32_t num_parcels) {
  const std::uint32_t wanted = (num_parcels + kParcelsPerSegment - 1) / kParcelsPerSegment;
  return std::clamp(wanted, 1U, std::max(1U, most_segments(num_parcels)));
}

void launch_exact_enter(const ExactLaunch& launch, std::uint64_t now, cudaStream_t stream) {
  enter_state_kernel<<<1, 1, 0, stream>>>(launch.state, now);
  const unsigned blocks = std::max(1U, blocks_for(launch.space.num_parcels));
  enter_kernel<<<blocks, kBlock, 0, stream>>>(launch, now);
  enter_done_kernel<<<1, 1, 0, stream>>>(launch.state);
  PF_LAUNCHED("enter_kernel");
}

void launch_exact_begin_request(const ExactLaunch& launch, cudaStream_t stream) {
  begin_request_kernel<<<1, kBlock, 0, stream>>>(launch);
  PF_LAUNCHED("begin_request_kernel");
}

void launch_exact_find_present(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.constants.step.physics.world.boundary, [&]<Boundary kBoundary>() {
    find_present_kernel<kBoundary><<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch);
  });
  PF_LAUNCHED("find_present_kernel");
}

void launch_exact_step(const ExactLaunch& launch, cudaStream_t stream) {
  for_boundary(launch.constants.step.physics.world.boundary, [&]<Boundary kBoundary>() {
    const unsigned blocks = std::max(1U, blocks_for(launch.space.num_parcels));
    predict_kernel<kBoundary><<<blocks, kBlock, 0, stream>>>(launch);
    PF_LAUNCHED("predict_kernel");
    ExactLaunch argument = launch;
    void* arguments[] = {&argument};
    PF_CUDA(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(solve_kernel_for<kBoundary>(launch.space.num_parcels)),
                                        dim3(launch.arrays.num_segments), dim3(kBlock), arguments, 0,
                                        stream));
  });
}

void launch_exact_write_keys(const ExactLaunch& launch, const SortKeys& keys, cudaStream_t stream) {
  key_kernel<<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch, keys);
  PF_LAUNCHED("key_kernel");
}

void launch_exact_copy_present(const ExactLaunch& launch, Vec2i* out, cudaStream_t stream) {
  copy_present_kernel<<<blocks_for(launch.space.num_parcels), kBlock, 0, stream>>>(launch, out);
  PF_LAUNCHED("copy_present_kernel");
}

}  // namespace pf
