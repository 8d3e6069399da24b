#include "exact_kernel.cuh"

#include <cooperative_groups.h>

#include <algorithm>

#include "check.cuh"
#include "draw_parcel.cuh"
#include "tally.cuh"

namespace pf {
namespace {

namespace cg = cooperative_groups;

constexpr unsigned kBlock = 256;
constexpr unsigned kPredictBlocksPerSm = 5;  // ms at 10^7: 0.63; with 4 0.74, with 3 0.93
constexpr unsigned kRoundBlocksPerSm = 2;
constexpr std::uint32_t kParcelsPerSegment = 1024;  // fewer blocks for few parcels: the barrier is cheaper

constexpr unsigned long long kNoKey = ~0ULL;

// Counts of a block's items: six lists (SegmentedList::slot) and the saved lines.
constexpr unsigned kSavedSlot = 6;
constexpr unsigned kNumSlotsOfLists = 7;

// So many threads work on one parcel together where a block has few of them and each search's latency counts;
// with many, one thread each wastes less.
constexpr unsigned kTogether = 8;
constexpr std::uint32_t kFew = 128;

// With at most so many parcels active, one block does the remaining rounds alone: its barrier costs a tenth.
constexpr std::uint32_t kAlone = 64;
constexpr std::uint32_t kAloneNearBall = 2048;

// A mark says in which round a parcel was last touched, and how: stamp * 8 + status. Of two marks of one
// round the larger counts. kSaved: its line at the step's begin is in the list of saved ones.
enum : std::uint32_t { kFlagged = 1, kChanged = 2, kSaved = 4 };

unsigned blocks_for(std::uint32_t n) { return (n + kBlock - 1) / kBlock; }

__device__ bool reaches_end(const ExactState& state, std::uint64_t until) {
  return state.progress.now + state.plan.length == until;
}

__device__ Line line_of(const ExactArrays& a, std::uint32_t i) {
  return {a.lines.position[i], a.lines.velocity[i], a.lines.tick[i]};
}

__device__ std::int32_t saturated(double units) {
  return static_cast<std::int32_t>(units < 1.0e9 ? units : 1.0e9);
}

// Square of a distance, as the filter of a search: a little above it, whatever float makes of it.
__device__ float filter_of(double distance) { return static_cast<float>(distance * distance * (1.0 + 1e-5)); }

template <Boundary kBoundary>
__device__ bool is_near_ball(const World& world, const ExactState& state, Vec2i present) {
  const Vec2i from = separation<kBoundary>(world, state.ball_centre, present);
  const long long x = from.x, y = from.y;
  return (x < 0 ? -x : x) <= state.ball_reach && (y < 0 ? -y : y) <= state.ball_reach;
}

__device__ void keep_meeting(Event& best, std::uint32_t tick, std::uint32_t j, const std::uint32_t* id) {
  if (tick <= best.tick && tick != kNoTick) keep_earlier(best, {tick, j, id[j]});
}

// The end of each prediction: the edge of the world and the ball.
template <Boundary kBoundary>
__device__ void keep_others(const ExactConstants& c, const ExactState& state, const Line& line, Vec2i present,
                            Event& best) {
  if (may_reach_edge<kBoundary>(c, present)) keep_edge_event<kBoundary>(c, line, best);
  if (c.ball != BallRole::absent && is_near_ball<kBoundary>(c.step.physics.world, state, present))
    keep_earlier(best, {meeting_ball<kBoundary>(c, state.ball.line, line), kBallPartner, kBallPartner});
}

__device__ void set_event(const ExactArrays& a, std::uint32_t i, const Event& event) {
  a.event_tick[i] = event.tick;
  a.event_partner[i] = event.partner;
  a.bound[i] = event.tick;
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
  keep_others<kBoundary>(c, state, here, at, best);
  return best;
}

__device__ void offer_ball(ExactState& state, std::uint32_t which, std::uint32_t tick, std::uint32_t id) {
  atomicMin(&state.ball_key[which], (static_cast<unsigned long long>(tick) << 32U) | id);
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
    state.failed = state.stamp - 1;
  }
}

template <Boundary kBoundary, bool kReadOnly>
__device__ void predict_tile(const ExactConstants& c, const ExactLaunch& launch, std::uint32_t i,
                             std::uint32_t segment, DeviceTally& tally) {
  ExactState& state = *launch.state;
  const ExactArrays& a = launch.arrays;
  bool active = false, near = false;
  if (i < launch.space.num_parcels) {
    const Event event = predict_first<kBoundary, kReadOnly>(c, launch, state, i, tally);
    set_event(a, i, event);
    active = event.tick != kNoTick;
    if (c.ball != BallRole::absent) {
      const Vec2i at = a.present[state.parity][i];
      near = !is_retired(at) && is_near_ball<kBoundary>(c.step.physics.world, state, at);
    }
    if (active && event.partner == kBallPartner)
      offer_ball(state, state.stamp & 1U, event.tick, a.lines.id[i]);
  }
  append(a.lists.active[0], segment, i, active, state);
  if (c.ball != BallRole::absent) append(a.lists.near_ball, segment, i, near, state);
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
  state.step_stamp = state.stamp;
  for (int k = 0; k < 3; ++k) state.pending[k] = 0;
  for (int k = 0; k < 2; ++k) {
    state.ball_key[k] = kNoKey;
    state.ball_lowered[k] = kNoTick;
  }
  state.ball_fastest_mps = 0.0;
  state.fastest_after_bits = 0;
}

// What one block's threads know of the rounds.
template <Boundary kBoundary>
struct Rounds {
  const ExactLaunch& launch;
  const ExactConstants& c;
  ExactState& state;
  TallySlot* block_tally;
  std::uint32_t* counts;  // of this block's items in each list, shared memory
  const ExactArrays& a = launch.arrays;
  RoundLists lists = launch.arrays.lists;
  cg::grid_group grid = cg::this_grid();
  std::uint32_t segment = blockIdx.x;
  bool alone = false;            // one block, with lists of its own
  std::uint32_t now_active = 0;  // which of the two lists
  std::uint32_t stamp = 0;
  double fastest_now = 0.0;         // bound on the speed of every line so far
  const Vec2i* at_begin = nullptr;  // what does not change during the rounds, out of `state`
  Vec2i* at_end = nullptr;
  double travel = 0.0;
  std::uint64_t begin_tick = 0;
  std::uint32_t step_stamp = 0;
  bool draws = false;
  unsigned num_collisions = 0, num_hits = 0;
  long long impulse_sum = 0;
  float max_overlap = 0.0F;
  unsigned long long hash = 0;

