// Drag on a held ball and its hits, over what is known in closed form.
#pragma once

#include <cstdint>
#include <optional>

#include "core/vec2.hpp"

namespace pf {

struct FrameView;
struct StepTotals;

// Relative to free-molecular flow past a smooth disc (model/free_flow.hpp), with standard errors from the
// number of hits.
struct FreeFlowFigures {
  double drag_over_theory = 0.0, drag_error = 0.0;
  double hits_over_theory = 0.0, hits_error = 0.0;
};

// A uniform stream of parcels that do not touch each other past a smooth ball that is held still.
struct FreeFlow {
  Vec2d flow_mps;
  double speed_ratio = 0.0;
  double hits_per_s = 0.0;  // by theory
  double drag_n = 0.0;      // by theory, along the stream
  double lasts_s = 0.0;     // until the first parcels that have hit the ball may return through the world

  bool operator==(const FreeFlow&) const = default;
};

// None if the forces are not known in closed form.
std::optional<FreeFlow> free_flow_of(const FrameView& view);

// Compares from the moment in which air is spawned, as long as it is undisturbed and nothing that matters
// changes. When the flow has lasted for lasts_s the figures stay as they are.
class FreeFlowWatch {
 public:
  // Parcels have been spawned; the next frame is their first one.
  void spawned();
  // The air is of unknown age.
  void forget();
  // Call at the end of each frame. frame: its totals, which are in those of the view; frame_s: simulated.
  void follow(const FrameView& view, const StepTotals& frame, double frame_s);
  // None before the first hit.
  const std::optional<FreeFlowFigures>& figures() const { return figures_; }

 private:
  struct Start {
    FreeFlow flow;
    std::uint64_t num_hits = 0;
    Vec2d impulse_kg_mps;
    double simulated_s = 0.0;
  };

  bool is_fresh_ = false;
  std::optional<Start> start_;
  std::optional<FreeFlowFigures> figures_;
};

}  // namespace pf
