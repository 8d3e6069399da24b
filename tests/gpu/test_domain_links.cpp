// Motion between domains on GPUs, directly and through the host: the bits are the same either way.
#include <chrono>
#include <cstdlib>
#include <thread>

#include "core/error.hpp"
#include "cuda/domains/domain_gpus.hpp"
#include "cuda/domains/links.cuh"
#include "domains/domain_pair.hpp"
#include "gpu/gpu_scenes.hpp"

namespace pf::test {
namespace {

std::unique_ptr<Backend> linked(unsigned num_domains, LinkChoice link) {
  return make_domain_backend(std::make_shared<LocalCarrier>(), num_domains, 1, domain_gpus(), link);
}

class DomainLinks : public Gpu, public testing::WithParamInterface<std::tuple<unsigned, LinkChoice>> {};

TEST_P(DomainLinks, GiveTheGoldenStates) {
  const auto [num_domains, link] = GetParam();
  expect_golden_states([=, num = num_domains, choice = link] { return linked(num, choice); });
}

INSTANTIATE_TEST_SUITE_P(Gpu, DomainLinks,
                         testing::Combine(testing::Values(1U, 2U, 3U, 4U, 8U),
                                          testing::Values(LinkChoice::host, LinkChoice::direct)),
                         [](const auto& suite) {
                           const bool is_host = std::get<1>(suite.param) == LinkChoice::host;
                           return std::to_string(std::get<0>(suite.param)) + (is_host ? "Host" : "Direct");
                         });

using Links = Gpu;

TEST_F(Links, AreNamed) {
  EXPECT_NE(linked(2, LinkChoice::direct)->domain_link().find("copies"), std::string::npos);
  EXPECT_EQ(linked(2, LinkChoice::automatic)->domain_link(), linked(2, LinkChoice::direct)->domain_link());
  EXPECT_EQ(linked(2, LinkChoice::host)->domain_link(), "through the host's memory (--domain-link host)");
  EXPECT_EQ(make_cuda_backend(0)->domain_link(), "");
}

// Lets transfers to one domain begin milliseconds late, long after the contacts of own parcels.
class LateLink final : public MotionLink {
 public:
  LateLink(std::unique_ptr<MotionLink> link, const CudaDomain& late) : link_(std::move(link)), late_(late) {}

  std::string name() const override { return link_->name(); }
  void update_ghosts() override {
    const auto sleep = [](void*) { std::this_thread::sleep_for(std::chrono::milliseconds(3)); };
    ASSERT_EQ(cudaLaunchHostFunc(late_.link_stream(), sleep, nullptr), cudaSuccess);
    link_->update_ghosts();
    ++num_updates;
  }

  static inline int num_updates = 0;

 private:
  std::unique_ptr<MotionLink> link_;
  const CudaDomain& late_;
};

class LateGpus final : public DomainGpus {
 public:
  explicit LateGpus(unsigned late) : late_(late) {}

  std::string name() const override { return gpus_->name(); }
  std::unique_ptr<Domain> make(unsigned index, unsigned place) override { return gpus_->make(index, place); }
  void find_sharing(Carrier& carrier) override { gpus_->find_sharing(carrier); }
  void check_room(std::size_t num_parcels, unsigned num_domains, std::uint64_t held_bytes) const override {
    gpus_->check_room(num_parcels, num_domains, held_bytes);
  }
  std::unique_ptr<MotionLink> link(const std::vector<std::unique_ptr<Domain>>& domains, Carrier& carrier,
                                   std::string& why) override {
    return std::make_unique<LateLink>(gpus_->link(domains, carrier, why),
                                      static_cast<const CudaDomain&>(*domains[late_]));
  }
  double measure_copy_bandwidth(std::size_t num_bytes) override {
    return gpus_->measure_copy_bandwidth(num_bytes);
  }

 private:
  std::unique_ptr<DomainGpus> gpus_ = make_domain_gpus();
  unsigned late_;
};

// Nothing is unpacked before it has come, and nothing overwritten that has yet to go.
TEST_F(Links, WaitForLateMotion) {
  for (const unsigned late : {0U, 1U, 2U}) {
    LateLink::num_updates = 0;
    Pair pair(busy_court(Boundary::periodic),
              make_domain_backend(std::make_shared<LocalCarrier>(), 3, 1, std::make_shared<LateGpus>(late),
                                  LinkChoice::direct));
    for (int k = 0; k < 10; ++k) EXPECT_GT(pair.expect_same_steps(12, 2e-4).num_collisions, 0U);
    EXPECT_GT(LateLink::num_updates, 60) << "most steps follow motion, not a sort";
  }
}

// Ranks are threads here. On one GPU they share it, which NCCL has to allow.
class NcclLinks : public Gpu {
 protected:
  void SetUp() override {
    Gpu::SetUp();
    if (IsSkipped()) return;
    if (nccl_version() == 0) GTEST_SKIP() << "the program is built without NCCL";
    if (num_cuda_devices() >= 2) return;
    if (nccl_version() < 23000)
      GTEST_SKIP() << "one GPU, which NCCL " << nccl_version() << " lets no two ranks share";
    setenv("NCCL_MULTI_RANK_GPU_ENABLE", "1", 1);
  }
  void TearDown() override { unsetenv("NCCL_MULTI_RANK_GPU_ENABLE"); }
};

TEST_F(NcclLinks, GiveTheGoldenStatesOfTwoRanks) {
  ThreadRanks ranks(2);
  expect_golden_states([&] { return ranks.make_backend(2, LinkChoice::direct); });
  EXPECT_NE(ranks.make_backend(2)->domain_link().find("NCCL 2."), std::string::npos);
}

TEST_F(NcclLinks, GiveTheSameBitsOfManyParcels) {
  ThreadRanks ranks(2);
  Pair pair(busy_court(Boundary::periodic, 300'000), ranks.make_backend(2, LinkChoice::direct));
  EXPECT_GT(pair.expect_same_steps(40, 5e-5).num_collisions, 0U);
}

// Ranks agree on the host's way, with a reason, or refuse.
TEST_F(Links, OfRanksFallBackTogether) {
  if (num_cuda_devices() >= 2) GTEST_SKIP() << "ranks would have a GPU each";
  unsetenv("NCCL_MULTI_RANK_GPU_ENABLE");
  ThreadRanks ranks(2);
  const std::string name = ranks.make_backend(2)->domain_link();
  EXPECT_EQ(name.find("through the host's memory (NCCL"), 0U) << name;
  EXPECT_NE(name.find(nccl_version() == 0 ? "without it" : "share a GPU"), std::string::npos) << name;
  EXPECT_THROW(ranks.make_backend(2, LinkChoice::direct), UserError);
  Pair pair(busy_court(Boundary::walls), ranks.make_backend(4));
  EXPECT_GT(pair.expect_same_steps(20, 2e-4).num_collisions, 0U);
}

}  // namespace
}  // namespace pf::test