  __device__ void look_up() {
    at_begin = a.present[state.parity];
    at_end = a.present[state.parity ^ 1U];
    travel = static_cast<double>(state.progress.travel);
    begin_tick = state.progress.now;
    step_stamp = state.step_stamp;
    draws = launch.draw.position_m != nullptr && reaches_end(state, launch.until);
    fastest_now = state.progress.fastest_mps;
  }

  // The model's Tally.
  __device__ void begin_contact() { ++num_collisions; }
  __device__ void impulse(std::int32_t counts) { impulse_sum += counts; }
  __device__ void overlap(float diameters) { max_overlap = fmaxf(max_overlap, diameters); }
  __device__ void ball_hit(const BallSums& hit) {
    atomicAdd(&block_tally->num_hits, 1U);
    atomicAdd(&block_tally->ball_x, static_cast<unsigned long long>(hit.impulse_x));
    atomicAdd(&block_tally->ball_y, static_cast<unsigned long long>(hit.impulse_y));
    atomicAdd(&block_tally->ball_torque, static_cast<unsigned long long>(hit.torque));
  }

  __device__ std::uint32_t count_of(const SegmentedList& list) const {
    const std::uint32_t count = counts[list.slot];
    return count < list.capacity ? count : list.capacity;
  }
  __device__ std::uint32_t& item_of(const SegmentedList& list, std::uint32_t k) const {
    return list.items[static_cast<std::size_t>(segment) * list.capacity + k];
  }
  // visit(parcel) for this block's items of the list, from the item `first` on.
  template <class Visit>
  __device__ void each(const SegmentedList& list, std::uint32_t first, std::uint32_t end, Visit visit) {
    for (std::uint32_t k = first + threadIdx.x; k < end; k += kBlock) visit(item_of(list, k));
  }
  template <class Visit>
  __device__ void each(const SegmentedList& list, Visit visit) {
    each(list, 0, count_of(list), visit);
  }
  // The same, visit<kLanes>(parcel) being called by kLanes threads for each item: together if these are few.
  template <class Visit>
  __device__ void each_shared(const SegmentedList& list, std::uint32_t first, std::uint32_t end,
                              Visit visit) {
    if (end - first > kFew) {
      each(list, first, end, [&](std::uint32_t i) { visit.template operator()<1>(i); });
    } else {
      for (std::uint32_t k = first + threadIdx.x / kTogether; k < end; k += kBlock / kTogether)
        visit.template operator()<kTogether>(item_of(list, k));
    }
  }
  template <class Visit>
  __device__ void each_shared(const SegmentedList& list, Visit visit) {
    each_shared(list, 0, count_of(list), visit);
  }
  template <unsigned kLanes>
  __device__ static bool is_first_lane() {
    return threadIdx.x % kLanes == 0;
  }
  // The earliest of the lanes' events, in every lane.
  template <unsigned kLanes>
  __device__ static Event earliest_of_lanes(Event best) {
    if constexpr (kLanes == 1) return best;
    const auto lanes = cg::tiled_partition<kLanes>(cg::this_thread_block());
    for (unsigned offset = kLanes / 2; offset > 0; offset /= 2) {
      keep_earlier(best, {lanes.shfl_xor(best.tick, offset), lanes.shfl_xor(best.partner, offset),
                          lanes.shfl_xor(best.partner_id, offset)});
    }
    return best;
  }
  __device__ void push(const SegmentedList& list, std::uint32_t item) {
    const std::uint32_t place = atomicAdd(&counts[list.slot], 1U);
    if (place < list.capacity) {
      item_of(list, place) = item;
    } else {
      state.failed = stamp;
    }
  }
  __device__ void clear(const SegmentedList& list) {
    if (threadIdx.x == 0) counts[list.slot] = 0;
  }

