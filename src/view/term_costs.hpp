// What each term of the model costs: the mean time of a step with it less that without it, as far as both
// have been seen in this run. Nothing is timed on the side; a term that was never switched has no figure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "app/simulation.hpp"

namespace pf {

enum class Term { parcels, contacts, friction, magnus };
constexpr std::size_t kNumTerms = 4;
constexpr std::array<const char*, kNumTerms> kTermNames = {"parcels", "contacts", "friction", "Magnus"};

class TermCosts {
 public:
  // One frame that stepped; others are ignored. Everything starts anew when N, method or boundary change.
  void add_frame(const FrameView& frame);

  // Milliseconds per step of the present settings.
  double step_ms() const { return means_[mask_].ms; }
  // Milliseconds per step that the term costs, all others as they are; empty until both have been seen.
  std::optional<double> cost_ms(Term term) const;

 private:
  struct Mean {
    double ms = 0.0;
    std::uint32_t num_frames = 0;
  };

  std::array<Mean, 1U << kNumTerms> means_{};  // by the set of terms that are on
  std::uint32_t mask_ = 0;
  Settings seen_;
};

}  // namespace pf
