// Which rank holds which domain, and what goes between them.
#pragma once

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "backend/domains/carrier.hpp"

namespace pf {

// out[d][k]: from this rank's domain d to domain k. in[d][k]: the reverse.
template <class T>
using Traffic = std::vector<std::vector<std::vector<T>>>;

// Ranks hold equally many domains, in order. All functions but the first ones are called by all ranks.
class DomainRanks {
 public:
  // num_domains: a multiple of the number of ranks. carrier must outlive it.
  DomainRanks(Carrier& carrier, unsigned num_domains) : carrier_(carrier), num_domains_(num_domains) {}

  unsigned num_domains() const { return num_domains_; }
  unsigned rank_of(unsigned domain) const { return domain / num_local(); }
  unsigned num_local() const { return num_domains_ / carrier_.num_ranks(); }
  unsigned first_local() const { return carrier_.rank() * num_local(); }
  bool is_first() const { return carrier_.rank() == 0; }

  template <class T>
  Traffic<T> empty_traffic() const {
    return Traffic<T>(num_local(), std::vector<std::vector<T>>(num_domains_));
  }

  // Numbers of items from domain a to domain b, [a * num_domains + b].
  template <class T>
  std::vector<std::uint64_t> all_counts(const Traffic<T>& out) {
    std::vector<std::uint64_t> mine, all(num_domains_ * num_domains_);
    for (const auto& from : out) {
      for (const std::vector<T>& items : from) mine.push_back(items.size());
    }
    carrier_.all_gather(mine.data(), mine.size() * sizeof(mine[0]), all.data());
    return all;
  }

  // counts: all_counts(out). Vectors keep their memory.
  template <class T>
  void exchange(Traffic<T>& out, Traffic<T>& in, const std::vector<std::uint64_t>& counts) {
    std::vector<Outgoing> leaving;
    std::vector<Incoming> coming;
    const auto tag = [&](unsigned from, unsigned to) { return static_cast<int>(from * num_domains_ + to); };
    for (unsigned d = 0; d < num_local(); ++d) {
      const unsigned own = first_local() + d;
      for (unsigned k = 0; k < num_domains_; ++k) {
        if (rank_of(k) == carrier_.rank()) {
          std::swap(in[k - first_local()][own], out[d][k]);
          continue;
        }
        const std::vector<T>& sent = out[d][k];
        std::vector<T>& items = in[d][k];
        items.resize(counts[k * num_domains_ + own]);
        if (!sent.empty()) leaving.push_back({rank_of(k), tag(own, k), sent.data(), sent.size() * sizeof(T)});
        if (!items.empty())
          coming.push_back({rank_of(k), tag(k, own), items.data(), items.size() * sizeof(T)});
      }
    }
    carrier_.exchange(leaving, coming);
  }

  // One item of each rank, in order.
  template <class T>
  std::vector<T> all_of(const T& mine) {
    std::vector<T> all(carrier_.num_ranks());
    carrier_.all_gather(&mine, sizeof(T), all.data());
    return all;
  }

  // On rank 0 the items of all ranks, in order; elsewhere nothing.
  template <class T>
  std::vector<T> gather(std::vector<T> mine) {
    const std::size_t num_mine = mine.size();
    const std::vector<std::uint64_t> nums = all_of<std::uint64_t>(num_mine);
    if (!is_first()) {
      if (!mine.empty()) carrier_.exchange({{0, 0, mine.data(), mine.size() * sizeof(T)}}, {});
      return {};
    }
    std::vector<T> all = std::move(mine);
    all.resize(std::accumulate(nums.begin(), nums.end(), std::size_t{0}));
    std::vector<Incoming> in;
    T* next = all.data() + num_mine;
    for (unsigned r = 1; r < nums.size(); ++r) {
      if (nums[r] > 0) in.push_back({r, 0, next, nums[r] * sizeof(T)});
      next += nums[r];
    }
    carrier_.exchange({}, in);
    return all;
  }

 private:
  Carrier& carrier_;
  unsigned num_domains_;
};

}  // namespace pf