  __device__ Event event(std::uint32_t i) const {
    const std::uint32_t partner = a.event_partner[i];
    return {a.event_tick[i], partner, is_parcel(partner) ? a.lines.id[partner] : partner};
  }
  __device__ Vec2i present(std::uint32_t i) const { return at_begin[i]; }

  // Calls use(j), shared among kLanes threads, for the parcels that i may touch within the step if it moves
  // no further than moved_units from where it was at the begin, and they keep to their present lines. What is
  // found is used after the search, so that a warp's threads do it together.
  template <unsigned kLanes, class Use>
  __device__ void search_near(std::uint32_t i, double moved_units, Use use) {
    if (!c.step.physics.parcels.contacts) return;
    const double others = fastest_now * c.units_per_tick * c.length;
    const double distance = c.step.contact_distance + moved_units + others + kRoundingMargin;
    const Vec2i at = present(i);
    const auto find = [&](auto found) {
      search<kBoundary, false, kLanes>(launch.space, at_begin, at, i, saturated(distance + travel),
                                       filter_of(distance), found);
    };
    FindList finds;
    find([&](std::uint32_t j, Vec2i) { finds.push(j); });
    if (finds.num > FindList::kMost) {
      find([&](std::uint32_t j, Vec2i) { use(j); });
    } else {
      while (finds.num > 0) use(finds.pop());
    }
  }
  template <unsigned kLanes, class Use>
  __device__ void search_along_line(std::uint32_t i, Use use) {
    search_near<kLanes>(i, fastest_now * c.units_per_tick * c.length, use);
  }

  template <unsigned kLanes>
  __device__ void predict(std::uint32_t i) {
    const Line here = line_of(a, i);
    Event best;
    if (!is_retired(here.anchor)) {
      search_along_line<kLanes>(i, [&](std::uint32_t j) {
        if (!is_retired(a.lines.position[j]))
          keep_meeting(best, meeting<kBoundary>(c, here, line_of(a, j)), j, a.lines.id);
      });
      best = earliest_of_lanes<kLanes>(best);
      keep_others<kBoundary>(c, state, here, present(i), best);
    }
    if (is_first_lane<kLanes>()) set_event(a, i, best);
  }

  __device__ Event ball_event() const {
    Event best;
    if (c.ball != BallRole::participant) return best;
    const unsigned long long key = state.ball_key[stamp & 1U];
    if (key != kNoKey) best = {static_cast<std::uint32_t>(key >> 32U), 0U, static_cast<std::uint32_t>(key)};
    keep_ball_edge_event<kBoundary>(c, state.ball.line, best);
    return best;
  }
  __device__ std::uint32_t ball_bound(const Event& ball_event) const {
    const std::uint32_t lowered = *const_cast<volatile std::uint32_t*>(&state.ball_lowered[stamp & 1U]);
    return lowered < ball_event.tick ? lowered : ball_event.tick;
  }

  __device__ bool lower_bound(std::uint32_t k, std::uint32_t to) {
    if (to == kNoTick || to >= a.bound[k] || atomicMin(&a.bound[k], to) <= to) return false;
    push(lists.lowered, k);
    return true;
  }

