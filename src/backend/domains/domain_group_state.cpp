// The state of all domains as others set and read it.
#include <algorithm>
#include <exception>

#include "backend/domains/domain_group.hpp"
#include "backend/processor.hpp"
#include "model/spawn.hpp"

namespace pf {

void DomainGroup::reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) {
  physics_ = physics;
  ball_ = ball;
  step_ = 0;
  is_sorted_ = false;
  slabs_.world = physics.world;
  spawn(plan);
  sum_memory();
}

// Spawns all parcels, and keeps those of this rank.
void DomainGroup::spawn(const SpawnPlan& plan) {
  const std::uint64_t num_sites = plan.num_parcels > 0 ? plan.row_start[plan.num_rows] : 0;
  std::vector<std::vector<std::vector<Parcel>>> shares(domains_.size());  // by domain, then thread
  for (auto& share : shares) share.resize(team_.size());
  team_.run([&](unsigned thread) {
    const auto [begin, end] = team_.share(thread, plan.num_parcels);
    for (std::size_t i = begin; i < end; ++i) {
      const Parcel parcel = spawn_parcel(plan, num_sites, static_cast<std::uint32_t>(i));
      const unsigned local = slabs_.owner(parcel.position.x) - ranks_.first_local();  // wraps below the first
      if (local < domains_.size()) shares[local][thread].push_back(parcel);
    }
  });
  for (std::size_t d = 0; d < domains_.size(); ++d) {
    std::size_t num = 0;
    for (const std::vector<Parcel>& parcels : shares[d]) num += parcels.size();
    domains_[d]->clear(slabs_, num);
    for (std::vector<Parcel>& parcels : shares[d]) {
      domains_[d]->adopt(parcels);
      parcels = {};
    }
  }
}

void DomainGroup::set_physics(const Physics& physics) {
  physics_ = physics;
  is_sorted_ = false;
}

void DomainGroup::restore(const ParcelSnapshot& parcels) {
  step_ = parcels.step;
  is_sorted_ = false;
  distribute(parcels);
}

void DomainGroup::resume(const Physics& physics, const BallState& ball, const ParcelSnapshot& parcels) {
  physics_ = physics;
  slabs_.world = physics.world;
  ball_ = ball;
  restore(parcels);
}

// Parcels that have left the world stay with the first domain.
void DomainGroup::distribute(const ParcelSnapshot& parcels) {
  Traffic<Parcel> out = ranks_.empty_traffic<Parcel>(), in = ranks_.empty_traffic<Parcel>();
  if (ranks_.is_first()) {
    auto heated = parcels.heated.begin();
    for (std::size_t i = 0; i < parcels.position.size(); ++i) {
      const Vec2i position = parcels.position[i];
      const unsigned owner = is_retired(position) ? 0 : slabs_.owner(position.x);
      const bool is_heated = heated != parcels.heated.end() && *heated == i;
      if (is_heated) ++heated;
      out[0][owner].push_back(
          {position, parcels.velocity[i], static_cast<std::uint32_t>(i), is_heated ? 1U : 0U});
    }
  }
  ranks_.exchange(out, in, ranks_.all_counts(out));
  for (unsigned d = 0; d < domains_.size(); ++d) {
    domains_[d]->clear(slabs_, in[d][0].size());
    domains_[d]->adopt(in[d][0]);
  }
  sum_memory();
}

void DomainGroup::gather(ParcelSnapshot& parcels) {
  const bool is_first = ranks_.is_first();
  const std::size_t num = is_first ? static_cast<std::size_t>(physics_.parcels.num) : 0;
  parcels.position.resize(num);
  parcels.velocity.resize(num);
  parcels.heated.clear();
  parcels.step = step_;
  const auto place = [&](const Parcel& parcel) {
    parcels.position[parcel.id] = parcel.position;
    parcels.velocity[parcel.id] = parcel.velocity;
    if (parcel.is_heated != 0) parcels.heated.push_back(parcel.id);
  };
  std::vector<Parcel> mine;
  for (const auto& domain : domains_) {
    domain->visit([&](const Parcel& parcel) {
      if (is_first) return place(parcel);
      mine.push_back(parcel);
    });
  }
  for (const Parcel& parcel : ranks_.gather(std::move(mine))) place(parcel);
  std::ranges::sort(parcels.heated);
}

