#include "view/term_costs.hpp"

#include <algorithm>
#include <tuple>

namespace pf {
namespace {

std::uint32_t bit(Term term) { return 1U << static_cast<unsigned>(term); }

std::uint32_t mask_of(const Settings& s) {
  std::uint32_t mask = 0;
  if (s.air == Air::parcels) mask |= bit(Term::parcels);
  if (s.contacts) mask |= bit(Term::contacts);
  if (s.friction > 0.0) mask |= bit(Term::friction);
  if (s.magnus) mask |= bit(Term::magnus);
  return mask;
}

bool same_work(const Settings& a, const Settings& b) {
  const auto work = [](const Settings& s) {
    return std::tuple(s.area_fraction, s.method, s.neighbors, s.boundary, s.ball_present,
                      s.displacement_per_step, s.dt_s, s.threads, s.name);
  };
  // N only tells two runs with parcels apart.
  const bool same_number = a.num_parcels == b.num_parcels || a.air != Air::parcels || b.air != Air::parcels;
  return work(a) == work(b) && same_number;
}

}  // namespace

void TermCosts::add_frame(const FrameView& frame) {
  if (frame.frame_totals.num_steps == 0) return;
  if (!same_work(*frame.settings, seen_)) means_ = {};
  seen_ = *frame.settings;
  mask_ = mask_of(seen_);
  const double ms = (frame.times[Phase::sort] + frame.times[Phase::grid] +
                     frame.times[Phase::collide_integrate] + frame.times[Phase::ball]) /
                    static_cast<double>(frame.frame_totals.num_steps);
  Mean& mean = means_[mask_];
  mean.num_frames = std::min(mean.num_frames + 1, 60U);  // about the last second
  mean.ms += (ms - mean.ms) / mean.num_frames;
}

std::optional<double> TermCosts::cost_ms(Term term) const {
  const Mean& with = means_[mask_ | bit(term)];
  const Mean& without = means_[mask_ & ~bit(term)];
  if (with.num_frames == 0 || without.num_frames == 0) return std::nullopt;
  return with.ms - without.ms;
}

}  // namespace pf