  // Passes on to the neighbours of i how early i, after whatever happens to it first, can touch them.
  template <unsigned kLanes>
  __device__ bool spread(std::uint32_t i, std::uint32_t ball_tick) {
    const std::uint32_t at = *const_cast<volatile std::uint32_t*>(&a.bound[i]);
    const Line here = line_of(a, i);
    if (is_retired(here.anchor)) return false;
    bool any = false;
    const double moved = (fastest_now * at + c.max_speed_mps * (c.length - at)) * c.units_per_tick;
    search_near<kLanes>(i, moved, [&](std::uint32_t k) {
      if (is_retired(a.lines.position[k])) return;
      if (lower_bound(k, earliest_touch<kBoundary>(c, here, at, line_of(a, k)))) any = true;
    });
    if (is_first_lane<kLanes>() && c.ball == BallRole::participant &&
        is_near_ball<kBoundary>(c.step.physics.world, state, present(i))) {
      const double ball_mps = speed_of(state.ball.line.velocity_mps);
      const std::uint32_t touch = earliest_touch_ball<kBoundary>(c, state.ball.line, here, at, ball_mps);
      if (touch < ball_tick && atomicMin(&state.ball_lowered[stamp & 1U], touch) > touch) any = true;
    }
    return any;
  }

  __device__ bool spread_ball(std::uint32_t at) {
    bool any = false;
    each(lists.near_ball, [&](std::uint32_t k) {
      if (is_retired(a.lines.position[k])) return;
      const Line line = line_of(a, k);
      const double mps = speed_of(to_double(line.velocity));
      if (lower_bound(k, earliest_touch_ball<kBoundary>(c, state.ball.line, line, at, mps))) any = true;
    });
    return any;
  }

  __device__ void barrier() {
    if (alone) {
      __syncthreads();
    } else {
      grid.sync();
    }
  }
  __device__ bool leads() const { return threadIdx.x == 0 && (alone || blockIdx.x == 0); }

  // Sum of the blocks' numbers; a barrier. turn: counts the calls of one step.
  __device__ std::uint32_t total(std::uint32_t of_block, std::uint32_t& turn) {
    if (alone) {
      __syncthreads();
      return of_block;
    }
    __syncthreads();
    if (threadIdx.x == 0 && of_block > 0) atomicAdd(&state.pending[turn % 3], of_block);
    if (leads()) state.pending[(turn + 1) % 3] = 0;
    grid.sync();
    const std::uint32_t sum = *const_cast<volatile std::uint32_t*>(&state.pending[turn % 3]);
    ++turn;
    return sum;
  }

  // Lowers the bounds until nothing changes: then no true event of a parcel precedes its bound.
  __device__ void spread_bounds(const Event& ball, std::uint32_t& turn) {
    __shared__ std::uint32_t ball_at;
    std::uint32_t first = 0, ball_spread_from = kNoTick;
    bool initial = true;
    while (true) {
      if (threadIdx.x == 0) ball_at = ball_bound(ball);
      __syncthreads();
      const std::uint32_t end = count_of(lists.lowered);
      __syncthreads();  // what is pushed from here on belongs to the next pass
      bool any = false;
      const auto pass_on = [&]<unsigned kLanes>(std::uint32_t i) {
        any = spread<kLanes>(i, ball.tick) || any;
      };
      if (initial) {
        each_shared(lists.active[now_active], pass_on);
      } else {
        each_shared(lists.lowered, first, end, pass_on);
      }
      if (ball_at < ball_spread_from) any = spread_ball(ball_at) || any;
      ball_spread_from = ball_at;
      first = initial ? 0 : end;
      initial = false;
      if (total(__syncthreads_or(any) ? 1U : 0U, turn) == 0) return;
    }
  }

  __device__ bool is_safe(std::uint32_t i) const {
    const std::uint32_t tick = a.event_tick[i];
    if (tick == kNoTick || a.bound[i] != tick) return false;
    const std::uint32_t partner = a.event_partner[i];
    if (!is_parcel(partner)) return true;
    return a.event_partner[partner] == i && a.event_tick[partner] == tick && a.bound[partner] == tick;
  }

  __device__ bool is_saved(std::uint32_t mark) const {
    return mark / 8U >= step_stamp && (mark & kSaved) != 0;
  }

  // Keeps the parcel's line at the begin, once a step; false if there is no room for it.
  __device__ bool save(std::uint32_t i) {
    if (is_saved(a.mark[i])) return true;
    const std::uint32_t place = atomicAdd(&counts[kSavedSlot], 1U);
    if (place >= lists.saved_capacity) {
      state.failed = stamp;
      return false;
    }
    lists.saved[static_cast<std::size_t>(segment) * lists.saved_capacity + place] = {
        i, line_of(a, i), a.lines.clock ? a.lines.clock[i] : 0U};
    return true;
  }

  __device__ void store(std::uint32_t i, const Line& now) {
    a.lines.position[i] = now.anchor;
    a.lines.velocity[i] = now.velocity;
    a.lines.tick[i] = now.tick;
    const Vec2i end = position_at<kBoundary>(c, now, static_cast<std::int32_t>(c.length));
    at_end[i] = end;
    if (draws) draw_parcel(launch.draw, c.step.physics.world, i, end, now.velocity);
    const float speed2 = dot(now.velocity, now.velocity);
    if (static_cast<double>(speed2) > fastest_now * fastest_now)
      atomicMax(&state.fastest_after_bits, __float_as_uint(speed2));
    a.mark[i] = stamp * 8U + kChanged + kSaved;
    push(lists.changed, i);
  }

