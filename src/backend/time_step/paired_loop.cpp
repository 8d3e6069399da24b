#include "backend/time_step/paired_loop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/resize.hpp"
#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// Position units. With the longest flight that free_flight.cpp makes it is less than 2^30, which no step may
// reach.
constexpr std::uint32_t kMaxPush = 1 << 22;

}  // namespace

// Wide cells last longer, narrow ones hold fewer candidates. These are fastest at area fractions 0.1 to 0.65
// (N = 10^5). A thinner gas would want wider cells, but a crowd in it would not.
double PairedLoop::cell_width(const GridArea& area, std::size_t num_parcels, double contact_distance) {
  constexpr double kParcelsPerCell = 1.65, kMinWidth = 1.9, kMaxWidth = 4.0;  // widths in contact distances
  const Vec2d extent = to_double(area.high) - to_double(area.low);
  const double area_of_cell =
      kParcelsPerCell * extent.x * extent.y / static_cast<double>(std::max<std::size_t>(num_parcels, 1));
  return std::clamp(std::sqrt(area_of_cell), kMinWidth * contact_distance, kMaxWidth * contact_distance);
}

void PairedLoop::Share::start(std::size_t first, std::size_t last, std::size_t end_of_head) {
  begin = first;
  head_end = end_of_head;
  end = last;
  beyond.clear();
  beyond_begin = std::numeric_limits<std::size_t>::max();
  beyond_end = 0;
}

void PairedLoop::Share::add(std::uint32_t i, const ContactSums& sums, std::vector<std::uint32_t>& contacts) {
  if (i < begin || i >= end) {
    beyond.push_back({i, sums});
    beyond_begin = std::min<std::size_t>(beyond_begin, i);
    beyond_end = std::max<std::size_t>(beyond_end, i + 1);
    return;
  }
  if (contacts[i] == 0) {
    touched.push_back({i, {}});
    contacts[i] = static_cast<std::uint32_t>(touched.size());
  }
  touched[contacts[i] - 1].sums += sums;
}

// A contact adds opposite sums to both, so that it is computed once: for the parcel that reports it. Half a
// period apart, both see the other on the same side.
template <class Contact, Boundary kBoundary>
void PairedLoop::touch(const Work& work, TouchingPair pair) {
  const SortedParcels& parcels = work.parcels;
  auto [self, other] = pair;
  const std::vector<std::uint32_t>& id = parcels.current.id;
  if (parcels.is_ghost(self) || (id[other] < id[self] && !parcels.is_ghost(other))) std::swap(self, other);
  if (parcels.is_ghost(self)) return;
  const Parcel one = parcels.current[self], two = parcels.current[other];
  if (is_retired(one.position) || is_retired(two.position)) return;
  const StepConstants& constants = work.input.constants;
  const World& world = constants.physics.world;
  const Vec2i offset = separation<kBoundary>(world, one.position, two.position),
              back = separation<kBoundary>(world, two.position, one.position);
  ContactSums sums;
  add_contact<Contact>(constants, one, two, offset, sums, work.tally);
  work.share.add(self, sums, contacts_);
  if (parcels.is_ghost(other)) return;
  if (offset.x + back.x == 0 && offset.y + back.y == 0) {
    work.share.add(other, -sums, contacts_);
  } else {
    ContactSums of_other;
    add_contact<Contact>(constants, two, one, back, of_other, work.tally);
    work.share.add(other, of_other, contacts_);
  }
}

void PairedLoop::prefetch(const ParcelArrays& parcels, std::uint32_t i) const {
  __builtin_prefetch(&parcels.position[i]);
  __builtin_prefetch(&parcels.velocity[i]);
  __builtin_prefetch(&parcels.id[i]);
  __builtin_prefetch(&parcels.is_heated[i]);
  __builtin_prefetch(&contacts_[i]);
}

// A parcel is compared with later ones only: it may move as soon as those up to it have been searched, unless
// another share's are compared with it.
template <class Contact, bool kBall, Boundary kBoundary>
void PairedLoop::search_and_move(const Work& work) {
  constexpr std::size_t kBlock = 1024;  // whose state stays in the cache
  constexpr std::size_t kAhead = 8;     // pairs
  const Share& share = work.share;
  std::vector<TouchingPair>& pairs = work.scratch.pairs;
  for (std::size_t begin = share.begin; begin < share.end; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, share.end);
    pairs.clear();
    search_.find(work.input.space, work.input.search, rough_, begin, end, pairs);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (k + kAhead < pairs.size()) prefetch(work.parcels.current, pairs[k + kAhead].second);
      touch<Contact, kBoundary>(work, pairs[k]);
    }
    if (end > share.head_end) move<kBall, kBoundary>(work, std::max(begin, share.head_end), end);
  }
}

// Lists the parcels begin .. end - 1 that touch others in scratch.due, and no longer in share.touched.
void PairedLoop::list_due(const Work& work, std::size_t begin, std::size_t end) {
  Share& share = work.share;
  std::vector<TouchedParcel>& due = work.scratch.due;
  due.clear();
  std::size_t num_kept = 0;
  for (const TouchedParcel& touched : share.touched) {
    if (touched.parcel >= begin && touched.parcel < end) {
      due.push_back(touched);
      contacts_[touched.parcel] = static_cast<std::uint32_t>(due.size());
    } else {
      share.touched[num_kept] = touched;
      contacts_[touched.parcel] = static_cast<std::uint32_t>(++num_kept);
    }
  }
  share.touched.resize(num_kept);
}

