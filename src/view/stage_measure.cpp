// What the stage measures beside the steps: copy bandwidth, accuracy, costs of terms.
#include <new>

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
    accuracy_.follow(simulation_.view(), simulation_.backend());
  } else {
    accuracy_.forget();
  }
  panel_.set_readout(accuracy_.is_followed() ? &accuracy_.readout() : nullptr);
}

// Only beside a window that shows the costs, and not while it is filmed. The time goes to no phase: it
// belongs to no step and to no picture.
void Stage::follow_terms() {
  const FrameView& view = simulation_.view();
  if (!term_costs_.are_of(view)) overlay_.set_terms("");
  if (overlay_is_of_first()) return term_costs_.pause();
  const bool is_shown =
      context_.window() != nullptr && switches_.overlay_mode == static_cast<int>(OverlayMode::full);
  if (!is_shown || recorder_.is_recording()) {
    term_costs_.pause();
    return;
  }
  if (switches_.measure_terms) term_costs_.request();
  switches_.measure_terms = false;
  term_costs_.follow(view, simulation_.backend());
  overlay_.set_terms(term_costs_.are_of(view) ? term_costs_.text() : "");
}

}  // namespace pf