  __device__ void record(std::uint32_t tick, std::uint32_t first, std::uint32_t second) {
    hash += event_hash(begin_tick + tick, first < second ? first : second, first < second ? second : first);
  }

  __device__ bool in_contact_time(std::uint32_t i, std::uint32_t tick) const {
    return c.clock_ticks != 0 && c.begin + tick - a.lines.clock[i] <= c.clock_ticks;
  }
  __device__ void set_clock(std::uint32_t i, std::uint32_t tick) {
    if (a.lines.clock) a.lines.clock[i] = c.begin + tick;
  }

  __device__ void resolve_pair(std::uint32_t i, std::uint32_t j, std::uint32_t tick) {
    const bool in_order = a.lines.id[i] < a.lines.id[j];
    const std::uint32_t p = in_order ? i : j, q = in_order ? j : i;
    if (!save(p) || !save(q)) return;
    Line first = line_of(a, p), second = line_of(a, q);
    anchor_at<kBoundary>(c, first, tick);
    anchor_at<kBoundary>(c, second, tick);
    const bool elastic = in_contact_time(p, tick) || in_contact_time(q, tick);
    collide<kBoundary>(c, first, second, elastic, *this);
    store(p, first);
    store(q, second);
    set_clock(p, tick);
    set_clock(q, tick);
    record(tick, a.lines.id[p], a.lines.id[q]);
  }

  __device__ void resolve_edge(std::uint32_t i, std::uint32_t tick) {
    const std::uint32_t partner = a.event_partner[i];
    if (!save(i)) return;
    Line now = line_of(a, i);
    anchor_at<kBoundary>(c, now, tick);
    meet_edge(c, partner, now);
    if (partner == kExit) atomicAdd(&block_tally->num_retired, 1U);
    store(i, now);
    set_clock(i, tick);
    record(tick, a.lines.id[i], partner);
  }

  __device__ BallKick resolve_ball_hit(std::uint32_t i, std::uint32_t tick) {
    if (!save(i)) return {};
    Line now = line_of(a, i);
    anchor_at<kBoundary>(c, now, tick);
    const BallKick kick = collide_with_ball<kBoundary>(c, state.ball.line, tick, now, *this);
    store(i, now);
    record(tick, a.lines.id[i], kBallPartner);
    return kick;
  }

  __device__ void change_the_ball(std::uint32_t tick, std::uint32_t partner, const BallKick& kick) {
    ExactBall ball = state.ball;
    change_ball(c, tick, partner, kick, ball);
    state.ball = ball;
    const double surface_mps = surface_speed_mps(c.step.physics, ball.line);
    if (surface_mps > state.ball_fastest_mps) state.ball_fastest_mps = surface_mps;
    state.ball_changed_in = stamp;
  }

  __device__ void resolve(std::uint32_t i, const Event& ball, bool ball_is_safe) {
    if (!is_safe(i)) return;
    const std::uint32_t partner = a.event_partner[i];
    const std::uint32_t tick = a.event_tick[i];
    if (is_parcel(partner)) {
      if (i < partner) resolve_pair(i, partner, tick);
    } else if (partner != kBallPartner) {
      resolve_edge(i, tick);
    } else if (c.ball == BallRole::frozen) {
      resolve_ball_hit(i, tick);
    } else if (ball_is_safe && tick == ball.tick && a.lines.id[i] == ball.partner_id) {
      change_the_ball(tick, 0U, resolve_ball_hit(i, tick));
    }
  }

  __device__ void flag(std::uint32_t k) {
    const std::uint32_t before = *const_cast<volatile std::uint32_t*>(&a.mark[k]);
    const std::uint32_t mark = stamp * 8U + kFlagged + (is_saved(before) ? kSaved : 0U);
    if (atomicMax(&a.mark[k], mark) < mark) push(lists.flagged, k);
  }
  __device__ bool has_changed(std::uint32_t k) const {
    const std::uint32_t mark = *const_cast<volatile std::uint32_t*>(&a.mark[k]);
    return mark / 8U == stamp && (mark & kChanged) != 0;
  }

