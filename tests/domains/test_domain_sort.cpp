// The sort of one slab against plain loops over its parcels: what leaves, what lies near other slabs, what
// stays.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "backend/domains/cpu_domain.hpp"
#include "domains/domain_pair.hpp"
#include "model/ball.hpp"
#include "model/time_step.hpp"

namespace pf::test {
namespace {

using Parcels = std::map<std::uint32_t, Parcel>;  // by id

Parcels by_id(const std::vector<Parcel>& parcels) {
  Parcels map;
  for (const Parcel& parcel : parcels) EXPECT_TRUE(map.emplace(parcel.id, parcel).second) << parcel.id;
  return map;
}

void expect_same(const Parcels& actual, const Parcels& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  for (const auto& [id, parcel] : expected) {
    const auto found = actual.find(id);
    ASSERT_NE(found, actual.end()) << id;
    EXPECT_EQ(found->second.position, parcel.position) << id;
    EXPECT_EQ(found->second.velocity, parcel.velocity) << id;
  }
}

// The middle one of three slabs, in a dilute gas of which each parcel has the same speed along x. What leaves
// comes back at once, on this side of the border.
class SlabSort : public Domains {
 protected:
  static constexpr unsigned kMiddle = 1;
  static constexpr std::uint32_t kFirstNewId = 100'000;

  void SetUp() override {
    Domains::SetUp();
    if (IsSkipped()) return;
    settings_ = gas(6000);
    settings_.area_fraction = 0.05;
    SceneRun spawned(settings_, make_cpu_backend(1));
    physics_ = spawned.physics;
    slabs_ = {physics_.world, 3};
    margin_ = constants().contact_reach;
    if (are_domains_on_gpus()) {
      gpus_ = domain_gpus();
      domain_ = gpus_->make(kMiddle, 0);
    } else {
      domain_ = std::make_unique<CpuDomain>(kMiddle, team_);
    }
    const ParcelSnapshot snapshot = spawned.backend->snapshot();
    std::vector<Parcel> own;
    for (std::uint32_t id = 0; id < snapshot.position.size(); ++id) {
      const Parcel parcel{snapshot.position[id], {id % 2 == 0 ? kSpeed : -kSpeed, 0.0F}, id};
      if (slabs_.owner(parcel.position.x) == kMiddle) own.push_back(parcel);
    }
    domain_->clear(slabs_, own.size());
    domain_->adopt(own);
    own_ = by_id(own);
  }

  StepConstants constants() const {
    return make_step_constants(physics_, 0.05 * physics_.parcels.radius_m / kSpeed, 0.0);
  }
  Parcels now() const {
    std::vector<Parcel> parcels;
    domain_->visit([&](const Parcel& parcel) { parcels.push_back(parcel); });
    return by_id(parcels);
  }

  Parcel at_random(std::uint32_t id, const Slabs::Span& between) {
    std::uniform_int_distribution<std::int64_t> x(between.low, between.high - 1),
        y(-physics_.world.half.y, physics_.world.half.y - 1);
    return {{static_cast<std::int32_t>(x(random_)), static_cast<std::int32_t>(y(random_))},
            {id % 2 == 0 ? kSpeed : -kSpeed, 0.0F},
            id};
  }

  // Returns how many left.
  std::size_t release(std::vector<Parcel>& come_back) {
    std::vector<std::vector<Parcel>> out(slabs_.num);
    own_ = now();
    domain_->release(constants(), margin_, out);
    Parcels stay, left[3];
    for (const auto& [id, parcel] : own_) {
      const unsigned owner = slabs_.owner(parcel.position.x);
      (owner == kMiddle ? stay : left[owner]).emplace(id, parcel);
    }
    std::size_t num = 0;
    for (unsigned k = 0; k < slabs_.num; ++k) {
      expect_same(by_id(out[k]), left[k]);
      num += out[k].size();
      for (Parcel parcel : out[k]) {
        parcel.position.x =
            static_cast<std::int32_t>(k < kMiddle ? slabs_.edge(kMiddle) : slabs_.edge(kMiddle + 1) - 1);
        come_back.push_back(parcel);
      }
    }
    own_ = stay;
    return num;
  }

  // Returns how many were near another slab.
  std::size_t copy_margins() {
    std::vector<std::vector<Parcel>> out(slabs_.num);
    domain_->copy_margins(margin_, out);
    std::size_t num = 0;
    for (unsigned k = 0; k < slabs_.num; ++k) {
      Parcels near;
      for (const auto& [id, parcel] : own_) {
        if (k != kMiddle && slabs_.distance(parcel.position.x, slabs_.span(k)) <= margin_)
          near.emplace(id, parcel);
      }
      expect_same(by_id(out[k]), near);
      num += near.size();
    }
    return num;
  }

  // Parcels of the neighbours, between two sorts.
  void add_ghosts(std::uint32_t first_id) {
    for (const unsigned k : {kMiddle - 1, kMiddle + 1}) {
      const std::int64_t low = k < kMiddle ? slabs_.edge(kMiddle) - margin_ : slabs_.edge(kMiddle + 1);
      std::vector<Parcel> ghosts;
      for (std::uint32_t j = 0; j < 20; ++j) ghosts.push_back(at_random(first_id++, {low, low + margin_}));
      domain_->add_ghosts(k, ghosts);
    }
  }

  void step_until(std::int64_t max_displacement) {
    const StepConstants c = constants();
    const BallState ball{};
    const TimeStep step{
        c, Method::impulse, Neighbors::grid,
        ball_motion(physics_.world, physics_.ball, ball, fly(physics_.ball, ball, c.dt_s), c.ball_contact_m),
        1};
    for (std::int64_t displacement = 0; displacement <= max_displacement;) {
      domain_->start(step);
      domain_->step_borders();
      const std::int32_t most = domain_->finish().max_displacement;
      ASSERT_GT(most, 0);
      domain_->add_displacement(most);
      displacement += most;
    }
  }

  // `num_new` parcels come in beside those that come back.
  void sort(std::uint32_t num_new, std::uint32_t first_id) {
    std::vector<Parcel> adopted;
    num_left_ += release(adopted);
    for (std::uint32_t j = 0; j < num_new; ++j)
      adopted.push_back(at_random(first_id + j, slabs_.span(kMiddle)));
    domain_->adopt(adopted);
    own_.merge(by_id(adopted));
    num_near_ += copy_margins();
    add_ghosts(first_id + num_new);
    PhaseTimes times;
    const std::int64_t max_displacement = domain_->sort(constants(), margin_, times);
    domain_->find_borders();
    expect_same(now(), own_);
    step_until(max_displacement);
  }

  static constexpr float kSpeed = 1.0F;
  Settings settings_;
  Physics physics_;
  Slabs slabs_;
  std::int64_t margin_ = 0;
  ThreadTeam team_{2};
  std::shared_ptr<DomainGpus> gpus_;
  std::unique_ptr<Domain> domain_;
  Parcels own_;
  std::size_t num_left_ = 0, num_near_ = 0;
  std::mt19937_64 random_{1};
};

TEST_F(SlabSort, FindsWhatLeavesAndWhatIsNear) {
  for (std::uint32_t round = 0; round < 30; ++round) sort(0, kFirstNewId + 100 * round);
  EXPECT_GT(num_left_, 200U);
  EXPECT_GT(num_near_, 200U);
}

// More than it has room for, so that its memory grows between what it sorts.
TEST_F(SlabSort, TakesInManyParcels) {
  sort(0, kFirstNewId);
  sort(12'000, 2 * kFirstNewId);
  sort(0, 3 * kFirstNewId);
}

}  // namespace
}  // namespace pf::test
