// The domains of this process, and what all processes do together. Every rank calls the same functions with
// the same arguments; results hold on every rank unless stated otherwise.
#pragma once

#include <exception>
#include <memory>
#include <vector>

#include "backend/backend.hpp"
#include "backend/domains/domain.hpp"
#include "backend/domains/domain_ranks.hpp"

namespace pf {

class DomainGroup {
 public:
  // num_domains: in all; a multiple of the number of ranks. num_threads: of this rank. gpus: null if domains
  // are on processors. carrier and gpus must outlive it.
  DomainGroup(Carrier& carrier, unsigned num_domains, unsigned num_threads, DomainGpus* gpus);
  // Chooses how domains on GPUs exchange motion. Must be called before anything else. Throws UserError on
  // rank 0 if `choice` is not possible.
  void link(LinkChoice choice);

  void reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball);
  void set_physics(const Physics& physics);
  void set_ball(const BallState& ball) { ball_ = ball; }
  // parcels: all of them on rank 0, of which `step` is valid everywhere.
  void restore(const ParcelSnapshot& parcels);
  void resume(const Physics& physics, const BallState& ball, const ParcelSnapshot& parcels);

  // Time-stepped methods only. Ignores request.draw. Times are those of this rank.
  StepReport advance(const StepRequest& request);

  // Result on rank 0 only.
  void gather(ParcelSnapshot& parcels);
  // buffers: of rank 0.
  void draw(const DrawBuffers& buffers);
  // See ParcelImages. Result on rank 0 only.
  std::vector<std::uint32_t> count(const PixelGrid& grid, const CountStyle& style);
  std::vector<DrawnParcel> gather_in(const PixelGrid& grid);
  Measures measure();
  Profile profile(const ProfileShape& shape);
  std::uint64_t state_hash();
  // Memory of all ranks.
  std::uint64_t memory_bytes() const { return memory_bytes_; }
  // 0: a rank has no memory for it.
  double measure_copy_bandwidth(std::size_t num_bytes);

  // Describes how domains on GPUs exchange motion, and why not directly; empty on processors.
  const std::string& link_name() const { return link_name_; }
  const BallState& ball() const { return ball_; }
  unsigned num_threads() const { return team_.size(); }

 private:
  void spawn(const SpawnPlan& plan);
  void distribute(const ParcelSnapshot& parcels);
  void sum_memory();
  // work(domain, its place on this rank), one domain to a thread. Throws the first domain's error.
  template <class Work>
  void for_each_domain(const Work& work) {
    std::vector<std::exception_ptr> errors(domains_.size());
    ThreadTeam& team = gpus_ != nullptr ? gpu_team_ : team_;
    team.run([&](unsigned thread) {
      const auto [begin, end] = team.share(thread, domains_.size());
      for (std::size_t d = begin; d < end; ++d) {
        try {
          work(*domains_[d], d);
        } catch (...) {
          errors[d] = std::current_exception();
        }
      }
    });
    for (const std::exception_ptr& error : errors) {
      if (error != nullptr) std::rethrow_exception(error);
    }
  }
  void sort(const StepConstants& constants, StepReport& report);
  void update_ghosts();
  void step(const StepConstants& constants, const StepRequest& request, const Deadline& deadline,
            StepReport& report);

  Carrier& carrier_;
  DomainRanks ranks_;
  ThreadTeam team_;
  ThreadTeam gpu_team_;  // a thread for each domain, if they are on GPUs
  DomainGpus* gpus_;
  Slabs slabs_;
  std::vector<std::unique_ptr<Domain>> domains_;
  std::unique_ptr<MotionLink> link_;  // null: through the host
  std::string link_name_;
  Physics physics_;
  BallState ball_;
  std::uint64_t step_ = 0;  // since the reset; keys the random roundings
  std::int64_t margin_ = 0;
  std::int64_t displacement_ = 0;      // bound on that of any parcel since the sort, along an axis
  std::int64_t max_displacement_ = 0;  // up to which all searches find all partners
  bool is_sorted_ = false;             // margins and searches are those of the present constants
  bool are_ghosts_current_ = false;    // since the last step
  bool is_time_up_ = false;            // by the clock of rank 0
  std::uint64_t memory_bytes_ = 0;     // since the last sort or reset
  Traffic<ParcelMotion> motion_out_, motion_in_;
  std::vector<std::uint64_t> motion_counts_;
};

}  // namespace pf
