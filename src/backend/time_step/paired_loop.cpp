#include "backend/time_step/paired_loop.hpp"

#include <utility>

#include "core/resize.hpp"
#include "model/methods.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

Parcel parcel_at(const ParcelArrays& parcels, std::uint32_t i) {
  return {parcels.position[i], parcels.velocity[i], parcels.id[i]};
}

}  // namespace

ContactSums& PairedLoop::sums_of(std::uint32_t i, Share& share) {
  if (contacts_[i] == 0) {
    share.touched.push_back({i, {}, {}});
    contacts_[i] = static_cast<std::uint32_t>(share.touched.size());
  }
  return share.touched[contacts_[i] - 1].sums;
}

void PairedLoop::add(std::uint32_t i, const ContactSums& sums, Share& share) {
  if (share.holds(i)) {
    sums_of(i, share) += sums;
  } else {
    share.beyond.push_back({i, sums});
  }
}

// A contact adds opposite sums to both, so that it is computed once: for the parcel that reports it.
template <class Contact, Boundary kBoundary>
void PairedLoop::touch(const StepLoop& loop, const SortedParcels& parcels, TouchingPair pair, Share& share,
                       CpuTally& tally) {
  auto [self, other] = pair;
  const std::vector<std::uint32_t>& id = parcels.current.id;
  if (parcels.is_copy(self) || (id[other] < id[self] && !parcels.is_copy(other))) std::swap(self, other);
  if (parcels.is_copy(self)) return;
  const Parcel one = parcel_at(parcels.current, self), two = parcel_at(parcels.current, other);
  if (is_retired(one.position) || is_retired(two.position)) return;
  ContactSums sums;
  const Vec2i offset = separation<kBoundary>(loop.constants.physics.world, one.position, two.position);
  add_contact<Contact>(loop.constants, one, two, offset, sums, tally);
  add(self, sums, share);
  if (!parcels.is_copy(other)) add(other, -sums, share);
}

template <class Contact, Boundary kBoundary>
void PairedLoop::sum_contacts(const StepLoop& loop, const SortedParcels& parcels, Share& share,
                              CpuTally& tally) {
  share.pairs.clear();
  search_.find(loop.space, loop.search, rough_, share.begin, share.end, share.pairs);
  for (const TouchingPair& pair : share.pairs) touch<Contact, kBoundary>(loop, parcels, pair, share, tally);
}

template <bool kBall, Boundary kBoundary>
void PairedLoop::move(const StepLoop& loop, SortedParcels& parcels, Share& share, CpuTally& tally) {
  ParcelArrays& now = parcels.current;
  const auto finish = [&](std::uint32_t i, const ContactSums& sums) {
    return finish_step<kBall, kBoundary>(loop.constants, loop.ball, loop.key, parcel_at(now, i), sums, tally);
  };
  const auto set = [&](std::uint32_t i, const Parcel& after) {
    now.position[i] = after.position;
    now.velocity[i] = after.velocity;
    rough_.set(i, after.position);
  };
  for (TouchedParcel& touched : share.touched) touched.after = finish(touched.parcel, touched.sums);
  share.flights.others.clear();
  const FreeFlight fly = choose_free_flight(kBall, kBoundary);
  fly({loop.constants, loop.ball, loop.key, now.velocity.data(), now.id.data(), now.position.data(),
       rough_.data(), rough_.scale().shift()},
      share.begin, share.end, share.flights);
  tally.moved(share.flights.max_displacement, 0.0F);
  for (const std::uint32_t i : share.flights.others) {
    if (!parcels.is_copy(i) && !is_retired(now.position[i]) && contacts_[i] == 0) set(i, finish(i, {}));
  }
  for (const TouchedParcel& touched : share.touched) {
    set(touched.parcel, touched.after);
    contacts_[touched.parcel] = 0;
  }
}

template <bool kBall, Boundary kBoundary>
void PairedLoop::move_share(const StepLoop& loop, SortedParcels& parcels, unsigned thread, CpuTally& tally) {
  Share& share = shares_[thread];
  for (const Share& other : shares_) {
    for (const PartOfSums& part : other.beyond) {
      if (share.holds(part.parcel)) sums_of(part.parcel, share) += part.sums;
    }
  }
  move<kBall, kBoundary>(loop, parcels, share, tally);
  if (!loop.draw) return;
  for (std::size_t i = share.begin; i < share.end; ++i) {
    draw_parcel(*loop.draw, loop.constants.physics.world, i, parcels.current.position[i],
                parcels.current.velocity[i]);
  }
}

void PairedLoop::run(const StepLoop& loop, Method method, SortedParcels& parcels,
                     std::vector<CpuTally>& tallies) {
  resize_tightly(contacts_, parcels.size());
  if (!parcels.current.slot.empty()) rough_.forget();  // copies have been moved
  rough_.follow(team_, RoughScale(loop.constants), parcels.current.position.data(), parcels.size());
  for (unsigned thread = 0; thread < team_.size(); ++thread) {
    const auto [begin, end] = team_.share(thread, parcels.size());
    Share& share = shares_[thread];
    share.begin = begin;
    share.end = end;
    share.touched.clear();
    share.beyond.clear();
  }
  for_terms(loop.constants.physics, method, [&]<class Contact, bool kBall, Boundary kBoundary>() {
    if constexpr (has_contacts<Contact>) {
      team_.run([&](unsigned thread) {
        sum_contacts<Contact, kBoundary>(loop, parcels, shares_[thread], tallies[thread]);
      });
    }
    team_.run([&](unsigned thread) { move_share<kBall, kBoundary>(loop, parcels, thread, tallies[thread]); });
  });
}

}  // namespace pf