  // New prediction of a changed parcel; flags those neighbours that meet it first now, or were to before.
  template <unsigned kLanes>
  __device__ void predict_changed(std::uint32_t i) {
    const Line here = line_of(a, i);
    const bool gone = is_retired(here.anchor);
    const std::uint32_t id = a.lines.id[i];
    Event best;
    search_along_line<kLanes>(i, [&](std::uint32_t k) {
      if (is_retired(a.lines.position[k])) return;
      const std::uint32_t tick = gone ? kNoTick : meeting<kBoundary>(c, here, line_of(a, k));
      keep_meeting(best, tick, k, a.lines.id);
      if (has_changed(k)) return;
      const bool first_now = tick != kNoTick && comes_before({tick, i, id}, event(k));
      if (first_now || a.event_partner[k] == i) flag(k);
    });
    best = earliest_of_lanes<kLanes>(best);
    if (!gone) keep_others<kBoundary>(c, state, here, present(i), best);
    if (is_first_lane<kLanes>()) set_event(a, i, best);
  }

  __device__ void flag_near_ball(std::uint32_t k) {
    if (has_changed(k) || is_retired(a.lines.position[k])) return;
    const std::uint32_t tick = meeting_ball<kBoundary>(c, state.ball.line, line_of(a, k));
    const bool first_now = tick != kNoTick && comes_before({tick, kBallPartner, kBallPartner}, event(k));
    if (first_now || a.event_partner[k] == kBallPartner) flag(k);
  }

  // Those with an event left go to the other list of active parcels.
  __device__ void keep_active(std::uint32_t i) {
    const std::uint32_t tick = a.event_tick[i];
    if (tick == kNoTick) return;
    push(lists.active[now_active ^ 1U], i);
    if (a.event_partner[i] == kBallPartner) offer_ball(state, (stamp + 1) & 1U, tick, a.lines.id[i]);
  }

  __device__ void predict_again_and_rebuild() {
    each_shared(lists.flagged, [&]<unsigned kLanes>(std::uint32_t i) { predict<kLanes>(i); });
    __syncthreads();  // the block's own segment is what follows
    each(lists.lowered, [&](std::uint32_t i) {
      if (a.mark[i] / 8U != stamp) a.bound[i] = a.event_tick[i];
    });
    each(lists.active[now_active], [&](std::uint32_t i) {
      if (a.mark[i] / 8U != stamp) keep_active(i);
    });
    each(lists.changed, [&](std::uint32_t i) { keep_active(i); });
    each(lists.flagged, [&](std::uint32_t i) { keep_active(i); });
  }

  // Takes over the other blocks' items; they wait at the end of the rounds.
  __device__ void take_all(const SegmentedList& from, const SegmentedList& to) {
    if (threadIdx.x == 0) counts[to.slot] = 0;
    __syncthreads();
    for (std::uint32_t s = threadIdx.x / kTogether; s < a.num_segments; s += kBlock / kTogether) {
      const std::uint32_t count = from.counts[s] < from.capacity ? from.counts[s] : from.capacity;
      for (std::uint32_t k = threadIdx.x % kTogether; k < count; k += kTogether)
        to.items[atomicAdd(&counts[to.slot], 1U)] =
            from.items[static_cast<std::size_t>(s) * from.capacity + k];
    }
    __syncthreads();
  }
  // Lines saved so far stay in the block's segment; num_saved says how many.
  __device__ void publish_saved() {
    if (threadIdx.x == 0) (alone ? a.alone : a.lists).num_saved[segment] = counts[kSavedSlot];
  }
  __device__ void go_on_alone() {
    publish_saved();
    __syncthreads();
    if (threadIdx.x == 0) counts[kSavedSlot] = 0;
    take_all(lists.active[now_active], a.alone.active[now_active]);
    take_all(lists.near_ball, a.alone.near_ball);
    lists = a.alone;
    segment = 0;
    alone = true;
  }

  // One round. Returns whether the bound on speeds held.
  __device__ bool round(const Event& ball, std::uint32_t& turn) {
    if (leads()) {
      state.num_rounds += 1;
      state.ball_key[(stamp + 1) & 1U] = kNoKey;
      state.ball_lowered[(stamp + 1) & 1U] = kNoTick;
    }
    clear(lists.lowered);
    clear(lists.changed);
    clear(lists.flagged);
    clear(lists.active[now_active ^ 1U]);
    __syncthreads();
    spread_bounds(ball, turn);
    const bool ball_is_safe = ball.tick != kNoTick && ball_bound(ball) == ball.tick;
    each(lists.active[now_active], [&](std::uint32_t i) { resolve(i, ball, ball_is_safe); });
    if (ball_is_safe && !is_parcel(ball.partner) && leads()) {
      change_the_ball(ball.tick, ball.partner, {});
      record(ball.tick, ball.partner, kBallPartner);
    }
    barrier();
    const double after = sqrt(static_cast<double>(
        __uint_as_float(*const_cast<volatile std::uint32_t*>(&state.fastest_after_bits))));
    if (after > c.max_speed_mps || state.ball_fastest_mps > c.max_speed_mps) return false;
    fastest_now = after > fastest_now ? after : fastest_now;
    each_shared(lists.changed, [&]<unsigned kLanes>(std::uint32_t i) { predict_changed<kLanes>(i); });
    if (state.ball_changed_in == stamp) each(lists.near_ball, [&](std::uint32_t k) { flag_near_ball(k); });
    barrier();
    predict_again_and_rebuild();
    now_active ^= 1U;
    return true;
  }

