// Points of a study, shared out over the ranks: each measures some of them with its own threads.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "backend/domains/carrier.hpp"
#include "lab/study.hpp"

namespace pf {

// On rank 0.
class LabRanks {
 public:
  // own_threads: of this rank; 0: one per core. Asks the other ranks, which serve domains, to leave for
  // help_lab(), and waits until they are there.
  LabRanks(std::shared_ptr<Carrier> carrier, unsigned own_threads, const std::atomic<bool>& stop);
  // Waits for what the others still measure, and lets them leave help_lab().
  ~LabRanks();
  LabRanks(const LabRanks&) = delete;
  LabRanks& operator=(const LabRanks&) = delete;

  unsigned num() const { return carrier_->num_ranks(); }

  struct Work {
    std::string study;
    std::vector<LabPoint> points;  // each of them is measured once
    bool in_parallel = false;      // several at a time on each rank; otherwise one on each
  };
  // before(k) and keep(k, rows) are called for each point, on any thread. No point begins after `stop` or
  // after a point threw; a point that threw, on any rank, is rethrown (here as UserError that names the rank)
  // when the running ones have ended.
  void measure(const Work& work, const std::function<void(std::size_t)>& before,
               const std::function<void(std::size_t, nlohmann::json)>& keep);

 private:
  class Queue;
  void hand_out(const Work& work, const std::function<void(std::size_t)>& before, Queue& queue);
  bool take_results(const std::function<void(std::size_t, nlohmann::json)>& keep, Queue& queue);

  std::shared_ptr<Carrier> carrier_;
  unsigned own_threads_;
  const std::atomic<bool>& stop_;
  std::vector<unsigned> threads_;                // of each rank
  std::vector<std::vector<std::size_t>> given_;  // points that each rank measures now
};

// On the other ranks: measures what rank 0 hands out. context: what rank 0 plans with, but for the devices,
// which are this rank's own.
void help_lab(Carrier& carrier, const LabContext& context, unsigned own_threads);

}  // namespace pf
