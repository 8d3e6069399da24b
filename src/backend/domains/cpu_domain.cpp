#include "backend/domains/cpu_domain.hpp"

#include "core/resize.hpp"

namespace pf {
namespace {

// Slot of parcels that the next sort drops: they have left the slab, or are ghosts of the last sort.
constexpr std::uint32_t kDropped = UINT32_MAX;

}  // namespace

CpuDomain::CpuDomain(unsigned index, ThreadTeam& team) : index_(index), team_(team) {}

// Arrays are padded again by finish_appending().
void CpuDomain::append(const Parcel& parcel, std::uint32_t slot) {
  ParcelArrays& to = parcels_.current;
  to.position.push_back(parcel.position);
  to.velocity.push_back(parcel.velocity);
  to.id.push_back(parcel.id);
  to.is_heated.push_back(static_cast<std::uint8_t>(parcel.is_heated));
  to.slot.push_back(slot);
}

void CpuDomain::start_appending(std::size_t num) {
  ParcelArrays& to = parcels_.current;
  const std::size_t total = to.id.size() + num;
  reserve_tightly(to.position, total + kSearchPadding);
  reserve_tightly(to.velocity, total + kSearchPadding);
  reserve_tightly(to.id, total);
  reserve_tightly(to.is_heated, total);
  reserve_tightly(to.slot, total);
  to.position.resize(to.id.size());
  to.velocity.resize(to.id.size());
}

void CpuDomain::finish_appending() {
  const std::size_t num = parcels_.current.id.size();
  parcels_.current.position.resize(num + kSearchPadding);
  parcels_.current.velocity.resize(num + kSearchPadding);
  parcels_.next.resize(num);
  parcels_.sorted = false;
}

void CpuDomain::clear(const Slabs& slabs, std::size_t num) {
  slabs_ = slabs;
  borders_.assign(slabs.num, {});
  ParcelArrays& to = parcels_.current;
  to.position.clear();
  to.velocity.clear();
  to.id.clear();
  to.is_heated.clear();
  to.slot.clear();
  start_appending(num);
  finish_appending();
}

// One pass over all parcels also lists those that copy_margins will look at.
void CpuDomain::release(const StepConstants&, std::int64_t margin, std::vector<std::vector<Parcel>>& out) {
  ParcelArrays& from = parcels_.current;
  const std::int64_t low = slabs_.edge(index_) + margin, high = slabs_.edge(index_ + 1) - margin;
  const std::int64_t first = index_ == 0 ? INT32_MIN : slabs_.edge(index_),
                     end = index_ + 1 == slabs_.num ? INT32_MAX : slabs_.edge(index_ + 1);
  near_.clear();
  for (std::uint32_t i = 0; i < from.id.size(); ++i) {
    const std::int32_t x = from.position[i].x;
    if (from.slot[i] == 0 && x > low && x < high) continue;
    const bool is_ghost = from.slot[i] > parcels_.last_own_slot, is_inside = x >= first && x < end;
    from.slot[i] = 0;
    if (!is_ghost && is_retired(from.position[i])) continue;
    if (!is_ghost && is_inside) {
      near_.push_back(i);
      continue;
    }
    if (!is_ghost) out[slabs_.owner(x)].push_back(from[i]);
    from.position[i] = {kRetired, 0};
    from.slot[i] = kDropped;
  }
  first_adopted_ = static_cast<std::uint32_t>(from.id.size());
}

void CpuDomain::adopt(const std::vector<Parcel>& parcels) {
  if (parcels.empty()) return;
  start_appending(parcels.size());
  for (const Parcel& parcel : parcels) append(parcel, 0);
  finish_appending();
}

void CpuDomain::copy_margins(std::int64_t margin, std::vector<std::vector<Parcel>>& out) {
  ParcelArrays& own = parcels_.current;
  for (std::uint32_t i = first_adopted_; i < own.id.size(); ++i) near_.push_back(i);
  std::vector<Slabs::Span> spans;
  for (unsigned k = 0; k < slabs_.num; ++k) spans.push_back(slabs_.span(k));
  for (Border& border : borders_) border = {};
  num_slots_ = 0;
  for (const std::uint32_t i : near_) {
    const Vec2i position = own.position[i];
    for (unsigned k = 0; k < slabs_.num; ++k) {
      if (k == index_ || slabs_.distance(position.x, spans[k]) > margin) continue;
      if (own.slot[i] == 0) own.slot[i] = ++num_slots_;
      borders_[k].sent.push_back(own.slot[i]);
      out[k].push_back(own[i]);
    }
  }
  parcels_.last_own_slot = num_slots_;
}

void CpuDomain::add_ghosts(unsigned slab, const std::vector<Parcel>& parcels) {
  if (parcels.empty()) return;
  start_appending(parcels.size());
  for (const Parcel& parcel : parcels) {
    append(parcel, ++num_slots_);
    borders_[slab].ghosts.push_back(num_slots_);
  }
  finish_appending();
}

std::int64_t CpuDomain::sort(const StepConstants& constants, std::int64_t margin, PhaseTimes& times) {
  stepper_.sort(constants, slabs_.area(index_, margin), times);
  return stepper_.covered_displacement(constants);
}

// Dropped parcels count as retired, which the sort puts last.
void CpuDomain::drop() {
  ParcelArrays& all = parcels_.current;
  std::size_t kept = parcels_.cell_start[parcels_.grid.num_cells()];
  for (std::size_t i = kept; i < all.id.size(); ++i) {
    if (all.slot[i] == kDropped) continue;
    all.position[kept] = all.position[i];
    all.velocity[kept] = all.velocity[i];
    all.id[kept] = all.id[i];
    all.is_heated[kept] = all.is_heated[i];
    all.slot[kept++] = all.slot[i];
  }
  all.id.resize(kept);
  all.is_heated.resize(kept);
  all.slot.resize(kept);
  all.position.resize(kept + kSearchPadding);
  all.velocity.resize(kept + kSearchPadding);
  parcels_.next.resize(kept);
  parcels_.cell_start.back() = static_cast<std::uint32_t>(kept);
}

void CpuDomain::find_borders() {
  drop();
  place_.resize(num_slots_ + 1);
  const std::vector<std::uint32_t>& slot = parcels_.current.slot;
  for (std::uint32_t i = 0; i < slot.size(); ++i) place_[slot[i]] = i;
  for (Border& border : borders_) {
    for (std::uint32_t& place : border.sent) place = place_[place];
    for (std::uint32_t& place : border.ghosts) place = place_[place];
  }
}

void CpuDomain::pack(unsigned slab, std::vector<ParcelMotion>& out) const {
  out.clear();
  for (const std::uint32_t i : borders_[slab].sent)
    out.push_back(
        {parcels_.current.position[i], parcels_.current.velocity[i], parcels_.current.is_heated[i]});
}

void CpuDomain::unpack(unsigned slab, const std::vector<ParcelMotion>& in) {
  const std::vector<std::uint32_t>& ghosts = borders_[slab].ghosts;
  for (std::size_t k = 0; k < ghosts.size(); ++k) {
    parcels_.current.position[ghosts[k]] = in[k].position;
    parcels_.current.velocity[ghosts[k]] = in[k].velocity;
    parcels_.current.is_heated[ghosts[k]] = static_cast<std::uint8_t>(in[k].is_heated);
  }
  stepper_.add_moved(ghosts);
}

void CpuDomain::visit(const std::function<void(const Parcel&)>& see) const {
  for (std::size_t i = 0; i < parcels_.size(); ++i) {
    if (!parcels_.is_ghost(i)) see(parcels_.current[i]);
  }
}

std::uint64_t CpuDomain::memory_bytes() const {
  std::uint64_t num = place_.capacity() + near_.capacity();
  for (const Border& border : borders_) num += border.sent.capacity() + border.ghosts.capacity();
  return parcels_.memory_bytes() + stepper_.memory_bytes() + sizeof(std::uint32_t) * num;
}

}  // namespace pf