  // Rounds until no event is left; whether they came to their end within the bounds and the lists. Blocks
  // that leave the rest to the first one return true.
  __device__ bool run(std::uint32_t most_rounds) {
    std::uint32_t turn = 0;
    const std::uint32_t num_near = total(count_of(lists.near_ball), turn);
    for (std::uint32_t k = 0;; ++k) {
      __syncthreads();
      if (!alone && threadIdx.x == 0)
        lists.active[now_active].counts[segment] = count_of(lists.active[now_active]);
      const std::uint32_t num_active = total(count_of(lists.active[now_active]), turn);
      stamp = *const_cast<volatile std::uint32_t*>(&state.stamp) + k;
      // Of earlier rounds only: a block that is ahead may be failing in this one already.
      const std::uint32_t failed = *const_cast<volatile std::uint32_t*>(&state.failed);
      if ((failed != 0 && failed < stamp) || k == most_rounds) return false;
      const Event ball = ball_event();
      if (num_active == 0 && ball.tick == kNoTick) return true;
      if (!alone && num_active <= kAlone && num_near <= kAloneNearBall) {
        if (blockIdx.x != 0) return true;
        go_on_alone();
      }
      if (!round(ball, turn)) return false;
    }
  }

  // Lines as they were at the step's begin, of one block.
  __device__ void put_back(const RoundLists& from, std::uint32_t of_segment) {
    const std::uint32_t count = from.num_saved[of_segment];
    const std::uint32_t num = count < from.saved_capacity ? count : from.saved_capacity;
    for (std::uint32_t k = threadIdx.x; k < num; k += kBlock) {
      const SavedLine saved = from.saved[static_cast<std::size_t>(of_segment) * from.saved_capacity + k];
      a.lines.position[saved.index] = saved.line.anchor;
      a.lines.velocity[saved.index] = saved.line.velocity;
      a.lines.tick[saved.index] = saved.line.tick;
      if (a.lines.clock) a.lines.clock[saved.index] = saved.clock;
    }
  }