void DomainGroup::draw(const DrawBuffers& buffers) {
  std::vector<DrawnParcel> mine;
  std::size_t num = 0;
  for (const auto& domain : domains_) {
    domain->visit([&](const Parcel& parcel) {
      if (ranks_.is_first()) {
        draw_parcel(buffers, physics_.world, num++, parcel.position, parcel.velocity);
        return;
      }
      mine.push_back(drawn_parcel(physics_.world, parcel.position, parcel.velocity));
    });
  }
  for (const DrawnParcel& drawn : ranks_.gather(std::move(mine))) {
    buffers.position_m[num] = drawn.position_m;
    buffers.speed_mps[num++] = drawn.speed_mps;
  }
}

std::vector<std::uint32_t> DomainGroup::count(const PixelGrid& grid, const CountStyle& style) {
  const std::size_t num = std::size_t{grid.width} * grid.height;
  std::vector<std::vector<std::uint32_t>> images(domains_.size());
  for_each_domain([&](Domain& domain, std::size_t d) {
    images[d].resize(num);
    domain.count(grid, style, images[d]);
  });
  std::vector<std::uint32_t> sum = std::move(images[0]);
  for (std::size_t d = 1; d < images.size(); ++d) {
    for (std::size_t k = 0; k < num; ++k) sum[k] += images[d][k];
  }
  std::vector<std::uint32_t> all = ranks_.gather(std::move(sum));
  for (std::size_t first = num; first < all.size(); first += num) {
    for (std::size_t k = 0; k < num; ++k) all[k] += all[first + k];
  }
  all.resize(std::min(all.size(), num));
  return all;
}

std::vector<DrawnParcel> DomainGroup::gather_in(const PixelGrid& grid) {
  std::vector<DrawnParcel> mine;
  for (const auto& domain : domains_) domain->gather(grid, mine);
  return ranks_.gather(std::move(mine));
}

// Summed in the order of domains: with other numbers of domains the sums may differ in their last bits.
Measures DomainGroup::measure() {
  Measures mine;
  for (const auto& domain : domains_) mine += domain->sums(physics_.parcels.mass_kg).measures;
  Measures total;
  for (const Measures& sum : ranks_.all_of(mine)) total += sum;
  add_ball(physics_.ball, ball_, total);
  return total;
}

Profile DomainGroup::profile(const ProfileShape& shape) {
  Profile mine = empty_profile(shape);
  for (const auto& domain : domains_) domain->add_to(mine);
  const std::vector<ProfileSums> all = ranks_.gather(mine.bins);
  for (std::size_t k = mine.bins.size(); k < all.size(); ++k) mine.bins[k % mine.bins.size()] += all[k];
  return mine;
}

std::uint64_t DomainGroup::state_hash() {
  std::uint64_t mine = 0;
  for (const auto& domain : domains_) mine += domain->sums(physics_.parcels.mass_kg).hash;
  std::uint64_t hash = physics_.ball.exists ? ball_hash(ball_) : 0;
  for (const std::uint64_t sum : ranks_.all_of(mine)) hash += sum;
  return hash;
}

void DomainGroup::sum_memory() {
  std::uint64_t mine = 0;
  for (const auto& domain : domains_) mine += domain->memory_bytes();
  memory_bytes_ = 0;
  for (const std::uint64_t bytes : ranks_.all_of(mine)) memory_bytes_ += bytes;
}

double DomainGroup::measure_copy_bandwidth(std::size_t num_bytes) {
  double mine = 0.0;
  try {
    mine = gpus_ != nullptr ? gpus_->measure_copy_bandwidth(num_bytes)
                            : pf::measure_copy_bandwidth(team_, num_bytes);
  } catch (const std::exception&) {  // no memory for the copy; the other ranks wait for this one
  }
  double total = 0.0;
  for (const double bandwidth : ranks_.all_of(mine)) {
    if (bandwidth == 0.0) return 0.0;
    total += bandwidth;
  }
  return total;
}

}  // namespace pf
