#include "exact_motion.cuh"

#include <cmath>

namespace pf {
namespace {

constexpr std::uint32_t kLeastInSegment = 64;    // where parcels are few
constexpr std::uint32_t kLeastAlone = 4 * 2048;  // several times what one block takes over

// One parcel in so many may have an event, be lowered, change, be flagged, be near the ball.
constexpr std::uint32_t kShares[6] = {4, 4, 4, 8, 8, 16};
constexpr std::uint32_t kSavedShare = 8;

}  // namespace

void DeviceExact::reset_time() {
  active_ = false;
  time_s_ = 0.0;
  now_ = 0;
}

RoundLists DeviceExact::Lists::view() const {
  RoundLists v;
  SegmentedList* const views[6] = {&v.active[0], &v.active[1], &v.lowered,
                                   &v.changed,   &v.flagged,   &v.near_ball};
  for (std::uint32_t k = 0; k < 6; ++k) {
    *views[k] = list[k].view();
    views[k]->slot = k;
  }
  v.saved = saved.data();
  v.num_saved = num_saved.data();
  v.saved_capacity = saved_capacity;
  return v;
}

std::size_t DeviceExact::Lists::bytes() const {
  std::size_t sum = saved.bytes() + num_saved.bytes();
  for (const List& one : list) sum += one.items.bytes() + one.counts.bytes();
  return sum;
}

// Room in each segment for one in `share` of its parcels, and `least` more.
DeviceExact::Lists DeviceExact::make_lists(std::uint32_t num_parcels, std::uint32_t num_segments,
                                           std::uint32_t least) {
  const auto capacity = [&](std::uint32_t share) { return num_parcels / (num_segments * share) + least; };
  Lists lists;
  for (int k = 0; k < 6; ++k) {
    lists.list[k].capacity = capacity(kShares[k]);
    lists.list[k].items =
        DeviceBuffer<std::uint32_t>(static_cast<std::size_t>(lists.list[k].capacity) * num_segments);
    lists.list[k].counts = DeviceBuffer<std::uint32_t>(num_segments);
  }
  lists.saved_capacity = capacity(kSavedShare);
  lists.saved = DeviceBuffer<SavedLine>(static_cast<std::size_t>(lists.saved_capacity) * num_segments);
  lists.num_saved = DeviceBuffer<std::uint32_t>(num_segments);
  return lists;
}

void DeviceExact::reserve(std::uint32_t num_parcels) {
  if (num_parcels == reserved_) return;
  num_segments_ = exact_num_segments(num_parcels);
  lists_ = {};
  lists_ = make_lists(num_parcels, num_segments_, kLeastInSegment);
  alone_ = make_lists(0, 1, kLeastAlone);
  reserved_ = num_parcels;
}

std::size_t DeviceExact::bytes() const { return lists_.bytes() + alone_.bytes(); }

void DeviceExact::complete(const Memory& memory, ExactLaunch& launch) const {
  ExactArrays& a = launch.arrays;
  a.lines = memory.lines;
  a.present[0] = memory.free.position;
  a.present[1] = reinterpret_cast<Vec2i*>(memory.free.velocity);
  a.mark = memory.free.tick;
  a.event_tick = memory.scratch[0];
  a.event_partner = memory.scratch[1];
  a.bound = memory.scratch[2];
  a.lists = lists_.view();
  a.alone = alone_.view();
  a.num_segments = num_segments_;
  launch.state = state_.data();
}

void DeviceExact::enter(const ExactLaunch& launch, cudaStream_t stream) {
  now_ = static_cast<std::uint64_t>(std::llround(time_s_ / launch.constants.tick_s));
  launch_exact_enter(launch, now_, stream);
  active_ = true;
}

std::vector<std::uint64_t> DeviceExact::plan(const StepRequest& request, double tick_s) {
  std::vector<std::uint64_t> ends;
  const double start_s = time_s_;
  for (std::uint32_t k = 1; k <= request.num_steps; ++k) {
    time_s_ = start_s + k * request.dt_s;
    const auto end = static_cast<std::uint64_t>(std::llround(time_s_ / tick_s));
    if (end > now_) ends.push_back(now_ = end);
  }
  return ends;
}

}  // namespace pf
