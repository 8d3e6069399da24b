#include "backend/domains/domain.hpp"

#include <numeric>

namespace pf {

Domain::Domain(unsigned index, ThreadTeam& team) : index_(index), team_(team) {}

// Arrays grow by appending; finish_appending() pads them again.
void Domain::append(const Parcel& parcel) {
  ParcelArrays& to = parcels_.current;
  to.position.push_back(parcel.position);
  to.velocity.push_back(parcel.velocity);
  to.id.push_back(parcel.id);
}

void Domain::finish_appending() {
  const std::size_t num = parcels_.current.id.size();
  ParcelArrays& to = parcels_.current;
  to.position.resize(num + kSearchPadding);
  to.velocity.resize(num + kSearchPadding);
  to.origin.clear();
  parcels_.next.resize(num);
  parcels_.sorted = false;
}

void Domain::reset(const Slabs& slabs, const SpawnPlan& plan) {
  const std::uint64_t num_sites = plan.num_parcels > 0 ? plan.row_start[plan.num_rows] : 0;
  std::vector<std::vector<Parcel>> shares(team_.size());
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, plan.num_parcels);
    for (std::size_t i = begin; i < end; ++i) {
      const Parcel parcel = spawn_parcel(plan, num_sites, static_cast<std::uint32_t>(i));
      if (slabs.owner(parcel.position.x) == index_) shares[thread].push_back(parcel);
    }
  });
  take(slabs, {});
  for (std::vector<Parcel>& share : shares) {
    adopt(share);
    share = {};
  }
}

void Domain::take(const Slabs& slabs, const std::vector<Parcel>& parcels) {
  slabs_ = slabs;
  borders_.assign(slabs.num, {});
  ParcelArrays& to = parcels_.current;
  to.position.clear();
  to.velocity.clear();
  to.id.clear();
  to.origin.clear();
  parcels_.num_own = 0;
  adopt(parcels);
}

void Domain::release(std::vector<std::vector<Parcel>>& out) {
  ParcelArrays& from = parcels_.current;
  const std::int64_t first = index_ == 0 ? INT32_MIN : slabs_.edge(index_),
                     end = index_ + 1 == slabs_.num ? INT32_MAX : slabs_.edge(index_ + 1);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < from.id.size(); ++i) {
    if (parcels_.is_copy(i)) continue;
    const Parcel parcel{from.position[i], from.velocity[i], from.id[i]};
    const std::int32_t x = parcel.position.x;
    if ((x < first || x >= end) && !is_retired(parcel.position)) {
      out[slabs_.owner(x)].push_back(parcel);
      continue;
    }
    from.position[kept] = parcel.position;  // origin, which is_copy() reads, stays until the end
    from.velocity[kept] = parcel.velocity;
    from.id[kept] = parcel.id;
    ++kept;
  }
  from.position.resize(kept);
  from.velocity.resize(kept);
  from.id.resize(kept);
  parcels_.num_own = static_cast<std::uint32_t>(kept);
  finish_appending();
}

void Domain::adopt(const std::vector<Parcel>& parcels) {
  const std::size_t num = parcels_.current.id.size();
  parcels_.current.position.resize(num);
  parcels_.current.velocity.resize(num);
  for (const Parcel& parcel : parcels) append(parcel);
  parcels_.num_own = static_cast<std::uint32_t>(parcels_.current.id.size());
  finish_appending();
}

void Domain::copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out) {
  const ParcelArrays& own = parcels_.current;
  const std::int64_t low = slabs_.edge(index_) + margin, high = slabs_.edge(index_ + 1) - margin;
  for (Border& border : borders_) border = {};
  for (std::uint32_t i = 0; i < parcels_.num_own; ++i) {
    const Vec2i position = own.position[i];
    if (is_retired(position) || (position.x > low && position.x < high)) continue;
    for (unsigned k = 0; k < slabs_.num; ++k) {
      if (k == index_ || slabs_.distance(position.x, k) > margin) continue;
      borders_[k].sent.push_back(i);
      out[k].push_back({position, own.velocity[i], own.id[i]});
    }
  }
}

void Domain::add_copies(unsigned slab, const std::vector<Parcel>& parcels) {
  const std::size_t num = parcels_.current.id.size();
  borders_[slab].first = static_cast<std::uint32_t>(num);
  borders_[slab].num = static_cast<std::uint32_t>(parcels.size());
  if (parcels.empty()) return;
  parcels_.current.position.resize(num);
  parcels_.current.velocity.resize(num);
  for (const Parcel& parcel : parcels) append(parcel);
  finish_appending();
}

void Domain::sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times) {
  std::vector<std::uint32_t>& origin = parcels_.current.origin;
  origin.resize(parcels_.size());
  std::iota(origin.begin(), origin.end(), 0U);
  stepper_.sort(constants, slabs_.area(index_, margin), times);
}

void Domain::find_borders() {
  const std::vector<std::uint32_t>& sorted = parcels_.current.origin;
  place_.resize(sorted.size());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) place_[sorted[i]] = i;
  for (Border& border : borders_) {
    for (std::uint32_t& place : border.sent) place = place_[place];
    border.copies.assign(place_.begin() + border.first, place_.begin() + border.first + border.num);
  }
}

void Domain::pack(unsigned slab, std::vector<ParcelMotion>& out) const {
  out.clear();
  for (const std::uint32_t i : borders_[slab].sent)
    out.push_back({parcels_.current.position[i], parcels_.current.velocity[i]});
}

void Domain::unpack(unsigned slab, const std::vector<ParcelMotion>& in) {
  const std::vector<std::uint32_t>& copies = borders_[slab].copies;
  for (std::size_t k = 0; k < copies.size(); ++k) {
    parcels_.current.position[copies[k]] = in[k].position;
    parcels_.current.velocity[copies[k]] = in[k].velocity;
  }
}

std::uint64_t Domain::memory_bytes() const {
  std::uint64_t num = place_.capacity();
  for (const Border& border : borders_) num += border.sent.capacity() + border.copies.capacity();
  return parcels_.memory_bytes() + stepper_.memory_bytes() + sizeof(std::uint32_t) * num;
}

}  // namespace pf
