#include "backend/time_step/paired_loop.hpp"

#include "core/resize.hpp"
#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

Parcel parcel_at(const ParcelArrays& parcels, std::uint32_t i) {
  return {parcels.position[i], parcels.velocity[i], parcels.id[i]};
}

}  // namespace

void PairedLoop::find_pairs(const StepLoop& loop, Share& share) const {
  share.pairs.clear();
  share.beyond.clear();
  search_.find(loop.space, loop.search, rough_, share.begin, share.end, share.pairs);
  for (const TouchingPair& pair : share.pairs)
    if (!share.holds(pair.second)) share.beyond.push_back(pair);
}

ContactSums& PairedLoop::sums_of(std::uint32_t i, Share& share) {
  if (contacts_[i] == 0) {
    share.touched.push_back({i, {}});
    contacts_[i] = static_cast<std::uint32_t>(share.touched.size());
  }
  return share.touched[contacts_[i] - 1].sums;
}

template <class Contact, Boundary kBoundary>
void PairedLoop::add(const StepLoop& loop, const SortedParcels& parcels, std::uint32_t self,
                     std::uint32_t other, Share& share, CpuTally& tally) {
  const Parcel one = parcel_at(parcels.current, self), two = parcel_at(parcels.current, other);
  if (is_retired(one.position) || parcels.is_copy(self)) return;
  const Vec2i offset = separation<kBoundary>(loop.constants.physics.world, one.position, two.position);
  add_contact<Contact>(loop.constants, one, two, offset, sums_of(self, share), tally);
}

template <class Contact, Boundary kBoundary>
void PairedLoop::sum_contacts(const StepLoop& loop, const SortedParcels& parcels, Share& share,
                              CpuTally& tally) {
  for (const TouchingPair& pair : share.pairs) {
    add<Contact, kBoundary>(loop, parcels, pair.first, pair.second, share, tally);
    if (share.holds(pair.second))
      add<Contact, kBoundary>(loop, parcels, pair.second, pair.first, share, tally);
  }
  for (const Share& other : shares_) {
    for (const TouchingPair& pair : other.beyond) {
      if (share.holds(pair.second))
        add<Contact, kBoundary>(loop, parcels, pair.second, pair.first, share, tally);
    }
  }
}

template <bool kBall, Boundary kBoundary>
void PairedLoop::move(const StepLoop& loop, SortedParcels& parcels, Share& share, CpuTally& tally) {
  const ParcelArrays& now = parcels.current;
  ParcelArrays& next = parcels.next;
  share.flights.others.clear();
  const FreeFlight fly = choose_free_flight(kBall, kBoundary);
  fly({loop.constants, loop.ball, loop.key, now.position.data(), now.velocity.data(), now.id.data(),
       contacts_.data(), next.position.data(), next.velocity.data(), rough_.data(), rough_.scale().shift()},
      share.begin, share.end, share.flights);
  tally.moved(share.flights.max_displacement, share.flights.max_speed2);
  for (const std::uint32_t i : share.flights.others) {
    if (parcels.is_copy(i)) continue;
    const Parcel self = parcel_at(now, i);
    const ContactSums sums = contacts_[i] == 0 ? ContactSums{} : share.touched[contacts_[i] - 1].sums;
    const Parcel after =
        is_retired(self.position)
            ? self
            : finish_step<kBall, kBoundary>(loop.constants, loop.ball, loop.key, self, sums, tally);
    next.position[i] = after.position;
    next.velocity[i] = after.velocity;
    rough_.set(i, after.position);
  }
}

template <class Contact, bool kBall, Boundary kBoundary>
void PairedLoop::run_share(const StepLoop& loop, SortedParcels& parcels, unsigned thread, CpuTally& tally) {
  Share& share = shares_[thread];
  share.touched.clear();
  if constexpr (has_contacts<Contact>) sum_contacts<Contact, kBoundary>(loop, parcels, share, tally);
  move<kBall, kBoundary>(loop, parcels, share, tally);
  for (const TouchedParcel& touched : share.touched) contacts_[touched.parcel] = 0;
  if (!loop.draw) return;
  for (std::size_t i = share.begin; i < share.end; ++i) {
    draw_parcel(*loop.draw, loop.constants.physics.world, i, parcels.next.position[i],
                parcels.next.velocity[i]);
  }
}

void PairedLoop::run(const StepLoop& loop, Method method, SortedParcels& parcels,
                     std::vector<CpuTally>& tallies) {
  resize_tightly(contacts_, parcels.size());
  if (!parcels.current.slot.empty()) rough_.forget();  // copies have been moved
  rough_.follow(team_, RoughScale(loop.constants), parcels.current.position.data(), parcels.size());
  const Physics& physics = loop.constants.physics;
  team_.run([&](unsigned thread) {
    Share& share = shares_[thread];
    const ThreadTeam::Share part = team_.share(thread, parcels.size());
    share.begin = part.begin;
    share.end = part.end;
    if (physics.parcels.contacts) find_pairs(loop, share);
  });
  const auto run_share = for_terms(physics, method, []<class Contact, bool kBall, Boundary kBoundary>() {
    return &PairedLoop::run_share<Contact, kBall, kBoundary>;
  });
  team_.run([&](unsigned thread) { (this->*run_share)(loop, parcels, thread, tallies[thread]); });
}

}  // namespace pf