// Applies the contacts of the parcels that are due, so that they fly on like those that touch none. Returns a
// bound on how far they are pushed, position units. One that is pushed farther gets NaN for a velocity, so
// that the free flight leaves it to finish_step(), which starts from its state before.
std::int32_t PairedLoop::apply_contacts(const Work& work) {
  const StepConstants& constants = work.input.constants;
  ParcelArrays& now = work.parcels.current;
  Scratch& scratch = work.scratch;
  std::uint32_t farthest = 0;
  scratch.before.clear();
  for (const TouchedParcel& touched : scratch.due) {
    const std::uint32_t i = touched.parcel;
    scratch.before.push_back(now[i]);
    const Vec2i push = push_after(touched.sums);
    const std::uint32_t pushed = std::max(magnitude(push.x), magnitude(push.y));
    now.velocity[i] = velocity_after(constants, now.velocity[i], touched.sums);
    if (pushed > kMaxPush) {
      now.velocity[i].x = std::numeric_limits<float>::quiet_NaN();
    } else {
      now.position[i] += push;
      farthest = std::max(farthest, pushed);
    }
  }
  return static_cast<std::int32_t>(farthest);
}

template <bool kBall, Boundary kBoundary>
void PairedLoop::move(const Work& work, std::size_t begin, std::size_t end) {
  const StepInput& input = work.input;
  const SortedParcels& parcels = work.parcels;
  ParcelArrays& now = work.parcels.current;
  auto& [pairs, due, before_step, flights] = work.scratch;
  CpuTally& tally = work.tally;
  list_due(work, begin, end);
  const std::int32_t farthest_push = apply_contacts(work);
  flights.others.clear();
  const FreeFlight fly = choose_free_flight(kBall, kBoundary);
  fly({input.constants, input.ball, input.key, now.velocity.data(), now.id.data(), now.position.data(),
       rough_.data(), rough_.scale().shift()},
      begin, end, flights);
  tally.moved(flights.max_displacement + farthest_push);
  std::fill_n(now.is_heated.data() + begin, end - begin, std::uint8_t{0});
  for (const std::uint32_t i : flights.others) {
    if (parcels.is_ghost(i) || is_retired(now.position[i])) continue;
    const bool is_due = contacts_[i] != 0;
    const Parcel before = is_due ? before_step[contacts_[i] - 1] : now[i];
    const ContactSums sums = is_due ? due[contacts_[i] - 1].sums : ContactSums{};
    const Parcel after =
        finish_step<kBall, kBoundary>(input.constants, input.ball, input.key, before, sums, tally);
    now.position[i] = after.position;
    now.velocity[i] = after.velocity;
    now.is_heated[i] = static_cast<std::uint8_t>(after.is_heated);
    rough_.set(i, after.position);
    contacts_[i] = 0;
  }
  for (std::size_t k = 0; k < due.size(); ++k) {
    const TouchedParcel& touched = due[k];
    const std::uint32_t i = touched.parcel;
    if (contacts_[i] == 0) continue;
    const Vec2f before = before_step[k].velocity, after = now.velocity[i];
    now.is_heated[i] = static_cast<std::uint8_t>(is_heated_by(touched.sums, before, after));
    contacts_[i] = 0;
  }
}

template <bool kBall, Boundary kBoundary>
void PairedLoop::move_head(const Work& work) {
  Share& share = work.share;
  for (std::size_t k = 0; k < num_shares_; ++k) {
    const Share& other = shares_[k];
    if (other.beyond_begin >= share.end || other.beyond_end <= share.begin) continue;
    for (const TouchedParcel& part : other.beyond) {
      if (share.holds(part.parcel)) share.add(part.parcel, part.sums, contacts_);
    }
  }
  move<kBall, kBoundary>(work, share.begin, share.head_end);
  if (!work.input.draw) return;
  const ParcelArrays& now = work.parcels.current;
  for (std::size_t i = share.begin; i < share.end; ++i)
    draw_parcel(*work.input.draw, work.input.constants.physics.world, i, now.position[i], now.velocity[i]);
}

void PairedLoop::divide(const SortedParcels& parcels, bool has_contacts) {
  const std::size_t num_parcels = parcels.size();
  const bool is_in_one_pass = has_contacts && (team_.size() == 1 || !search_.has_boxes());
  num_shares_ = team_.num_parts(num_parcels, min_parcels_together(parcels.grid, num_parcels));
  if (shares_.size() < num_shares_) shares_.resize(num_shares_);
  std::size_t reach = 0;  // of the shares before
  for (std::size_t k = 0; k < num_shares_; ++k) {
    const auto [begin, end] = ThreadTeam::share(k, num_shares_, num_parcels);
    shares_[k].start(begin, end, is_in_one_pass ? std::clamp(reach, begin, end) : end);
    if (is_in_one_pass) reach = std::max(reach, search_.reach(end) + kSearchPadding);
  }
}

void PairedLoop::run(const StepInput& input, Method method, SortedParcels& parcels,
                     std::vector<CpuTally>& tallies) {
  resize_tightly(contacts_, parcels.size());
  rough_.follow(team_, RoughScale(input.constants), parcels.current.position.data(), parcels.size());
  divide(parcels, input.constants.physics.parcels.contacts);
  for_terms(input.constants.physics, method, [&]<class Contact, bool kBall, Boundary kBoundary>() {
    if constexpr (has_contacts<Contact>) {
      team_.run_parts(num_shares_, [&](unsigned thread, std::size_t k) {
        search_and_move<Contact, kBall, kBoundary>(
            {input, parcels, shares_[k], scratch_[thread], tallies[thread]});
      });
    }
    team_.run_parts(num_shares_, [&](unsigned thread, std::size_t k) {
      move_head<kBall, kBoundary>({input, parcels, shares_[k], scratch_[thread], tallies[thread]});
    });
  });
}

}  // namespace pf