  __device__ void add_tally() {
    if (num_collisions > 0) {
      atomicAdd(&block_tally->num_collisions, static_cast<unsigned long long>(num_collisions));
      atomicAdd(&block_tally->impulse_sum, static_cast<unsigned long long>(impulse_sum));
      atomicMax(&block_tally->max_overlap_bits, __float_as_uint(max_overlap));
    }
    if (hash != 0) atomicAdd(&block_tally->event_hash, hash);
    __syncthreads();
    if (threadIdx.x == 0) {
      add_slot(launch.slots[blockIdx.x % kNumSlots], *block_tally);
      *block_tally = {};
    }
  }
};

// After the rounds, one warp: totals, the ball and the time move on, or the step is planned anew with half
// the length. next_until: end of the step that follows; 0: none.
__device__ void finish_step_on_device(const ExactLaunch& launch, bool finished, std::uint32_t rounds_stamp) {
  ExactState& state = *launch.state;
  const TallySlot sum = sum_slots(launch.slots[threadIdx.x]);
  launch.slots[threadIdx.x] = {};
  if (threadIdx.x != 0) return;
  state.stamp = rounds_stamp + 1;
  const double after = sqrt(static_cast<double>(__uint_as_float(state.fastest_after_bits)));
  if (finished) {
    add_to_totals(sum, *launch.step_state);
    state.event_hash += sum.event_hash;
    const std::int64_t travel = state.progress.travel;
    const BallSums hits{static_cast<std::int64_t>(sum.ball_x), static_cast<std::int64_t>(sum.ball_y),
                        static_cast<std::int64_t>(sum.ball_torque)};
    const double at_begin = sqrt(static_cast<double>(__uint_as_float(sum.max_speed2_bits)));
    const ExactConstants plan = state.plan;
    ExactProgress progress = state.progress;
    end_step(plan, state.ball, hits, at_begin, after, progress);
    state.progress = progress;
    state.last_travel = progress.travel - travel;
    state.parity ^= 1U;
    state.longest = static_cast<std::uint32_t>(kAnchorPeriod);
    launch.step_state->ball = progress.ball;
  } else {
    state.num_redone += 1;
    const double needed = after > state.ball_fastest_mps ? after : state.ball_fastest_mps;
    if (needed > state.plan.max_speed_mps) state.progress.raised_bound_mps = kSpeedMargin * needed;
    state.longest = state.plan.length / 2 > 1 ? state.plan.length / 2 : 1;
  }
}

__device__ void anchor_parcel(const ExactArrays& a, const ExactState& state, std::uint32_t i) {
  const auto now = static_cast<std::uint32_t>(state.progress.now);
  a.lines.position[i] = a.present[state.parity][i];
  a.lines.tick[i] = now;
  if (a.lines.clock && now - a.lines.clock[i] > kAnchorPeriod)
    a.lines.clock[i] = now - static_cast<std::uint32_t>(kAnchorPeriod);
}

__device__ void clear_counts(const ExactArrays& a, std::uint32_t segment) {
  a.lists.active[0].counts[segment] = 0;
  a.lists.active[1].counts[segment] = 0;
  a.lists.near_ball.counts[segment] = 0;
  a.lists.num_saved[segment] = 0;
  if (segment == 0) a.alone.num_saved[0] = 0;
}

// The rounds of one step, until its end: parts of it that must be redone shorter, too.
template <Boundary kBoundary>
__global__ void __launch_bounds__(kBlock, kRoundBlocksPerSm)
    rounds_kernel(const __grid_constant__ ExactLaunch launch) {
  constexpr std::uint32_t kMostRounds = 10000;
  __shared__ ExactConstants c;
  __shared__ TallySlot block_tally;
  __shared__ std::uint32_t counts[kNumSlotsOfLists];
  cg::grid_group grid = cg::this_grid();
  ExactState& state = *launch.state;
  if (threadIdx.x == 0) block_tally = {};
  while (true) {
    if (threadIdx.x == 0) {
      c = state.plan;
      for (std::uint32_t& count : counts) count = 0;
      const RoundLists& lists = launch.arrays.lists;
      counts[lists.active[0].slot] = lists.active[0].counts[blockIdx.x];
      counts[lists.near_ball.slot] = lists.near_ball.counts[blockIdx.x];
    }
    __syncthreads();
    Rounds<kBoundary> rounds{launch, c, state, &block_tally, counts};
    rounds.look_up();
    const bool rounds_finished = rounds.run(kMostRounds);
    rounds.publish_saved();
    rounds.add_tally();
    if (grid.thread_rank() == 0) state.finished = rounds_finished ? 1U : 0U;
    grid.sync();
    const bool finished = *const_cast<volatile std::uint32_t*>(&state.finished) != 0;
    if (!finished) {
      rounds.put_back(launch.arrays.lists, blockIdx.x);
      if (blockIdx.x == 0) rounds.put_back(launch.arrays.alone, 0);
    }
    if (blockIdx.x == 0 && threadIdx.x < kNumSlots) finish_step_on_device(launch, finished, rounds.stamp);
    grid.sync();
    const bool anchoring = finished && state.progress.now % kAnchorPeriod == 0;
    if (anchoring) {
      for (std::uint32_t i = grid.thread_rank(); i < launch.space.num_parcels; i += grid.size())
        anchor_parcel(launch.arrays, state, i);
    }
    if (threadIdx.x == 0) clear_counts(launch.arrays, blockIdx.x);
    const bool done = state.progress.now >= launch.until;
    if (grid.thread_rank() == 0) {
      const std::uint64_t until = done ? launch.next_until : launch.until;
      if (until > state.progress.now) plan_next(launch.constants, until, state);
    }
    grid.sync();
    if (done) return;
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
    clear_counts(launch.arrays, s);
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

std::uint32_t most_segments() {
  int device = 0, num_sms = 0, blocks = 0;
  PF_CUDA(cudaGetDevice(&device));
  PF_CUDA(cudaDeviceGetAttribute(&num_sms, cudaDevAttrMultiProcessorCount, device));
  int least = kRoundBlocksPerSm;
  for (const auto kernel :
       {rounds_kernel<Boundary::open>, rounds_kernel<Boundary::walls>, rounds_kernel<Boundary::periodic>}) {
    PF_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kBlock, 0));
    least = std::min(least, blocks);
  }
  return static_cast<std::uint32_t>(num_sms * least);
}

}  // namespace

std::uint32_t exact_num_segments(std::uint32_t num_parcels) {
  const std::uint32_t wanted = (num_parcels + kParcelsPerSegment - 1) / kParcelsPerSegment;
  return std::clamp(wanted, 1U, std::max(1U, most_segments()));
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
    PF_CUDA(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(rounds_kernel<kBoundary>),
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
