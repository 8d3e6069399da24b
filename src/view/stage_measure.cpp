// The stage's measurements beside the steps: copy bandwidth, accuracy, costs of terms.
#include <new>
#include <utility>

#include "core/error.hpp"
#include "view/stage_loop.hpp"

namespace pf {

// The reference of the overlay's share of copy bandwidth, once per backend. Without it the overlay shows no
// share.
void Stage::measure_copy_bandwidth() {
  Backend& backend = simulation_.backend();
  const std::size_t num_bytes = backend.name() == "cuda" ? 256U << 20 : 32U << 20;  // beyond the caches
  try {
    overlay_.set_copy_bandwidth(backend.measure_copy_bandwidth(num_bytes));
  } catch (const DeviceError&) {  // no memory for the copy
    overlay_.set_copy_bandwidth(0.0);
  } catch (const std::bad_alloc&) {
    overlay_.set_copy_bandwidth(0.0);
  }
}

// Measuring takes time of the panel that shows it.
void Stage::follow_accuracy() {
  ScopedPhase timing(times_, Phase::panel);
  if (panel_.shows_accuracy()) {
    accuracy_.follow(simulation_.view(), simulation_.backend(), Clock::now());
  } else {
    accuracy_.forget();
  }
  panel_.set_readout(accuracy_.is_followed() ? &accuracy_.readout() : nullptr);
}

// Why the costs of terms are not measured now; null: they are.
const char* Stage::obstacle_to_terms() {
  if (context_.window() == nullptr) return "Costs of terms are shown in a window";
  if (overlay_is_of_first()) return "Costs of terms are measured with one flight; X ends the second one";
  if (switches_.overlay_mode != static_cast<int>(OverlayMode::full))
    return "Costs of terms are shown above the full overlay; O brings it";
  if (shown_overlay() != OverlayMode::full)
    return "Costs of terms are shown above the full overlay: make the window wider, or hide the panel (H)";
  if (recorder_.is_recording()) return "Costs of terms are not measured while a film is recorded";
  return nullptr;
}

// Only beside a window that shows the costs, and not while it is filmed. The time goes to no phase: it
// belongs to no step and to no picture.
void Stage::follow_terms() {
  const FrameView& view = simulation_.view();
  if (!term_costs_.are_of(view)) overlay_.set_terms("");
  const bool is_requested = std::exchange(switches_.measure_terms, false);
  if (const char* why = obstacle_to_terms(); why != nullptr) {
    if (is_requested) notice_.show(why, Clock::now());
    return term_costs_.pause();
  }
  if (is_requested) term_costs_.request();
  if (is_requested && view.paused)
    notice_.show("Costs of terms are measured once the flight goes on (space)", Clock::now());
  term_costs_.follow(view, simulation_.backend());
  overlay_.set_terms(term_costs_.are_of(view) ? term_costs_.text() : "");
}

}  // namespace pf
