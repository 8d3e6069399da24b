#include "backend/domains/domain_group.hpp"

#include <algorithm>
#include <cmath>

#include "backend/domains/cpu_domain.hpp"
#include "core/error.hpp"
#include "model/time_step.hpp"

namespace pf {
namespace {

// Width of the margin, in contact distances, on processors and on GPUs; in a dilute gas, whose cells are
// wider, in mean distances of parcels. It does not affect results. Cells set how far parcels may move until
// the next sort; the margin of processors cuts that short by a seventh at most, that of GPUs does not.
constexpr double kMarginWidth = 3.0, kGpuMarginWidth = 4.75, kDiluteMarginWidth = 0.75;

// The result of a step on a rank. Every rank gets those of all.
struct StepOutcome {
  CpuTally tally;
  bool is_time_up = false;
};

std::int64_t margin_of(const StepConstants& constants, std::uint32_t num_parcels, double width) {
  const World& world = constants.physics.world;
  const double area = 4.0 * world.half.x * static_cast<double>(world.half.y);
  const double spacing = std::sqrt(area / (num_parcels + 1.0));
  return static_cast<std::int64_t>(
      std::ceil(std::fmax(width * constants.contact_distance, kDiluteMarginWidth * spacing)));
}

}  // namespace

DomainGroup::DomainGroup(Carrier& carrier, unsigned num_domains, unsigned num_threads, DomainGpus* gpus)
    : carrier_(carrier),
      ranks_(carrier, num_domains),
      team_(num_threads),
      gpu_team_(gpus == nullptr ? 1 : ranks_.num_local()),
      gpus_(gpus) {
  slabs_.num = num_domains;
  for (unsigned d = 0; d < ranks_.num_local(); ++d) {
    const unsigned index = ranks_.first_local() + d, place = carrier.rank_here() * ranks_.num_local() + d;
    if (gpus != nullptr) {
      domains_.push_back(gpus->make(index, place));
    } else {
      domains_.push_back(std::make_unique<CpuDomain>(index, team_));
    }
  }
}

void DomainGroup::link(LinkChoice choice) {
  if (gpus_ == nullptr) return;
  gpus_->find_sharing(carrier_);
  std::string why = "--domain-link host";
  if (choice != LinkChoice::host) link_ = gpus_->link(domains_, carrier_, why);
  link_name_ = link_ != nullptr ? link_->name() : "through the host's memory (" + why + ")";
  if (choice == LinkChoice::direct && link_ == nullptr && ranks_.is_first())
    throw UserError("--domain-link: direct cannot be had: " + why + "; give auto or host");
}

StepReport DomainGroup::advance(const StepRequest& request) {
  StepReport report;
  const StepConstants constants = make_step_constants(physics_, request.dt_s, request.spring_contact_s);
  const Deadline deadline(request.budget_ms);
  is_time_up_ = false;
  for (std::uint32_t k = 0; k < request.num_steps && !is_time_up_; ++k) {
    if (physics_.parcels.contacts && (!is_sorted_ || displacement_ > max_displacement_)) {
      sort(constants, report);
      are_ghosts_current_ = true;
    }
    step(constants, request, deadline, report);
  }
  report.ball = ball_;
  return report;
}

void DomainGroup::sort(const StepConstants& constants, StepReport& report) {
  {
    ScopedPhase timing(report.times, Phase::sort);
    Traffic<Parcel> out = ranks_.empty_traffic<Parcel>(), in = ranks_.empty_traffic<Parcel>();
    margin_ = margin_of(constants, physics_.parcels.num, gpus_ != nullptr ? kGpuMarginWidth : kMarginWidth);
    for_each_domain([&](Domain& domain, std::size_t d) { domain.release(constants, margin_, out[d]); });
    ranks_.exchange(out, in, ranks_.all_counts(out));
    for_each_domain([&](Domain& domain, std::size_t d) {
      for (const std::vector<Parcel>& parcels : in[d]) domain.adopt(parcels);
    });
    out = ranks_.empty_traffic<Parcel>();
    in = ranks_.empty_traffic<Parcel>();
    for_each_domain([&](Domain& domain, std::size_t d) { domain.copy_margins(margin_, out[d]); });
    motion_counts_ = ranks_.all_counts(out);
    ranks_.exchange(out, in, motion_counts_);
    for_each_domain([&](Domain& domain, std::size_t d) {
      for (unsigned k = 0; k < slabs_.num; ++k) domain.add_ghosts(k, in[d][k]);
    });
  }
  std::int64_t covered = (margin_ - constants.contact_reach) / 2;
  for (const auto& domain : domains_)
    covered = std::min(covered, domain->sort(constants, margin_, report.times));
  {
    ScopedPhase timing(report.times, Phase::sort);
    for_each_domain([](Domain& domain, std::size_t) { domain.find_borders(); });
  }
  const std::vector<std::int64_t> all = ranks_.all_of(covered);
  max_displacement_ = *std::min_element(all.begin(), all.end());
  displacement_ = 0;
  motion_out_ = ranks_.empty_traffic<ParcelMotion>();
  motion_in_ = ranks_.empty_traffic<ParcelMotion>();
  is_sorted_ = true;
  sum_memory();
  ++report.totals.num_sorts;
}

void DomainGroup::update_ghosts() {
  if (link_ != nullptr) {
    link_->update_ghosts();
    return;
  }
  for_each_domain([&](const Domain& domain, std::size_t d) {
    for (unsigned k = 0; k < slabs_.num; ++k) domain.pack(k, motion_out_[d][k]);
  });
  ranks_.exchange(motion_out_, motion_in_, motion_counts_);
  for_each_domain([&](Domain& domain, std::size_t d) {
    for (unsigned k = 0; k < slabs_.num; ++k) domain.unpack(k, motion_in_[d][k]);
  });
}

void DomainGroup::step(const StepConstants& constants, const StepRequest& request, const Deadline& deadline,
                       StepReport& report) {
  const BallFlight flight = fly(physics_.ball, ball_, request.dt_s);
  const BallMotion motion =
      ball_motion(physics_.world, physics_.ball, ball_, flight, constants.ball_contact_m);
  const std::uint32_t key = rounding_key(physics_.seed, step_);
  const TimeStep time_step{constants, request.method, request.neighbors, motion, key};
  StepOutcome mine;
  {
    ScopedPhase timing(report.times, Phase::collide_integrate);
    for (const auto& domain : domains_) domain->start(time_step);
  }
  if (physics_.parcels.contacts && !are_ghosts_current_) {
    ScopedPhase timing(report.times, Phase::grid);
    update_ghosts();
  }
  {
    ScopedPhase timing(report.times, Phase::collide_integrate);
    for (const auto& domain : domains_) domain->step_borders();
    for (const auto& domain : domains_) mine.tally.add(domain->finish());
  }
  ScopedPhase timing(report.times, Phase::ball);
  mine.is_time_up = ranks_.is_first() && deadline.has_passed();
  CpuTally sum;
  for (const StepOutcome& outcome : ranks_.all_of(mine)) {
    sum.add(outcome.tally);
    is_time_up_ = is_time_up_ || outcome.is_time_up;
  }
  displacement_ += sum.max_displacement;
  for (const auto& domain : domains_) domain->add_displacement(sum.max_displacement);
  if (physics_.ball.exists)
    advance_ball(physics_.world, physics_.ball, flight, sum.ball, constants.impulse_unit_kg_mps, ball_);
  StepTotals totals = totals_of(constants, sum);
  totals.num_steps = 1;
  totals.first_invalid_step = step_;
  report.totals += totals;
  are_ghosts_current_ = false;
  ++step_;
}

}  // namespace pf
